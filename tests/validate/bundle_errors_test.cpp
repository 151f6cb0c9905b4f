#include "validate/colmap/drift_error.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <random>

namespace terracast::validate {
namespace {

using Eigen::Vector3d;

const Intrinsics kCamera{.width_px = 640,
                         .height_px = 480,
                         .fx_px = 300.0,
                         .fy_px = 310.0,
                         .cx_px = 320.0,
                         .cy_px = 240.0};

/// Five views along a line over 30 points, each seen by some of them, with keypoints off by a few
/// tenths of a pixel.
Bundle flight() {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> spread(-1.0, 1.0);
  Bundle bundle;
  for (int i = 0; i < 30; ++i)
    bundle.points.emplace_back(20.0 * spread(random), 15.0 * spread(random),
                               50.0 + 10.0 * spread(random));
  for (int v = 0; v < 5; ++v) {
    BundleView view{
        .camera = &kCamera, .camera_from_bundle = {}, .observations = {}, .weight = 0.0};
    view.camera_from_bundle.rotation =
        Eigen::AngleAxisd(0.05 * v, Vector3d(0.2, 1.0, -0.3).normalized()).toRotationMatrix();
    view.camera_from_bundle.translation = Vector3d(-4.0 * v, 0.5 * v, 3.0 - 2.0 * v);
    for (std::size_t i = 0; i < bundle.points.size(); ++i) {
      if ((i + static_cast<std::size_t>(v)) % 4 == 0) continue;
      const Eigen::Vector2d pixel =
          kCamera.pixel_from_point(view.camera_from_bundle * bundle.points[i]);
      view.observations.push_back(
          {i, pixel + 0.3 * Eigen::Vector2d(spread(random), spread(random))});
    }
    view.weight = std::array{0.5, 0.5, 0.0, -0.25, -0.75}[static_cast<std::size_t>(v)];
    bundle.views.push_back(std::move(view));
  }
  return bundle;
}

Bundle moved(Bundle bundle, const Eigen::VectorXd& by) {
  Eigen::Index at = 0;
  for (BundleView& view : bundle.views) {
    const Vector3d turn = by.segment<3>(at);
    Pose step;
    if (turn.norm() > 0.0)
      step.rotation = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
    step.translation = by.segment<3>(at + 3);
    view.camera_from_bundle = step * view.camera_from_bundle;
    at += 6;
  }
  for (Vector3d& point : bundle.points) {
    point += by.segment<3>(at);
    at += 3;
  }
  return bundle;
}

Eigen::VectorXd residuals(const Bundle& bundle) {
  std::vector<double> all;
  for (const BundleView& view : bundle.views)
    for (const auto& seen : view.observations) {
      const Eigen::Vector2d off =
          kCamera.pixel_from_point(view.camera_from_bundle * bundle.points[seen.point]) -
          seen.pixel;
      all.insert(all.end(), {off.x(), off.y()});
    }
  return Eigen::Map<Eigen::VectorXd>(all.data(), static_cast<Eigen::Index>(all.size()));
}

double drift(const Bundle& bundle) {
  double sum = 0.0;
  for (const BundleView& view : bundle.views)
    for (const auto& seen : view.observations)
      sum += view.weight / static_cast<double>(view.observations.size()) *
             std::log((view.camera_from_bundle * bundle.points[seen.point]).z());
  return sum;
}

// All unknowns at once, derivatives by differences of the whole, the gauge left to the
// pseudo-inverse.
struct BruteForce {
  Eigen::MatrixXd unknown_by_residual;
  Eigen::VectorXd drift_by_unknown;
};

BruteForce brute_force(const Bundle& bundle) {
  const auto num = static_cast<Eigen::Index>(6 * bundle.views.size() + 3 * bundle.points.size());
  Eigen::MatrixXd by_unknown(residuals(bundle).size(), num);
  Eigen::VectorXd drift_by_unknown(num);
  constexpr double kStep = 1e-5;
  for (Eigen::Index k = 0; k < num; ++k) {
    const Bundle more = moved(bundle, kStep * Eigen::VectorXd::Unit(num, k));
    const Bundle less = moved(bundle, -kStep * Eigen::VectorXd::Unit(num, k));
    by_unknown.col(k) = (residuals(more) - residuals(less)) / (2.0 * kStep);
    drift_by_unknown[k] = (drift(more) - drift(less)) / (2.0 * kStep);
  }
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver;
  solver.setThreshold(1e-8);
  solver.compute(by_unknown);
  EXPECT_EQ(solver.rank(), num - 7);
  return {solver.pseudoInverse(), drift_by_unknown};
}

TEST(DriftError, IsThatOfTheWholeAdjustmentByBruteForce) {
  const Bundle bundle = flight();
  const BruteForce whole = brute_force(bundle);
  const double expected = (whole.unknown_by_residual.transpose() * whole.drift_by_unknown).norm();
  const auto found = drift_error(bundle);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->per_px / expected, 1.0, 1e-5);
}

TEST(DriftError, IsTheSpreadOfDriftsOfAdjustedObservationsThatErr) {
  Bundle right = flight();
  for (BundleView& view : right.views)
    for (auto& seen : view.observations)
      seen.pixel = kCamera.pixel_from_point(view.camera_from_bundle * right.points[seen.point]);
  const BruteForce whole = brute_force(right);
  constexpr double kNoise_px = 0.2;
  constexpr int kNum = 400;
  std::mt19937 random(9);
  std::normal_distribution<double> noise(0.0, kNoise_px);
  double drifts = 0.0, predicted = 0.0, noises = 0.0;
  for (int draw = 0; draw < kNum; ++draw) {
    Bundle bundle = right;
    for (BundleView& view : bundle.views)
      for (auto& seen : view.observations)
        seen.pixel += Eigen::Vector2d(noise(random), noise(random));
    for (int step = 0; step < 2; ++step)
      bundle = moved(bundle, -(whole.unknown_by_residual * residuals(bundle)));
    const auto found = drift_error(bundle);
    ASSERT_TRUE(found);
    drifts += std::pow(drift(bundle) - drift(right), 2) / kNum;
    predicted += std::pow(found->per_px * found->noise_px, 2) / kNum;
    noises += std::pow(found->noise_px, 2) / kNum;
  }
  // A variance of 400 draws is known to sqrt(2 / 400) = 7 %, a root of it to 3.5 %; three of these.
  EXPECT_NEAR(std::sqrt(predicted / drifts), 1.0, 0.11);
  // Of 400 draws of some hundred residuals: to 0.4 %.
  EXPECT_NEAR(std::sqrt(noises) / kNoise_px, 1.0, 0.015);
}

TEST(DriftError, IsTheSameWhereverAndHoweverLargeTheBundleStands) {
  const Bundle bundle = flight();
  Bundle other = bundle;
  Pose turn;
  turn.rotation = Eigen::AngleAxisd(1.3, Vector3d(1.0, 2.0, -0.5).normalized()).toRotationMatrix();
  turn.translation = Vector3d(300.0, -200.0, 50.0);
  for (Vector3d& point : other.points) point = turn * Vector3d(7.0 * point);
  for (BundleView& view : other.views) {
    view.camera_from_bundle.translation *= 7.0;
    view.camera_from_bundle = view.camera_from_bundle * turn.inverse();
  }
  EXPECT_NEAR(drift_error(other)->per_px / drift_error(bundle)->per_px, 1.0, 1e-5);
  EXPECT_NEAR(drift_error(other)->noise_px / drift_error(bundle)->noise_px, 1.0, 1e-9);
}

TEST(DriftError, OfViewsThatShareNoPointIsUnknown) {
  // Whichever way the roundings fall.
  for (std::size_t num_first = 10; num_first <= 20; ++num_first) {
    Bundle bundle = flight();
    for (std::size_t v = 0; v < bundle.views.size(); ++v)
      std::erase_if(bundle.views[v].observations,
                    [&](const auto& seen) { return (seen.point < num_first) != (v < 2); });
    EXPECT_FALSE(drift_error(bundle)) << num_first;
  }
}

TEST(DriftError, OfAViewWithoutPointsIsUnknown) {
  Bundle bundle = flight();
  bundle.views[0].observations.clear();
  EXPECT_FALSE(drift_error(bundle));
}

TEST(DriftError, OfMoreViewsThanItTakesOrNoneIsUnknown) {
  Bundle bundle = flight();
  bundle.views.resize(kMostDriftViews + 1, bundle.views.back());
  EXPECT_FALSE(drift_error(bundle));
  EXPECT_FALSE(drift_error({}));
}

}  // namespace
}  // namespace terracast::validate
