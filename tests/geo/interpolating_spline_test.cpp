#include "geo/paths/interpolating_spline.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"
#include "geo/paths/speed_profile.h"
#include "geo/paths/uniform_spline.h"

namespace terracast::geo {
namespace {

using Eigen::Vector3d;

double drawn(std::uint64_t stream, std::size_t index) {
  return core::random_unit(31, stream, static_cast<std::uint64_t>(index));
}

/// Points at uneven parameters.
InterpolatingSpline spline_of(std::size_t count, bool is_closed, Continuity continuity) {
  std::vector<double> parameters;
  std::vector<Vector3d> points;
  for (std::size_t i = 0; i < count; ++i) {
    parameters.push_back(i == 0 ? 0.0 : parameters.back() + 20.0 + 60.0 * drawn(0, i));
    points.emplace_back(400.0 * drawn(1, i), 400.0 * drawn(2, i), 50.0 * drawn(3, i));
  }
  if (is_closed) points.back() = points.front();
  return {parameters, points, is_closed, continuity};
}

TEST(InterpolatingSplines, OfTheFourthOrderPassThroughTheirPointsWithFourContinuousDerivatives) {
  for (const bool is_closed : {false, true})
    for (const std::size_t count : {std::size_t{4}, std::size_t{9}, std::size_t{200}}) {
      const InterpolatingSpline spline = spline_of(count, is_closed, Continuity::Fourth);
      const std::vector<double>& u = spline.parameters();
      constexpr double kNear = 1e-4;
      // Across a knot, and across the closing, values and the fourth derivative, by differences of the third.
      const auto expect_smooth = [&](double before, double after) {
        const auto a = spline.at(before - kNear), b = spline.at(after + kNear);
        const double scale = 1.0 + a.first.norm();
        EXPECT_LT((a.value - b.value).norm(), 3.0 * kNear * scale);
        EXPECT_LT((a.first - b.first).norm(), 1e-2 * kNear * scale * 100.0);
        EXPECT_LT((a.second - b.second).norm(), 1e-2);
        const auto fourth = [&](double at) -> Vector3d {
          return (spline.at(at + 0.5).third - spline.at(at - 0.5).third);
        };
        const Vector3d fourth_before = fourth(before - 0.5 - kNear);
        const Vector3d fourth_after = fourth(after + 0.5 + kNear);
        // The fifth derivative jumps: over a metre that is what is left.
        const double fifth = (fourth(before - 2.0) - fourth(before - 1.0)).norm() +
                             (fourth(after + 2.0) - fourth(after + 1.0)).norm();
        EXPECT_LT((fourth_before - fourth_after).norm(), 2.0 * fifth + 1e-9);
        EXPECT_LT((a.third - b.third).norm(),
                  1e-2 * (fourth_before.norm() + fourth_after.norm()) + 1e-9);
      };
      for (std::size_t i = 1; i + 1 < count; ++i) expect_smooth(u[i], u[i]);
      if (is_closed) expect_smooth(u.back(), u.front());
      for (std::size_t i = 0; i < count; ++i)
        EXPECT_LT(
            (spline.at(u[i]).value - spline_of(count, is_closed, Continuity::Second).at(u[i]).value)
                .norm(),
            1e-9);
      if (!is_closed) {
        EXPECT_LT(spline.at(0.0).second.norm(), 1e-12);
      }
    }
}

TEST(InterpolatingSplines, TwoPointsAreJoinedByAStraightLine) {
  const InterpolatingSpline spline({0.0, 7.0}, {Vector3d(1, 2, 3), Vector3d(8, 9, -4)}, false,
                                   Continuity::Fourth);
  const auto middle = spline.at(2.0);
  EXPECT_LT((middle.value - Vector3d(3, 4, 1)).norm(), 1e-14);
  EXPECT_LT(middle.second.norm() + middle.third.norm(), 1e-14);
}

TEST(UniformSplines, OfTheFourthOrderKeepWithinSixControlsAndDrawLinesStraight) {
  std::vector<double> controls, line;
  for (std::size_t i = 0; i < 40; ++i) {
    controls.push_back(drawn(4, i));
    line.push_back(3.0 - 0.25 * static_cast<double>(i));
  }
  const UniformSpline spline(controls, 78.0, false, Continuity::Fourth);
  const UniformSpline straight(line, 78.0, false, Continuity::Fourth);
  for (double u = 6.0; u < 72.0; u += 0.37) {
    const auto at = spline.at(u);
    const auto i = static_cast<std::size_t>(u / 2.0);
    double low = 1.0, high = 0.0;
    for (std::size_t k = i - 2; k <= i + 3; ++k) {
      low = std::min(low, controls[k]);
      high = std::max(high, controls[k]);
    }
    EXPECT_GE(at.value, low);
    EXPECT_LE(at.value, high);
    EXPECT_NEAR(straight.at(u).value, 3.0 - 0.125 * u, 1e-13);
    constexpr double kStep = 1e-3;
    const auto before = spline.at(u - kStep), after = spline.at(u + kStep);
    EXPECT_NEAR(at.first, (after.value - before.value) / (2.0 * kStep), 1e-6);
    EXPECT_NEAR(at.second, (after.first - before.first) / (2.0 * kStep), 1e-6);
    EXPECT_NEAR(at.third, (after.second - before.second) / (2.0 * kStep), 1e-5);
  }
}

TEST(SpeedProfiles, OfTheFourthOrderTravelTheWholeLength) {
  const SpeedProfile profile({{0.0, 5.0}, {100.0, 20.0}, {250.0, 8.0}}, Continuity::Fourth);
  const std::vector<double> knots = profile.knots_s();
  EXPECT_NEAR(profile.at(knots[1] - 1e-12).length_m, 100.0, 1e-9);
  EXPECT_NEAR(profile.at(profile.duration_s()).length_m, 250.0, 1e-9);
  for (double t = 0.1; t < profile.duration_s() - 0.1; t += 0.173) {
    constexpr double kStep = 1e-4;
    const auto before = profile.at(t - kStep), at = profile.at(t), after = profile.at(t + kStep);
    EXPECT_NEAR(at.speed_mps, (after.length_m - before.length_m) / (2.0 * kStep), 1e-6);
    EXPECT_NEAR(at.acceleration_mps2, (after.speed_mps - before.speed_mps) / (2.0 * kStep), 1e-6);
    EXPECT_NEAR(at.jerk_mps3, (after.acceleration_mps2 - before.acceleration_mps2) / (2.0 * kStep),
                1e-6);
  }
}

}  // namespace
}  // namespace terracast::geo
