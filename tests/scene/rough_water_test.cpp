#include "scene/water/rough_water.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace terracast::scene {
namespace {

/// What facets of slopes from `from` to `to` show, and their slopes times that, by the midpoint rule.
struct Sums {
  double seen = 0.0;
  double slopes = 0.0;
};
Sums integrate(double from, double to, double deviation, double cotangent) {
  Sums sums;
  constexpr int kSteps = 20000;
  for (int i = 0; i < kSteps; ++i) {
    const double slope = from + (to - from) * (i + 0.5) / kSteps;
    const double x = slope / deviation;
    const double seen = std::max(cotangent + slope, 0.0) * std::exp(-0.5 * x * x) /
                        (deviation * std::sqrt(2.0 * std::numbers::pi)) * (to - from) / kSteps;
    sums.seen += seen;
    sums.slopes += seen * slope;
  }
  return sums;
}

TEST(RoughWater, FacetsAreSeenByTheAreaThatTheyShow) {
  for (const double deviation : {0.02, 0.1})
    for (const double cotangent : {-0.05, 0.0, 0.01, 0.08, 0.7, 5.0}) {
      const Sums all = integrate(-9.0 * deviation, 9.0 * deviation, deviation, cotangent);
      for (const double slope : {-0.1, -0.02, 0.0, 0.015, 0.06, 0.2})
        EXPECT_NEAR(seen_slopes_below(slope, deviation, cotangent),
                    integrate(-9.0 * deviation, slope, deviation, cotangent).seen / all.seen, 1e-6)
            << deviation << " " << cotangent << " " << slope;
    }
}

TEST(RoughWater, SharesSpreadEvenlyGiveTheFacetsThatAreSeen) {
  constexpr double kDeviation = 0.08;
  for (const double cotangent : {-0.1, 0.0, 0.03, 0.2, 2.0}) {
    double sum = 0.0;
    double before = -1e9;
    constexpr int kShares = 2000;
    for (int i = 0; i < kShares; ++i) {
      const double share = (i + 0.5) / kShares;
      const double slope = seen_slope(share, kDeviation, cotangent);
      ASSERT_GE(slope, before);
      ASSERT_GE(slope, -cotangent - 1e-3 * kDeviation);  // none is seen from behind
      before = slope;
      // Beyond 4 deviations lies 1e-4 of all, and when only steep facets are seen up to 5e-3.
      EXPECT_NEAR(seen_slopes_below(slope, kDeviation, cotangent), share, 6e-3);
      sum += slope;
    }
    const Sums all = integrate(-9.0 * kDeviation, 9.0 * kDeviation, kDeviation, cotangent);
    EXPECT_NEAR(sum / kShares, all.slopes / all.seen, 0.01 * kDeviation) << cotangent;
  }
  // From straight above all count alike: the mean slope is the variance over the cotangent.
  double sum = 0.0;
  for (int i = 0; i < 1000; ++i) sum += seen_slope((i + 0.5) / 1000, kDeviation, 4.0);
  EXPECT_NEAR(sum / 1000, kDeviation * kDeviation / 4.0, 2e-3 * kDeviation);
}

}  // namespace
}  // namespace terracast::scene
