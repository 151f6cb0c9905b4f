#include "geo/rounding.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "core/random.h"

namespace {

using namespace terracast;

constexpr int kLeastExponent = std::numeric_limits<double>::min_exponent - 1;
constexpr int kMostExponent = std::numeric_limits<double>::max_exponent - 1;

TEST(Rounding, PowersOfTwoAreThoseOfTheLibrary) {
  for (int exponent = kLeastExponent; exponent <= kMostExponent; ++exponent) {
    const double power = std::ldexp(1.0, exponent);
    ASSERT_EQ(geo::power_of_two(exponent), power);
    ASSERT_EQ(geo::exponent_of(power), exponent);
    ASSERT_EQ(geo::exponent_of(-std::nextafter(2.0 * power, 0.0)), exponent);
  }
}

// A size's neighbours lie a step away, and rounding goes to the nearer of two.
TEST(Rounding, IsHalfTheStepBetweenNumbers) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  int num_seen = 0;
  for (int i = 0; i < 100'000; ++i) {
    const double size =
        std::abs(std::bit_cast<double>(core::random_bits(7, 1, static_cast<std::uint64_t>(i))));
    if (!(size > 0x1.0p-960) || size > 0x1.0p+1000) continue;
    ++num_seen;
    const double half_step =
        0.5 * (std::nextafter(size * (1.0 + 0x1.0p-30), kInfinity) - size * (1.0 + 0x1.0p-30));
    ASSERT_EQ(geo::rounding_of(size), half_step) << size;
  }
  EXPECT_GT(num_seen, 90'000);
  EXPECT_EQ(geo::rounding_of(0.0), 0.0);
}

}  // namespace
