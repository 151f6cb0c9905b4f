#include "validate/depth_marks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

/// Roundings and edges of depth images in closed form.
namespace terracast::validate {
namespace {

/// Slanted ground, 60 m to 250 m deep, so that it crosses two octaves of float.
core::ImageF slanted(double (*rounded)(double depth_m)) {
  core::ImageF depth(160, 120);
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x)
      depth(x, y) = static_cast<float>(
          rounded(60.0 + 1.55 * y + 0.01 * std::numbers::pi * x + 1e-3 * std::sin(0.1 * x * y)));
  return depth;
}

TEST(DepthSteps, FloatsOf32BitsHaveNone) {
  const auto steps = find_steps(slanted([](double m) { return m; }));
  ASSERT_TRUE(steps);
  EXPECT_LT(steps->share, 0.1);
}

TEST(DepthSteps, OfAMillimetreToHalfAMetreAreFound) {
  const struct {
    double step_m;
    double (*rounded)(double);
  } cases[] = {{1e-3, [](double m) { return std::round(m * 1e3) / 1e3; }},
               {1e-2, [](double m) { return std::round(m * 1e2) / 1e2; }},
               {0.05, [](double m) { return std::round(m * 20.0) / 20.0; }},
               {1.0 / 256.0, [](double m) { return std::round(m * 256.0) / 256.0; }}};
  for (const auto& one : cases) {
    const auto steps = find_steps(slanted(one.rounded));
    ASSERT_TRUE(steps);
    EXPECT_GT(steps->share, 0.99) << one.step_m;
    EXPECT_DOUBLE_EQ(steps->step_m, one.step_m);
  }
}

TEST(DepthSteps, OfSixteenBitFloatsAreToldFromFixedOnes) {
  // Eleven significant bits: 1/32 m below 64 m, 1/16 m below 128 m, 1/8 m beyond.
  const auto steps = find_steps(slanted([](double m) {
    const double step = m < 64.0 ? 1.0 / 32.0 : m < 128.0 ? 1.0 / 16.0 : 1.0 / 8.0;
    return std::round(m / step) * step;
  }));
  ASSERT_TRUE(steps);
  EXPECT_EQ(steps->num_bits, 11);
  const auto fixed = find_steps(slanted([](double m) { return std::round(m * 16.0) / 16.0; }));
  ASSERT_TRUE(fixed);
  EXPECT_EQ(fixed->num_bits, 0);
  EXPECT_DOUBLE_EQ(fixed->step_m, 1.0 / 16.0);
}

TEST(DepthSteps, OfFewDepthsAreNotLookedFor) {
  core::ImageF level(100, 100);
  for (float& value : level.data()) value = 100.0F;
  EXPECT_FALSE(find_steps(level));
}

/// A box 20 m high seen from 60 m above ground, its roof 40 m deep, under a strip of sky.
core::ImageF box_under_sky() {
  core::ImageF depth(200, 150);
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x) {
      const bool is_roof = x > 60 && x < 140 && y > 60 && y < 120;
      depth(x, y) = y < 20    ? std::numeric_limits<float>::quiet_NaN()
                    : is_roof ? 40.0F
                              : 60.0F + 0.01F * static_cast<float>(x);
    }
  return depth;
}

/// Means over 5 x 5 pixels; the sky is a number like any other.
core::ImageF blurred(const core::ImageF& depth, float sky_m) {
  core::ImageF result = depth;
  for (int y = 2; y + 2 < depth.height(); ++y)
    for (int x = 2; x + 2 < depth.width(); ++x) {
      float sum = 0.0F;
      for (int dy = -2; dy <= 2; ++dy)
        for (int dx = -2; dx <= 2; ++dx) {
          const float value = depth(x + dx, y + dy);
          sum += std::isfinite(value) ? value : sky_m;
        }
      result(x, y) = sum == 25.0F * sky_m ? std::numeric_limits<float>::quiet_NaN() : sum / 25.0F;
    }
  return result;
}

TEST(DepthEdges, OfSurfacesAreSharp) {
  const DepthEdges edges = find_edges(box_under_sky());
  EXPECT_EQ(edges.ends.share_of_ramps(), 0.0);
}

TEST(DepthEdges, OfBlurredDepthAreRamps) {
  for (const float sky_m : {0.0F, 1e5F}) {
    const DepthEdges edges = find_edges(blurred(box_under_sky(), sky_m));
    EXPECT_GT(edges.ends.share_of_ramps().value_or(0.0), 0.9) << sky_m;
  }
}

TEST(DepthEdges, OfSlopesSeenFromAboveAreNoRamps) {
  // Terraces, each 12 m below the one before it, with slopes of 5 px between them, under a strip of sky.
  core::ImageF depth(120, 90);
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x) {
      const int terrace = x / 20;
      const auto along = static_cast<float>(std::min(x % 20, 5)) / 5.0F;
      depth(x, y) = y < 20 ? std::numeric_limits<float>::quiet_NaN()
                           : 28.0F + 12.0F * (static_cast<float>(terrace) + along);
    }
  EXPECT_EQ(find_edges(depth).ends.share_of_ramps(), 0.0);
}

TEST(DepthEdges, OfNoSkySayNothing) {
  core::ImageF depth(200, 150);
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x) depth(x, y) = x > 60 && x < 140 ? 40.0F : 60.0F;
  EXPECT_FALSE(find_edges(blurred(depth, 0.0F)).ends.share_of_ramps());
}

}  // namespace
}  // namespace terracast::validate
