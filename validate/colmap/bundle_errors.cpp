#include "validate/colmap/bundle_errors.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <cmath>
#include <limits>

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
  Eigen::Vector2d residual_px;  ///< projected minus seen
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

/// returns  nothing behind the camera, or where its lens shows nothing
std::optional<Linear> linearize(const BundleView& view, std::size_t index,
                                const Eigen::Vector3d& point, const Eigen::Vector2d& seen) {
  const Eigen::Vector3d x = view.camera_from_bundle * point;
  if (!(x.z() > 0.0)) return std::nullopt;
  const PointToPixel by_x = derivative(*view.camera, x);
  const Eigen::Vector2d off = view.camera->pixel_from_point(x) - seen;
  if (!by_x.allFinite() || !off.allFinite()) return std::nullopt;
  Eigen::Matrix<double, 3, 6> x_by_pose;
  x_by_pose << -cross_matrix(x), Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d& x_by_point = view.camera_from_bundle.rotation;
  return Linear{.view = index,
                .by_pose = by_x * x_by_pose,
                .by_point = by_x * x_by_point,
                .depth_by_pose = x_by_pose.row(2) / x.z(),
                .depth_by_point = x_by_point.row(2) / x.z(),
                .residual_px = off};
}

struct Linearized {
  std::vector<std::vector<Linear>> by_point;
  std::vector<std::size_t> num_by_view;
  double squares_px2 = 0.0;    ///< sum of squared residuals
  std::size_t num = 0;         ///< observations
  Eigen::Index num_spare = 0;  ///< coordinates of observations less unknowns, but for the gauge
};

Linearized linearize(const Bundle& bundle) {
  Linearized all;
  all.by_point.resize(bundle.points.size());
  all.num_by_view.resize(bundle.views.size());
  for (std::size_t v = 0; v < bundle.views.size(); ++v)
    for (const BundleView::Observation& seen : bundle.views[v].observations)
      if (const auto one = linearize(bundle.views[v], v, bundle.points[seen.point], seen.pixel))
        all.by_point[seen.point].push_back(*one);
  all.num_spare = kNumGauge - 6 * static_cast<Eigen::Index>(bundle.views.size());
  for (std::vector<Linear>& seen : all.by_point) {
    if (seen.size() < 2) seen.clear();
    if (seen.empty()) continue;
    all.num += seen.size();
    all.num_spare += 2 * static_cast<Eigen::Index>(seen.size()) - 3;
    for (const Linear& one : seen) {
      ++all.num_by_view[one.view];
      all.squares_px2 += one.residual_px.squaredNorm();
    }
  }
  return all;
}

/// Whether the drift is told: some views are in it, and each of them sees a point.
bool has_drift(const Bundle& bundle, const Linearized& all) {
  bool is_any = false;
  for (std::size_t v = 0; v < bundle.views.size(); ++v) {
    if (bundle.views[v].weight == 0.0) continue;
    if (all.num_by_view[v] == 0) return false;
    is_any = true;
  }
  return is_any;
}

constexpr Eigen::Index first_of(std::size_t view) { return static_cast<Eigen::Index>(6 * view); }

/// The normal equations of the poses, and the drift by them, with the points, which follow the
/// poses, eliminated.
struct Reduced {
  Eigen::MatrixXd normal;
  Eigen::VectorXd drift;
  Eigen::VectorXd gradient;         ///< half of the squares' slope
  double variance_by_points = 0.0;  ///< of the drift at fixed poses, for observations off by 1 px
};

