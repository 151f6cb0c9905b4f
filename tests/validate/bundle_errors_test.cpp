#include "validate/colmap/bundle_errors.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <functional>
#include <numeric>
#include <random>

#include "validate/colmap/similarity.h"

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
  bundle.steps = {{0, 1}, {2, 3}, {3, 4}};
  return bundle;
}

/// Observations where the poses and points have them.
Bundle exact(Bundle bundle) {
  for (BundleView& view : bundle.views)
    for (auto& seen : view.observations)
      seen.pixel = kCamera.pixel_from_point(view.camera_from_bundle * bundle.points[seen.point]);
  return bundle;
}

Bundle with_noise(Bundle bundle, double noise_px, std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, noise_px);
  for (BundleView& view : bundle.views)
    for (auto& seen : view.observations)
      seen.pixel += Eigen::Vector2d(noise(random), noise(random));
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

std::vector<Vector3d> centres(const Bundle& bundle) {
  std::vector<Vector3d> all;
  for (const BundleView& view : bundle.views)
    all.push_back(view.camera_from_bundle.inverse().translation);
  return all;
}

Eigen::VectorXd stacked(const std::vector<Vector3d>& vectors) {
  Eigen::VectorXd all(static_cast<Eigen::Index>(3 * vectors.size()));
  for (std::size_t i = 0; i < vectors.size(); ++i)
    all.segment<3>(static_cast<Eigen::Index>(3 * i)) = vectors[i];
  return all;
}

/// What is asked of a bundle that stands off another: all by the definitions, nothing to first order.
using Figure = std::function<Eigen::VectorXd(const Bundle& off, const Bundle& right)>;

Eigen::VectorXd position_errors(const Bundle& off, const Bundle& right) {
  const std::vector<Vector3d> found = centres(off), wanted = centres(right);
  const Similarity similarity = best_similarity(found, wanted);
  std::vector<Vector3d> errors;
  for (std::size_t i = 0; i < found.size(); ++i)
    errors.push_back(similarity * found[i] - wanted[i]);
  return stacked(errors);
}

Eigen::VectorXd step_errors(const Bundle& off, const Bundle& right) {
  const double scale = best_similarity(centres(off), centres(right)).scale;
  std::vector<Vector3d> errors;
  for (const auto& [a, b] : off.steps) {
    const auto way = [a = a, b = b](const Bundle& bundle) {
      return (bundle.views[a].camera_from_bundle * bundle.views[b].camera_from_bundle.inverse())
          .translation;
    };
    errors.push_back(scale * way(off) - way(right));
  }
  return stacked(errors);
}

Eigen::VectorXd turn_errors_px(const Bundle& off, const Bundle& right) {
  std::vector<Vector3d> errors;
  for (const auto& [a, b] : off.steps) {
    const auto turn = [a = a, b = b](const Bundle& bundle) -> Eigen::Matrix3d {
      return bundle.views[a].camera_from_bundle.rotation *
             bundle.views[b].camera_from_bundle.rotation.transpose();
    };
    const Eigen::AngleAxisd between(Eigen::Matrix3d(turn(off).transpose() * turn(right)));
    errors.push_back(kCamera.fx_px * between.angle() * between.axis());
  }
  return stacked(errors);
}

Eigen::VectorXd drift_error(const Bundle& off, const Bundle& right) {
  return Eigen::VectorXd::Constant(1, drift(off) - drift(right));
}

// All unknowns at once, derivatives by differences of the whole, the gauge left to the
// pseudo-inverse.
struct BruteForce {
  Eigen::MatrixXd residual_by_unknown;
  Eigen::MatrixXd unknown_by_residual;
};

constexpr double kStep = 1e-5;

BruteForce brute_force(const Bundle& bundle) {
  const auto num = static_cast<Eigen::Index>(6 * bundle.views.size() + 3 * bundle.points.size());
  Eigen::MatrixXd by_unknown(residuals(bundle).size(), num);
  for (Eigen::Index k = 0; k < num; ++k) {
    const Bundle more = moved(bundle, kStep * Eigen::VectorXd::Unit(num, k));
    const Bundle less = moved(bundle, -kStep * Eigen::VectorXd::Unit(num, k));
    by_unknown.col(k) = (residuals(more) - residuals(less)) / (2.0 * kStep);
  }
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver;
  solver.setThreshold(1e-8);
  solver.compute(by_unknown);
  EXPECT_EQ(solver.rank(), num - 7);
  return {by_unknown, solver.pseudoInverse()};
}

/// Root of the mean over views or steps of a figure's variances, for residuals of 1 px.
double brute_error(const BruteForce& whole, const Bundle& bundle, const Figure& figure,
                   std::size_t count) {
  const Eigen::Index num = whole.unknown_by_residual.rows();
  Eigen::MatrixXd by_unknown(figure(bundle, bundle).size(), num);
  for (Eigen::Index k = 0; k < num; ++k)
    by_unknown.col(k) = (figure(moved(bundle, kStep * Eigen::VectorXd::Unit(num, k)), bundle) -
                         figure(moved(bundle, -kStep * Eigen::VectorXd::Unit(num, k)), bundle)) /
                        (2.0 * kStep);
  return (by_unknown * whole.unknown_by_residual).norm() / std::sqrt(static_cast<double>(count));
}

