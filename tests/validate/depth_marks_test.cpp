#include "validate/depth_marks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

/// Roundings of depth images in closed form.
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

}  // namespace
}  // namespace terracast::validate