Reduced reduce(const Bundle& bundle, const Linearized& all) {
  const Eigen::Index num = first_of(bundle.views.size());
  Reduced reduced{Eigen::MatrixXd::Zero(num, num), Eigen::VectorXd::Zero(num),
                  Eigen::VectorXd::Zero(num), 0.0};
  for (const std::vector<Linear>& seen : all.by_point) {
    if (seen.empty()) continue;
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d drift = Eigen::Vector3d::Zero(), gradient = Eigen::Vector3d::Zero();
    std::vector<PoseToPoint> mixed;
    for (const Linear& one : seen) {
      const double weight =
          bundle.views[one.view].weight /
          static_cast<double>(std::max<std::size_t>(all.num_by_view[one.view], 1));
      normal += one.by_point.transpose() * one.by_point;
      drift += weight * one.depth_by_point.transpose();
      gradient += one.by_point.transpose() * one.residual_px;
      mixed.push_back(one.by_pose.transpose() * one.by_point);
      reduced.drift.segment<6>(first_of(one.view)) += weight * one.depth_by_pose.transpose();
      reduced.gradient.segment<6>(first_of(one.view)) += one.by_pose.transpose() * one.residual_px;
    }
    const Eigen::LDLT<Eigen::Matrix3d> solver(normal);
    const Eigen::Vector3d follows = solver.solve(drift), moves = solver.solve(gradient);
    reduced.variance_by_points += drift.dot(follows);
    for (std::size_t a = 0; a < seen.size(); ++a) {
      const Eigen::Index column = first_of(seen[a].view);
      reduced.drift.segment<6>(column) -= mixed[a] * follows;
      reduced.gradient.segment<6>(column) -= mixed[a] * moves;
      reduced.normal.block<6, 6>(column, column) += seen[a].by_pose.transpose() * seen[a].by_pose;
      const Eigen::Matrix<double, 3, 6> solved = solver.solve(mixed[a].transpose());
      for (std::size_t b = 0; b < seen.size(); ++b)
        reduced.normal.block<6, 6>(first_of(seen[b].view), column) -= mixed[b] * solved;
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
    scale = first_of(v) + 3 + axis;
  }
  return {0, 1, 2, 3, 4, 5, scale};
}

/// The poses' adjustment, held where it stands, solved. What does not change with where the bundle stands may be asked.
class Adjustment {
 public:
  /// returns  nothing where something is left open, or there are too many views
  static std::optional<Adjustment> of(const Bundle& bundle) {
    if (bundle.views.size() < 2 || bundle.views.size() > kMostBundleViews) return std::nullopt;
    Adjustment adjustment;
    adjustment.linear = linearize(bundle);
    if (adjustment.linear.num_spare <= 0) return std::nullopt;
    adjustment.reduced_ = reduce(bundle, adjustment.linear);
    for (const Eigen::Index held : held_parameters(bundle)) adjustment.hold(held);
    const Eigen::VectorXd alone = adjustment.reduced_.normal.diagonal();
    adjustment.solver_.compute(adjustment.reduced_.normal);
    if (adjustment.solver_.info() != Eigen::Success) return std::nullopt;
    // What is left of an unknown that nothing holds is rounding.
    constexpr double kHeld = 1e-11;
    const Eigen::ArrayXd pivots = adjustment.solver_.matrixLLT().diagonal().array().square();
    if ((pivots <= kHeld * alone.array()).any()) return std::nullopt;
    return adjustment;
  }

  /// Sum of the variances of functions of the poses, for observations off by 1 px.
  /// by_pose   a row a function
  double variance(const Eigen::MatrixXd& by_pose) const {
    Eigen::MatrixXd columns = by_pose.transpose();
    for (const Eigen::Index held : held_) columns.row(held).setZero();
    return solver_.matrixL().solve(columns).squaredNorm();
  }
  double drift_variance() const {
    return variance(reduced_.drift.transpose()) + reduced_.variance_by_points;
  }
  /// By how much the squares fall where the poses are adjusted, px^2.
  double fall_px2() const { return solver_.matrixL().solve(reduced_.gradient).squaredNorm(); }
  double noise_px(double squares_px2) const {
    return std::sqrt(squares_px2 / static_cast<double>(linear.num_spare));
  }

  Linearized linear;

 private:
  void hold(Eigen::Index parameter) {
    held_.push_back(parameter);
    reduced_.normal.row(parameter).setZero();
    reduced_.normal.col(parameter).setZero();
    reduced_.normal(parameter, parameter) = 1.0;
    reduced_.drift[parameter] = reduced_.gradient[parameter] = 0.0;
  }

  Reduced reduced_;
  std::vector<Eigen::Index> held_;
  Eigen::LLT<Eigen::MatrixXd> solver_;
};

/// The cameras' centres by their poses, and what a similarity takes away of their errors.
struct Centres {
  std::vector<Eigen::Vector3d> at;
  Eigen::MatrixXd by_pose;           ///< 3 rows a view
  Eigen::MatrixXd after_similarity;  ///< the same, aligned
  Eigen::RowVectorXd scale_by_pose;  ///< relative, of what is aligned
};

Centres centres_of(const Bundle& bundle) {
  const auto num = static_cast<Eigen::Index>(bundle.views.size());
  Centres centres{.at = {},
                  .by_pose = Eigen::MatrixXd::Zero(3 * num, 6 * num),
                  .after_similarity = {},
                  .scale_by_pose = {}};
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (std::size_t v = 0; v < bundle.views.size(); ++v) {
    const Pose& pose = bundle.views[v].camera_from_bundle;
    centres.at.push_back(pose.inverse().translation);
    middle += centres.at.back() / static_cast<double>(num);
    centres.by_pose.block<3, 3>(3 * static_cast<Eigen::Index>(v), first_of(v) + 3) =
        -pose.rotation.transpose();
  }
  double radius = 0.0;
  for (const Eigen::Vector3d& centre : centres.at)
    radius = std::max(radius, (centre - middle).norm());
  Eigen::MatrixXd similarity = Eigen::MatrixXd::Zero(3 * num, kNumGauge);
  for (Eigen::Index v = 0; v < num; ++v) {
    const Eigen::Vector3d arm = (centres.at[static_cast<std::size_t>(v)] - middle) / radius;
    similarity.block<3, 3>(3 * v, 0).setIdentity();
    similarity.block<3, 3>(3 * v, 3) = cross_matrix(arm);
    similarity.block<3, 1>(3 * v, 6) = arm;
  }
  // Of a straight flight the turn about it is open, and takes nothing away.
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver;
  solver.setThreshold(1e-6);
  solver.compute(similarity);
  const Eigen::MatrixXd taken = solver.solve(centres.by_pose);
  centres.after_similarity = centres.by_pose - similarity * taken;
  centres.scale_by_pose = taken.row(6) / radius;
  return centres;
}

/// The ways and turns of the bundle's steps by the poses: three rows a step.
struct Steps {
  Eigen::MatrixXd way_by_pose;
  Eigen::MatrixXd turn_px_by_pose;
};

Steps steps_of(const Bundle& bundle, const Centres& centres) {
  const auto num = static_cast<Eigen::Index>(bundle.steps.size());
  const Eigen::Index num_unknowns = first_of(bundle.views.size());
  Steps steps{Eigen::MatrixXd::Zero(3 * num, num_unknowns),
              Eigen::MatrixXd::Zero(3 * num, num_unknowns)};
  for (Eigen::Index i = 0; i < num; ++i) {
    const auto [a, b] = bundle.steps[static_cast<std::size_t>(i)];
    const BundleView& from = bundle.views[a];
    const Eigen::Matrix3d& a_from_bundle = from.camera_from_bundle.rotation;
    const Eigen::Matrix3d a_from_b =
        a_from_bundle * bundle.views[b].camera_from_bundle.rotation.transpose();
    const Eigen::Vector3d way = a_from_bundle * (centres.at[b] - centres.at[a]);
    auto ways = steps.way_by_pose.middleRows<3>(3 * i);
    ways = a_from_bundle * (centres.by_pose.middleRows<3>(static_cast<Eigen::Index>(3 * b)) -
                            centres.by_pose.middleRows<3>(static_cast<Eigen::Index>(3 * a))) -
           way * centres.scale_by_pose;
    ways.middleCols<3>(first_of(a)) -= cross_matrix(way);
    auto turns = steps.turn_px_by_pose.middleRows<3>(3 * i);
    turns.middleCols<3>(first_of(a)) = from.camera->fx_px * Eigen::Matrix3d::Identity();
    turns.middleCols<3>(first_of(b)) = -from.camera->fx_px * a_from_b;
  }
  return steps;
}

/// Observations by point, so that points can be adjusted one by one.
struct Sight {
  std::size_t view = 0;
  std::size_t point = 0;
  Eigen::Vector2d pixel;
};
std::vector<std::vector<Sight>> sights_of(const Bundle& bundle) {
  std::vector<std::vector<Sight>> sights(bundle.points.size());
  for (std::size_t v = 0; v < bundle.views.size(); ++v)
    for (const BundleView::Observation& seen : bundle.views[v].observations)
      sights[seen.point].push_back({v, seen.point, seen.pixel});
  return sights;
}

/// Squared distance of an observation from its point's projection, cut at kMostResidual_px, as it is of what lies
/// behind a camera.
double squared_distance_px2(const Bundle& bundle, const Sight& sight) {
  constexpr double kMost_px2 = kMostResidual_px * kMostResidual_px;
  const BundleView& view = bundle.views[sight.view];
  const Eigen::Vector3d x = view.camera_from_bundle * bundle.points[sight.point];
  const double squared_px2 =
      x.z() > 0.0 ? (view.camera->pixel_from_point(x) - sight.pixel).squaredNorm() : kMost_px2;
  return squared_px2 < kMost_px2 ? squared_px2 : kMost_px2;
}

/// Squared distances of a point's observations, of which what is farther off than a pixel counts by its distance (Huber 1964).
double robust_squares_of(const Bundle& bundle, const std::vector<Sight>& sights,
                         const Eigen::Vector3d& point) {
  constexpr double kBehind_px = 1e3;
  double sum = 0.0;
  for (const Sight& sight : sights) {
    const BundleView& view = bundle.views[sight.view];
    const Eigen::Vector3d x = view.camera_from_bundle * point;
    const double distance_px =
        x.z() > 0.0 ? (view.camera->pixel_from_point(x) - sight.pixel).norm() : kBehind_px;
    sum += distance_px < 1.0 ? distance_px * distance_px : 2.0 * distance_px - 1.0;
  }
  return sum;
}

/// A point where the views that see it put it: steps of least squares (Gauss and Newton) of the robust sum. A step
/// that makes it worse is halved.
void adjust_point(const Bundle& bundle, const std::vector<Sight>& sights, Eigen::Vector3d& point) {
  constexpr int kMostSteps = 40, kMostHalves = 6;
  constexpr double kLeastFall = 1e-6;
  double squares_px2 = robust_squares_of(bundle, sights, point);
  for (int i = 0; i < kMostSteps; ++i) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    for (const Sight& sight : sights) {
      const auto one = linearize(bundle.views[sight.view], sight.view, point, sight.pixel);
      if (!one) continue;
      const double weight = 1.0 / std::max(1.0, one->residual_px.norm());
      normal += weight * one->by_point.transpose() * one->by_point;
      gradient += weight * one->by_point.transpose() * one->residual_px;
    }
    Eigen::Vector3d step = -normal.ldlt().solve(gradient);
    if (!step.allFinite()) return;
    const double before_px2 = squares_px2;
    for (int half = 0; half < kMostHalves; ++half, step *= 0.5) {
      const double now_px2 = robust_squares_of(bundle, sights, point + step);
      if (!(now_px2 < squares_px2)) continue;
      squares_px2 = now_px2;
      point += step;
      break;
    }
    if (squares_px2 >= (1.0 - kLeastFall) * before_px2) return;
  }
}

