// The rays of a beam, and the returns of what they meet, against the Gaussian and closed forms.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "core/random.h"
#include "sensors/lidar/beam.h"

namespace terracast::test {
namespace {

using sensors::lidar::beam_rays;
using sensors::lidar::BeamRay;
using sensors::lidar::Echo;
using sensors::lidar::Return;
using sensors::lidar::separate_returns;

/// Mean of x^a y^b over exp(-2 (x^2 + y^2)): that of two normal distributions of variance 1/4.
double moment_of_gaussian(int a, int b) {
  const auto of_one = [](int power) {
    if (power % 2 != 0) return 0.0;
    double moment = 1.0;
    for (int k = power - 1; k > 0; k -= 2) moment *= 0.25 * k;
    return moment;
  };
  return of_one(a) * of_one(b);
}

TEST(LidarBeam, RaysHaveTheMomentsOfAGaussian) {
  for (const auto& [num_rays, num_rings] : {std::pair{7, 1}, {19, 2}, {37, 3}}) {
    const std::span<const BeamRay> rays = beam_rays(num_rays);
    ASSERT_EQ(rays.size(), static_cast<std::size_t>(num_rays));
    for (const BeamRay& ray : rays) EXPECT_GT(ray.weight, 0.0);
    for (int a = 0; a <= 5; ++a)
      for (int b = 0; a + b <= 5; ++b) {
        double mean = 0.0;
        for (const BeamRay& ray : rays)
          mean += ray.weight * std::pow(ray.offset.x(), a) * std::pow(ray.offset.y(), b);
        EXPECT_NEAR(mean, moment_of_gaussian(a, b), 1e-13) << num_rays << " " << a << " " << b;
      }
    // Of the distance from the axis: k! / 2^k is the mean of its power 2 k.
    double expected = 1.0;
    for (int k = 1; k <= 2 * num_rings + 1; ++k) {
      expected *= 0.5 * k;
      double mean = 0.0;
      for (const BeamRay& ray : rays) mean += ray.weight * std::pow(ray.offset.squaredNorm(), k);
      if (k <= 2 * num_rings)
        EXPECT_NEAR(mean / expected, 1.0, 1e-12) << num_rays << " " << k;
      else
        EXPECT_GT(std::abs(mean / expected - 1.0), 1e-3) << "more could be promised";
    }
  }
  ASSERT_EQ(beam_rays(1).size(), 1U);
  EXPECT_EQ(beam_rays(1)[0].weight, 1.0);
  EXPECT_EQ(beam_rays(1)[0].offset, Eigen::Vector2d::Zero());
}

// A knife's edge across the beam lets half an erfc of it by.
TEST(LidarBeam, AnEdgeCutsTheBeamAsTheErrorFunctionSays) {
  for (const double at : {-0.8, -0.3, 0.0, 0.25, 0.6, 1.0}) {
    const double expected = 0.5 * std::erfc(std::numbers::sqrt2 * at);
    constexpr int kTurns = 4000;
    double sum = 0.0;
    for (int turn = 0; turn < kTurns; ++turn) {
      const double angle = 2.0 * std::numbers::pi * turn / kTurns;
      for (const BeamRay& ray : beam_rays(37))
        if (ray.offset.x() * std::cos(angle) - ray.offset.y() * std::sin(angle) > at)
          sum += ray.weight;
    }
    // The most that one step of the sum can be beside a smooth one: half the axis's ray.
    EXPECT_NEAR(sum / kTurns, expected, 0.5 * beam_rays(37)[0].weight + 1e-9) << at;
  }
}

TEST(LidarBeam, EchoesFartherApartThanTheGapAreReturnsOfTheirOwn) {
  constexpr double kGap_m = 0.6;
  std::vector<Return> returns;
  const auto part = [&](std::vector<Echo> echoes) { separate_returns(echoes, kGap_m, returns); };
  part({});
  EXPECT_TRUE(returns.empty());
  part({{10.0, 1.0, 0}, {10.5, 3.0, 1}});
  ASSERT_EQ(returns.size(), 1U);
  EXPECT_DOUBLE_EQ(returns[0].range_m, 10.375);
  EXPECT_DOUBLE_EQ(returns[0].power, 4.0);
  EXPECT_DOUBLE_EQ(returns[0].spread_m, std::sqrt(3.0) / 8.0);  // sqrt(p q) times the distance
  EXPECT_EQ(returns[0].ray, 1U);
  part({{10.7, 3.0, 1}, {10.0, 1.0, 0}});
  ASSERT_EQ(returns.size(), 2U);
  EXPECT_EQ(returns[0].range_m, 10.0);
  EXPECT_EQ(returns[1].range_m, 10.7);
  EXPECT_EQ(returns[1].spread_m, 0.0);
  // A slope goes on from echo to echo.
  part({{10.0, 1.0, 0}, {10.5, 1.0, 1}, {11.0, 1.0, 2}, {11.5, 1.0, 3}});
  ASSERT_EQ(returns.size(), 1U);
  EXPECT_DOUBLE_EQ(returns[0].range_m, 10.75);
  // What brings nothing back has a place all the same.
  part({{7.0, 0.0, 4}});
  ASSERT_EQ(returns.size(), 1U);
  EXPECT_EQ(returns[0].range_m, 7.0);
}

TEST(LidarBeam, PowersOfReturnsAddUpAndRangesAreBetweenTheirs) {
  std::vector<Return> returns;
  for (std::uint64_t run = 0; run < 2000; ++run) {
    std::vector<Echo> echoes;
    double power = 0.0;
    const auto count = 1 + core::random_bits(3, run, 99) % 37;
    for (std::uint64_t i = 0; i < count; ++i) {
      echoes.push_back({.range_m = core::random_between(50.0, 60.0, 1, run, i),
                        .power = core::random_unit(2, run, i),
                        .ray = i});
      power += echoes.back().power;
    }
    constexpr double kGap_m = 0.3;
    separate_returns(echoes, kGap_m, returns);
    double sum = 0.0;
    double last_m = 0.0;
    for (const Return& one : returns) {
      EXPECT_GT(one.range_m, last_m);
      last_m = one.range_m;
      sum += one.power;
    }
    EXPECT_NEAR(sum, power, 1e-12 * power);
    // As many gaps are wider as there are returns but one.
    std::size_t num_gaps = 0;
    for (std::size_t i = 1; i < echoes.size(); ++i)
      num_gaps += echoes[i].range_m - echoes[i - 1].range_m > kGap_m ? 1 : 0;
    EXPECT_EQ(returns.size(), num_gaps + 1);
  }
}

}  // namespace
}  // namespace terracast::test
