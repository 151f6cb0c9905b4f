#include "validate/colmap/drift_error.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace terracast::validate {

namespace {

/// Place, turn and scale, which no image tells.
constexpr Eigen::Index kNumGauge = 7;

using PoseRow = Eigen::Matrix<double, 1, 6>;
using PoseToPixel = Eigen::Matrix<double, 2, 6>;
using PointToPixel = Eigen::Matrix<double, 2, 3>;
using PoseToPoint = Eigen::Matrix<double, 6, 3>;

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

/// One observation, to first order. A pose moves by a small turn and shift in its camera's frame.
struct Linear {
  std::size_t view = 0;
  PoseToPixel by_pose;
  PointToPixel by_point;
  PoseRow depth_by_pose;  ///< logarithm of the point's depth
  Eigen::RowVector3d depth_by_point;
  double squared_residual_px2 = 0.0;
};

/// How a projection moves with its point in the camera's frame.
PointToPixel derivative(const Intrinsics& camera, const Eigen::Vector3d& point_camera) {
  const double step = 1e-6 * point_camera.norm();
  PointToPixel by_point;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d aside = step * Eigen::Vector3d::Unit(k);
    by_point.col(k) = (camera.pixel_from_point(point_camera + aside) -
                       camera.pixel_from_point(point_camera - aside)) /
                      (2.0 * step);
  }
  return by_point;
}

struct Linearized {
  std::vector<std::vector<Linear>> by_point;
  std::vector<std::size_t> num_by_view;
  double squares_px2 = 0.0;    ///< sum of squared residuals
  Eigen::Index num_spare = 0;  ///< coordinates of observations less unknowns, but for the gauge
};

Linearized linearize(const Bundle& bundle) {
  Linearized all;
  all.by_point.resize(bundle.points.size());
  all.num_by_view.resize(bundle.views.size());
  for (std::size_t v = 0; v < bundle.views.size(); ++v) {
    const BundleView& view = bundle.views[v];
    for (const BundleView::Observation& seen : view.observations) {
      const Eigen::Vector3d x = view.camera_from_bundle * bundle.points[seen.point];
      if (!(x.z() > 0.0)) continue;
      const PointToPixel by_x = derivative(*view.camera, x);
      const Eigen::Vector2d off = view.camera->pixel_from_point(x) - seen.pixel;
      if (!by_x.allFinite() || !off.allFinite()) continue;
      Eigen::Matrix<double, 3, 6> x_by_pose;
      x_by_pose << -cross_matrix(x), Eigen::Matrix3d::Identity();
      const Eigen::Matrix3d& x_by_point = view.camera_from_bundle.rotation;
      all.by_point[seen.point].push_back({.view = v,
                                          .by_pose = by_x * x_by_pose,
                                          .by_point = by_x * x_by_point,
                                          .depth_by_pose = x_by_pose.row(2) / x.z(),
                                          .depth_by_point = x_by_point.row(2) / x.z(),
                                          .squared_residual_px2 = off.squaredNorm()});
    }
  }
  all.num_spare = kNumGauge - 6 * static_cast<Eigen::Index>(bundle.views.size());
  for (std::vector<Linear>& seen : all.by_point) {
    if (seen.size() < 2) seen.clear();
    if (seen.empty()) continue;
    all.num_spare += 2 * static_cast<Eigen::Index>(seen.size()) - 3;
    for (const Linear& one : seen) {
      ++all.num_by_view[one.view];
      all.squares_px2 += one.squared_residual_px2;
    }
  }
  return all;
}

bool weighs_views_without_points(const Bundle& bundle, const Linearized& all) {
  for (std::size_t v = 0; v < bundle.views.size(); ++v)
    if (bundle.views[v].weight != 0.0 && all.num_by_view[v] == 0) return true;
  return false;
}

/// The normal equations of the poses, and the drift by them, with the points, which follow the
/// poses, eliminated.
struct Reduced {
  Eigen::MatrixXd normal;
  Eigen::VectorXd drift;
  double variance_by_points = 0.0;  ///< of the drift at fixed poses, for observations off by 1 px
};