/// The point nearest to the rays of its views.
Eigen::Vector3d meeting_point(const Bundle& bundle, const std::vector<Sight>& sights) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Sight& sight : sights) {
    const Pose bundle_from_camera = bundle.views[sight.view].camera_from_bundle.inverse();
    const Eigen::Vector3d ray =
        bundle_from_camera.rotation *
        bundle.views[sight.view].camera->ray_from_pixel(sight.pixel).normalized();
    if (!ray.allFinite()) continue;
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - ray * ray.transpose();
    normal += across;
    sum += across * bundle_from_camera.translation;
  }
  return normal.ldlt().solve(sum);
}

}  // namespace

void triangulate(Bundle& bundle) {
  const std::vector<std::vector<Sight>> sights = sights_of(bundle);
  for (std::size_t i = 0; i < sights.size(); ++i) {
    if (sights[i].size() < 2) continue;
    bundle.points[i] = meeting_point(bundle, sights[i]);
    adjust_point(bundle, sights[i], bundle.points[i]);
  }
}

std::optional<BundleErrors> bundle_errors(const Bundle& bundle) {
  const auto adjustment = Adjustment::of(bundle);
  if (!adjustment) return std::nullopt;
  const Centres centres = centres_of(bundle);
  const Steps steps = steps_of(bundle, centres);
  const auto rms = [](double variance, std::size_t count) {
    return std::sqrt(variance / static_cast<double>(std::max<std::size_t>(count, 1)));
  };
  BundleErrors errors;
  errors.noise_px = adjustment->noise_px(adjustment->linear.squares_px2);
  if (has_drift(bundle, adjustment->linear)) errors.drift = std::sqrt(adjustment->drift_variance());
  errors.position = rms(adjustment->variance(centres.after_similarity), bundle.views.size());
  errors.step = rms(adjustment->variance(steps.way_by_pose), bundle.steps.size());
  errors.turn_px = rms(adjustment->variance(steps.turn_px_by_pose), bundle.steps.size());
  const bool is_finite = std::isfinite(errors.drift.value_or(0.0)) &&
                         std::isfinite(errors.position) && std::isfinite(errors.step) &&
                         std::isfinite(errors.turn_px);
  return is_finite ? std::optional(errors) : std::nullopt;
}

