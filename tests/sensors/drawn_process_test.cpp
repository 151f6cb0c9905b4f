#include "sensors/drawn_process.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "core/random.h"

/// Means and covariances of processes over many streams, against their closed forms; any order of ticks.
namespace terracast::sensors {
namespace {

constexpr int kNumStreams = 20000;

/// Covariance of two ticks over many streams, and by how many standard errors it is off what it should be.
void expect_covariance(const std::function<DrawnProcess(std::uint64_t stream)>& made,
                       std::int64_t a, std::int64_t b, double expected, double variance_a,
                       double variance_b) {
  double sum = 0.0, sum_a = 0.0;
  for (int stream = 0; stream < kNumStreams; ++stream) {
    DrawnProcess process = made(static_cast<std::uint64_t>(stream) + 17);
    const double at_a = process.at(a), at_b = process.at(b);
    sum += at_a * at_b;
    sum_a += at_a;
  }
  // Of two normal numbers the product has the variance s_a s_b + c^2.
  const double error = std::sqrt((variance_a * variance_b + expected * expected) / kNumStreams);
  EXPECT_NEAR(sum / kNumStreams, expected, 4.5 * error + 1e-300) << a << ", " << b;
  EXPECT_NEAR(sum_a / kNumStreams, 0.0, 4.5 * std::sqrt(variance_a / kNumStreams) + 1e-300);
}

TEST(DrawnProcess, AWalksCovarianceIsThatOfItsCommonPart) {
  constexpr double kStep = 0.3;
  const auto made = [](std::uint64_t stream) { return DrawnProcess::walk(kStep, 5, stream); };
  EXPECT_EQ(made(1).at(0), 0.0);
  const auto variance = [](std::int64_t tick) { return kStep * kStep * static_cast<double>(tick); };
  for (const auto& [a, b] : std::vector<std::pair<std::int64_t, std::int64_t>>{
           {1, 1}, {1, 2}, {3, 5}, {7, 8}, {1000, 1000}, {999, 1001}, {100, 3'600'000}})
    expect_covariance(made, a, b, variance(a), variance(a), variance(b));
}

TEST(DrawnProcess, AMarkovProcessIsStationaryFromItsFirstTickOn) {
  constexpr double kDeviation = 2.0, kTicks = 50.0;
  const auto made = [](std::uint64_t stream) {
    return DrawnProcess::markov(kDeviation, kTicks, 6, stream);
  };
  for (const auto& [a, b] : std::vector<std::pair<std::int64_t, std::int64_t>>{
           {0, 0}, {0, 1}, {3, 4}, {7, 8}, {0, 50}, {511, 512}, {1000, 1100}, {0, 1'000'000}}) {
    const double variance = kDeviation * kDeviation;
    expect_covariance(made, a, b, variance * std::exp(-static_cast<double>(b - a) / kTicks),
                      variance, variance);
  }
}

TEST(DrawnProcess, IsTheSameInAnyOrderOfTicks) {
  for (const bool is_walk : {true, false}) {
    const auto made = [&] {
      return is_walk ? DrawnProcess::walk(1.0, 8, 9) : DrawnProcess::markov(1.0, 10.0, 8, 9);
    };
    DrawnProcess in_order = made();
    std::vector<double> values;
    for (std::int64_t tick = 0; tick < 300; ++tick) values.push_back(in_order.at(tick));
    DrawnProcess mixed = made();
    for (std::uint64_t i = 0; i < 1000; ++i) {
      const auto tick = static_cast<std::int64_t>(300.0 * core::random_unit(1, 2, i));
      EXPECT_EQ(mixed.at(tick), values[static_cast<std::size_t>(tick)]);
      EXPECT_EQ(made().at(tick), values[static_cast<std::size_t>(tick)]);
    }
  }
}

/// Of two states, by the exponential of their rates.
TEST(DrawnSwitch, HasTheProbabilitiesOfItsMeanTimes) {
  constexpr double kOn = 30.0, kOff = 6.0, kShare = kOn / (kOn + kOff);
  for (const auto& [a, b] : std::vector<std::pair<std::int64_t, std::int64_t>>{
           {0, 1}, {3, 4}, {7, 8}, {10, 15}, {511, 512}, {1000, 1020}, {0, 1'000'000}}) {
    double num_on = 0.0, num_both = 0.0;
    for (int stream = 0; stream < kNumStreams; ++stream) {
      DrawnSwitch drawn(kOn, kOff, 7, static_cast<std::uint64_t>(stream) + 3);
      const bool is_on = drawn.is_on(a);
      num_on += is_on;
      num_both += is_on && drawn.is_on(b);
    }
    const double kept = std::exp(-(1.0 / kOn + 1.0 / kOff) * static_cast<double>(b - a));
    const double both = kShare * (kShare + (1.0 - kShare) * kept);
    const auto error = [](double share) { return std::sqrt(share * (1.0 - share) / kNumStreams); };
    EXPECT_NEAR(num_on / kNumStreams, kShare, 4.5 * error(kShare)) << a;
    EXPECT_NEAR(num_both / kNumStreams, both, 4.5 * error(both)) << a << ", " << b;
  }
}

TEST(DrawnSwitch, IsTheSameInAnyOrderOfTicks) {
  DrawnSwitch forwards(20.0, 5.0, 8, 9), backwards(20.0, 5.0, 8, 9);
  std::vector<bool> states;
  for (std::int64_t tick = 0; tick < 2000; ++tick) states.push_back(forwards.is_on(tick));
  for (std::int64_t tick = 1999; tick >= 0; --tick)
    EXPECT_EQ(backwards.is_on(tick), states[static_cast<std::size_t>(tick)]);
  EXPECT_EQ(DrawnSwitch(20.0, 5.0, 8, 9).is_on(777), states[777]);
}

}  // namespace
}  // namespace terracast::sensors