Reduced reduce(const Bundle& bundle, const Linearized& all) {
  const auto at = [](std::size_t view) { return static_cast<Eigen::Index>(6 * view); };
  const Eigen::Index num = at(bundle.views.size());
  Reduced reduced{Eigen::MatrixXd::Zero(num, num), Eigen::VectorXd::Zero(num), 0.0};
  for (const std::vector<Linear>& seen : all.by_point) {
    if (seen.empty()) continue;
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d drift = Eigen::Vector3d::Zero();
    std::vector<PoseToPoint> mixed;
    for (const Linear& one : seen) {
      const double weight =
          bundle.views[one.view].weight / static_cast<double>(all.num_by_view[one.view]);
      normal += one.by_point.transpose() * one.by_point;
      drift += weight * one.depth_by_point.transpose();
      mixed.push_back(one.by_pose.transpose() * one.by_point);
      reduced.drift.segment<6>(at(one.view)) += weight * one.depth_by_pose.transpose();
    }
    const Eigen::LDLT<Eigen::Matrix3d> solver(normal);
    const Eigen::Vector3d follows = solver.solve(drift);
    reduced.variance_by_points += drift.dot(follows);
    for (std::size_t a = 0; a < seen.size(); ++a) {
      const Eigen::Index column = at(seen[a].view);
      reduced.drift.segment<6>(column) -= mixed[a] * follows;
      reduced.normal.block<6, 6>(column, column) += seen[a].by_pose.transpose() * seen[a].by_pose;
      const Eigen::Matrix<double, 3, 6> solved = solver.solve(mixed[a].transpose());
      for (std::size_t b = 0; b < seen.size(); ++b)
        reduced.normal.block<6, 6>(at(seen[b].view), column) -= mixed[b] * solved;
    }
  }
  return reduced;
}

/// The parameters that hold the bundle where it is: the first pose, and of the view farthest from
/// it the largest coordinate of the way between them, which holds the scale.
std::vector<Eigen::Index> held_parameters(const Bundle& bundle) {
  const Eigen::Vector3d first = bundle.views.front().camera_from_bundle.inverse().translation;
  double farthest = 0.0;
  Eigen::Index scale = 6;
  for (std::size_t v = 1; v < bundle.views.size(); ++v) {
    const Eigen::Vector3d way = bundle.views[v].camera_from_bundle * first;
    if (way.norm() <= farthest) continue;
    farthest = way.norm();
    Eigen::Index axis = 0;
    way.cwiseAbs().maxCoeff(&axis);
    scale = static_cast<Eigen::Index>(6 * v) + 3 + axis;
  }
  return {0, 1, 2, 3, 4, 5, scale};
}

}  // namespace

std::optional<DriftError> drift_error(const Bundle& bundle) {
  if (bundle.views.size() < 2 || bundle.views.size() > kMostDriftViews) return std::nullopt;
  const Linearized all = linearize(bundle);
  if (all.num_spare <= 0 || weighs_views_without_points(bundle, all)) return std::nullopt;
  Reduced reduced = reduce(bundle, all);
  // The drift does not change with where the bundle is held, so that it may be held anywhere.
  for (const Eigen::Index held : held_parameters(bundle)) {
    reduced.normal.row(held).setZero();
    reduced.normal.col(held).setZero();
    reduced.normal(held, held) = 1.0;
    reduced.drift[held] = 0.0;
  }
  const Eigen::VectorXd alone = reduced.normal.diagonal();
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> solver(reduced.normal);  // in place
  if (solver.info() != Eigen::Success) return std::nullopt;
  // What is left of an unknown that nothing holds is rounding.
  constexpr double kHeld = 1e-11;
  const Eigen::ArrayXd pivots = reduced.normal.diagonal().array().square();
  if ((pivots <= kHeld * alone.array()).any()) return std::nullopt;
  const double variance =
      reduced.drift.dot(solver.solve(reduced.drift)) + reduced.variance_by_points;
  if (!std::isfinite(variance) || variance < 0.0) return std::nullopt;
  return DriftError{.per_px = std::sqrt(variance),
                    .noise_px = std::sqrt(all.squares_px2 / static_cast<double>(all.num_spare))};
}

}  // namespace terracast::validate