TEST(BundleErrors, AreThoseOfTheWholeAdjustmentByBruteForce) {
  const Bundle bundle = flight();
  const BruteForce whole = brute_force(bundle);
  const auto found = bundle_errors(bundle);
  ASSERT_TRUE(found && found->drift);
  EXPECT_NEAR(*found->drift / brute_error(whole, bundle, drift_error, 1), 1.0, 1e-5);
  EXPECT_NEAR(found->position / brute_error(whole, bundle, position_errors, 5), 1.0, 1e-4);
  EXPECT_NEAR(found->step / brute_error(whole, bundle, step_errors, 3), 1.0, 1e-4);
  EXPECT_NEAR(found->turn_px / brute_error(whole, bundle, turn_errors_px, 3), 1.0, 1e-4);
}

TEST(BundleErrors, OfAStraightFlightAreThoseOfItsLine) {
  Bundle bundle = flight();
  for (std::size_t v = 0; v < bundle.views.size(); ++v) {
    Pose& pose = bundle.views[v].camera_from_bundle;
    pose.translation = pose.rotation * Vector3d(-4.0 * static_cast<double>(v), 0.0, 3.0);
  }
  bundle = exact(bundle);
  const auto found = bundle_errors(bundle);
  ASSERT_TRUE(found);
  // The turn about the line is open, so that errors have a size and no direction: their spread is drawn.
  const BruteForce whole = brute_force(bundle);
  constexpr double kNoise_px = 1e-3;
  constexpr int kNum = 400;
  std::mt19937 random(12);
  double squares = 0.0;
  for (int draw = 0; draw < kNum; ++draw) {
    const Eigen::VectorXd off = residuals(with_noise(bundle, kNoise_px, random));
    squares +=
        position_errors(moved(bundle, whole.unknown_by_residual * off), bundle).squaredNorm() /
        (5.0 * kNum);
  }
  // Even if one mode were all, a root of 400 squares is known to 3.5 %; three of these.
  EXPECT_NEAR(std::sqrt(squares) / kNoise_px / found->position, 1.0, 0.11);
}

TEST(BundleErrors, AreTheSpreadOfAdjustedObservationsThatErr) {
  const Bundle right = exact(flight());
  const BruteForce whole = brute_force(right);
  constexpr double kNoise_px = 0.2;
  constexpr int kNum = 400;
  std::mt19937 random(9);
  const std::array<Figure, 4> figures{drift_error, position_errors, step_errors, turn_errors_px};
  constexpr std::array<double, 4> kCounts{1.0, 5.0, 3.0, 3.0};
  std::array<double, 4> squares{}, predicted{};
  double noises = 0.0;
  for (int draw = 0; draw < kNum; ++draw) {
    Bundle bundle = with_noise(right, kNoise_px, random);
    for (int step = 0; step < 2; ++step)
      bundle = moved(bundle, -(whole.unknown_by_residual * residuals(bundle)));
    const auto found = bundle_errors(bundle);
    ASSERT_TRUE(found && found->drift);
    const std::array<double, 4> errors{*found->drift, found->position, found->step, found->turn_px};
    for (std::size_t i = 0; i < figures.size(); ++i) {
      squares[i] += figures[i](bundle, right).squaredNorm() / kCounts[i] / kNum;
      predicted[i] += std::pow(errors[i] * found->noise_px, 2) / kNum;
    }
    noises += std::pow(found->noise_px, 2) / kNum;
  }
  // A variance of 400 draws is known to sqrt(2 / 400) = 7 %, a root of it to 3.5 %; three of these.
  for (std::size_t i = 0; i < figures.size(); ++i)
    EXPECT_NEAR(std::sqrt(predicted[i] / squares[i]), 1.0, 0.11) << i;
  // Of 400 draws of some hundred residuals: to 0.4 %.
  EXPECT_NEAR(std::sqrt(noises) / kNoise_px, 1.0, 0.015);
}

TEST(BundleErrors, AreTheSameWhereverAndHoweverLargeTheBundleStands) {
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
  const auto here = bundle_errors(bundle), there = bundle_errors(other);
  ASSERT_TRUE(here && there);
  EXPECT_NEAR(*there->drift / *here->drift, 1.0, 1e-5);
  EXPECT_NEAR(there->noise_px / here->noise_px, 1.0, 1e-9);
  EXPECT_NEAR(there->position / here->position, 7.0, 1e-4);
  EXPECT_NEAR(there->step / here->step, 7.0, 1e-4);
  EXPECT_NEAR(there->turn_px / here->turn_px, 1.0, 1e-5);
}