std::vector<double> explain(const Bundle& bundle) {
  std::vector<double> squares_px2(bundle.views.size(), 0.0);
  for (const std::vector<Sight>& sights : sights_of(bundle)) {
    if (sights.size() < 2) continue;
    for (const Sight& sight : sights)
      squares_px2[sight.view] += squared_distance_px2(bundle, sight);
  }
  return squares_px2;
}

std::size_t drop_lonely_views(Bundle& bundle) {
  constexpr std::size_t kLeastPoints = 3;
  std::size_t num_dropped = 0;
  // Without a view others may be lonely too.
  for (bool is_any = true; is_any;) {
    is_any = false;
    std::vector<std::size_t> num_shared(bundle.views.size(), 0);
    for (const std::vector<Sight>& sights : sights_of(bundle))
      if (sights.size() >= 2)
        for (const Sight& sight : sights) ++num_shared[sight.view];
    std::vector<std::optional<std::size_t>> index(bundle.views.size());
    std::vector<BundleView> kept;
    for (std::size_t v = 0; v < bundle.views.size(); ++v) {
      if (num_shared[v] < kLeastPoints) continue;
      index[v] = kept.size();
      kept.push_back(std::move(bundle.views[v]));
    }
    is_any = kept.size() < bundle.views.size();
    num_dropped += bundle.views.size() - kept.size();
    bundle.views = std::move(kept);
    std::vector<std::pair<std::size_t, std::size_t>> steps;
    for (const auto& [a, b] : bundle.steps)
      if (index[a] && index[b]) steps.emplace_back(*index[a], *index[b]);
    bundle.steps = std::move(steps);
  }
  return num_dropped;
}