TEST(BundleErrors, OfViewsThatShareNoPointAreUnknown) {
  // Whichever way the roundings fall.
  for (std::size_t num_first = 10; num_first <= 20; ++num_first) {
    Bundle bundle = flight();
    for (std::size_t v = 0; v < bundle.views.size(); ++v)
      std::erase_if(bundle.views[v].observations,
                    [&](const auto& seen) { return (seen.point < num_first) != (v < 2); });
    EXPECT_FALSE(bundle_errors(bundle)) << num_first;
  }
}

TEST(BundleErrors, OfAViewWithoutPointsAreUnknown) {
  Bundle bundle = flight();
  bundle.views[0].observations.clear();
  EXPECT_FALSE(bundle_errors(bundle));
}

TEST(BundleErrors, OfMoreViewsThanItTakesOrNoneAreUnknown) {
  Bundle bundle = flight();
  bundle.views.resize(kMostBundleViews + 1, bundle.views.back());
  EXPECT_FALSE(bundle_errors(bundle));
  EXPECT_FALSE(bundle_errors({}));
}

TEST(PointsOfABundle, AreTriangulatedWhereTheyAreFromNothing) {
  const Bundle right = exact(flight());
  Bundle bundle = right;
  for (Vector3d& point : bundle.points) point.setZero();
  triangulate(bundle);
  for (std::size_t i = 0; i < right.points.size(); ++i)
    EXPECT_LE((bundle.points[i] - right.points[i]).norm(), 1e-8) << i;
  const auto sum = [](const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0);
  };
  EXPECT_LE(sum(explain(bundle)), 1e-12);
  // A wrong match beside its epipolar lines counts once, and as 16 px^2.
  bundle.views[0].observations[3].pixel.y() += 300.0;
  triangulate(bundle);
  EXPECT_EQ(explain(bundle)[0], 16.0);
  EXPECT_LE(sum(explain(bundle)), 19.0);
}

TEST(BundleErrors, AreOfTheViewsThatShareThreePoints) {
  Bundle bundle = flight();
  const auto whole = bundle_errors(bundle);
  BundleView lonely = bundle.views[2];
  lonely.observations.resize(2);
  bundle.views.insert(bundle.views.begin() + 1, lonely);
  bundle.steps = {{0, 2}, {1, 2}, {3, 4}, {4, 5}};
  EXPECT_EQ(drop_lonely_views(bundle), 1U);
  EXPECT_EQ(bundle.steps, flight().steps);
  const auto found = bundle_errors(bundle);
  ASSERT_TRUE(whole && found);
  EXPECT_NEAR(found->position / whole->position, 1.0, 1e-9);
}

TEST(Improvement, IsThatOfTheWholeAdjustmentByBruteForce) {
  std::mt19937 random(4);
  Bundle bundle = with_noise(exact(flight()), 0.2, random);
  bundle.views[2].camera_from_bundle.translation.x() += 0.05;
  triangulate(bundle);
  const BruteForce whole = brute_force(bundle);
  const Eigen::VectorXd off = residuals(bundle);
  const Eigen::VectorXd taken = whole.residual_by_unknown * (whole.unknown_by_residual * off);
  const auto found = improvement(bundle);
  ASSERT_TRUE(found);
  // Points are adjusted until a step is 1e-3 of what it takes away.
  EXPECT_NEAR(
      found->moved_px / std::sqrt(2.0 * taken.squaredNorm() / static_cast<double>(off.size())), 1.0,
      1e-3);
}

TEST(Improvement, OfRightPosesIsWhatNoiseLetsBeTakenAway) {
  const Bundle right = exact(flight());
  constexpr int kNum = 300;
  std::mt19937 random(6);
  double moved_px2 = 0.0, unsure_px2 = 0.0;
  for (int draw = 0; draw < kNum; ++draw) {
    Bundle bundle = with_noise(right, 0.2, random);
    triangulate(bundle);
    const auto found = improvement(bundle);
    ASSERT_TRUE(found);
    moved_px2 += std::pow(found->moved_px, 2) / kNum;
    unsure_px2 += std::pow(found->unsure_px, 2) / kNum;
  }
  // The mean of 300 sums of 23 squares is known to sqrt(2 / 23 / 300) = 1.7 %; five of these.
  EXPECT_NEAR(moved_px2 / unsure_px2, 1.0, 0.085);
}

TEST(PointErrors, AreThoseOfThePointsCovarianceByDifferences) {
  const Bundle bundle = exact(flight());
  const Vector3d direction = Vector3d(0.3, -0.2, 0.9).normalized();
  const std::vector<double> found =
      point_errors(bundle, std::vector<Vector3d>(bundle.points.size(), direction));
  const auto first = static_cast<Eigen::Index>(6 * bundle.views.size());
  const BruteForce whole = brute_force(bundle);
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Eigen::MatrixXd by_point =
        whole.residual_by_unknown.middleCols<3>(first + static_cast<Eigen::Index>(3 * i));
    const Eigen::Matrix3d covariance = (by_point.transpose() * by_point).inverse();
    EXPECT_NEAR(found[i] / std::sqrt(direction.dot(covariance * direction)), 1.0, 1e-5) << i;
  }
}

}  // namespace
}  // namespace terracast::validate