std::optional<Improvement> improvement(const Bundle& bundle) {
  const auto adjustment = Adjustment::of(bundle);
  if (!adjustment) return std::nullopt;
  const double fall_px2 = std::min(adjustment->fall_px2(), adjustment->linear.squares_px2);
  const auto num = static_cast<double>(adjustment->linear.num);
  const auto num_unknowns = static_cast<double>(first_of(bundle.views.size()) - kNumGauge);
  Improvement found;
  found.noise_px = adjustment->noise_px(adjustment->linear.squares_px2 - fall_px2);
  found.moved_px = std::sqrt(fall_px2 / num);
  found.unsure_px = found.noise_px * std::sqrt(num_unknowns / num);
  return found;
}

std::vector<double> point_errors(const Bundle& bundle,
                                 const std::vector<Eigen::Vector3d>& directions) {
  const Linearized all = linearize(bundle);
  std::vector<double> errors;
  for (std::size_t i = 0; i < bundle.points.size(); ++i) {
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    for (const Linear& one : all.by_point[i]) normal += one.by_point.transpose() * one.by_point;
    const double variance = directions[i].dot(normal.ldlt().solve(directions[i]));
    errors.push_back(all.by_point[i].empty() || !(variance >= 0.0)
                         ? std::numeric_limits<double>::infinity()
                         : std::sqrt(variance));
  }
  return errors;
}

}  // namespace terracast::validate
