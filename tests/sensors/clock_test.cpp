// Stamps of sensors' clocks against t + offset + drift t, and their jitter against its theory.

#include "sensors/clock.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "capture/frame_reader.h"
#include "core/log.h"
#include "core/schema_writer.h"
#include "render/render_stage.h"
#include "tests/sensors/brisk_motion.h"
#include "tests/support/expect_error.h"
#include "tests/support/folder_compare.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

const core::Log kSilent("test", core::LogLevel::Off);

constexpr const char* kClock = R"(
[[sensors]]
name = "rod"
kind = "rangefinder"
rate_hz = 1000.0
euler_deg = [0.0, 90.0, 0.0]
clock = {offset_s = 0.25, offset_sd_s = 0.01, drift_ppm = 100.0, drift_sd_ppm = 30.0, jitter_sd_s = 1e-5}
)";

capture::Samples samples_at(const std::vector<double>& times_s) {
  capture::Samples samples{.times_s = times_s, .values = {}};
  for (std::size_t i = 0; i < times_s.size(); ++i)
    samples.values.insert(samples.values.end(), {static_cast<double>(i), -1.0});
  return samples;
}

std::vector<double> stamps_of(const capture::StreamClock& clock, const std::vector<double>& times_s,
                              double rate_hz, std::uint64_t seed = 5) {
  capture::Samples samples = samples_at(times_s);
  sensors::add_stamps(clock, seed, rate_hz, 2, samples);
  std::vector<double> stamps_s;
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    EXPECT_EQ(samples.values[3 * i], static_cast<double>(i));
    EXPECT_EQ(samples.values[3 * i + 1], -1.0);
    stamps_s.push_back(samples.values[3 * i + 2]);
  }
  return stamps_s;
}

TEST(SensorClock, ShowsOffsetAndDrift) {
  const std::vector<double> times_s = {0.0, 1.5, 100.0};
  const std::vector<double> stamps_s = stamps_of({.offset_s = 0.5, .drift = 2e-3}, times_s, 100.0);
  EXPECT_DOUBLE_EQ(stamps_s[0], 0.5);
  EXPECT_DOUBLE_EQ(stamps_s[1], 1.5 + 0.5 + 0.003);
  EXPECT_DOUBLE_EQ(stamps_s[2], 100.7);
}

TEST(SensorClock, JittersAsStatedWithinFourDeviations) {
  constexpr double kRate_hz = 100.0, kSd_s = 1e-3;
  constexpr int kCount = 200000;
  std::vector<double> times_s;
  for (int k = 0; k < kCount; ++k) times_s.push_back(k / kRate_hz);
  const std::vector<double> stamps_s = stamps_of({.jitter_sd_s = kSd_s}, times_s, kRate_hz);
  double sum = 0.0, squares = 0.0, neighbours = 0.0, largest = 0.0;
  for (int k = 0; k < kCount; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const double z = (stamps_s[i] - times_s[i]) / kSd_s;
    sum += z;
    squares += z * z;
    if (k > 0) neighbours += z * (stamps_s[i - 1] - times_s[i - 1]) / kSd_s;
    largest = std::max(largest, std::abs(z));
  }
  // Five standard errors of mean, variance and covariance; a normal deviate cut at 4 has 0.9989 of the variance.
  EXPECT_LT(std::abs(sum / kCount), 5.0 / std::sqrt(kCount));
  EXPECT_NEAR(squares / kCount, 0.99893, 5.0 * std::sqrt(2.0 / kCount));
  EXPECT_LT(std::abs(neighbours / kCount), 5.0 / std::sqrt(kCount));
  EXPECT_LE(largest, 4.0 + 1e-6);
  EXPECT_GT(largest, 3.5);
}

TEST(SensorClock, StampsOfScansRiseBetweenTicks) {
  constexpr double kRate_hz = 10.0;
  // The most that is allowed, nearly.
  sensors::ClockOptions options;
  options.jitter_sd_s = 0.0124;
  options.check_order(kRate_hz);
  std::vector<double> times_s;
  for (int k = 0; k < 20000; ++k) times_s.push_back(k * 1e-3 + 3e-4);
  const std::vector<double> stamps_s =
      stamps_of({.jitter_sd_s = options.jitter_sd_s}, times_s, kRate_hz);
  EXPECT_TRUE(std::is_sorted(stamps_s.begin(), stamps_s.end()));
  // Rows of one time have one stamp, and a part of the rows the same ones.
  const std::vector<double> part(times_s.begin() + 7000, times_s.begin() + 7100);
  const std::vector<double> again = stamps_of({.jitter_sd_s = options.jitter_sd_s}, part, kRate_hz);
  EXPECT_TRUE(std::equal(again.begin(), again.end(), stamps_s.begin() + 7000));
}

TEST(SensorClock, ThatCouldDisorderStampsIsRefusedWithAWayOut) {
  sensors::ClockOptions options;
  options.jitter_sd_s = 0.002;
  expect_error(core::ErrorKind::Config,
               {"clock.jitter_sd_s = 0.002", "rate_hz = 100", "0.00125", "rate_hz below 62.5"},
               [&] { options.check_order(100.0); });
  EXPECT_NO_THROW(options.check_order(62.4));
  options.jitter_sd_s = 0.00124;
  EXPECT_NO_THROW(options.check_order(100.0));
  options.drift_ppm = -1e5;
  expect_error(core::ErrorKind::Config, {"out of order"}, [&] { options.check_order(100.0); });
}

TEST(SensorClock, IsDrawnBySeedAndNameAboutWhatIsBelieved) {
  sensors::ClockOptions options;
  options.offset_s = 3.0;
  options.offset_sd_s = 0.5;
  options.drift_ppm = 10.0;
  options.drift_sd_ppm = 2.0;
  double squares = 0.0, drifts = 0.0;
  constexpr int kCount = 4000;
  for (int i = 0; i < kCount; ++i) {
    const capture::StreamClock clock =
        sensors::drawn_clock(options, 7, "P000/rig/" + std::to_string(i));
    EXPECT_EQ(clock.believed_offset_s, 3.0);
    EXPECT_DOUBLE_EQ(clock.believed_drift, 1e-5);
    squares += std::pow((clock.offset_s - 3.0) / 0.5, 2) / kCount;
    drifts += std::pow((clock.drift - 1e-5) / 2e-6, 2) / kCount;
  }
  EXPECT_NEAR(squares, 1.0, 5.0 * std::sqrt(2.0 / kCount));
  EXPECT_NEAR(drifts, 1.0, 5.0 * std::sqrt(2.0 / kCount));
  EXPECT_EQ(sensors::drawn_clock(options, 7, "a"), sensors::drawn_clock(options, 7, "a"));
  EXPECT_NE(sensors::drawn_clock(options, 7, "a"), sensors::drawn_clock(options, 8, "a"));
}

TEST(SensorClock, StampsAreTheSameFromAnyShardsAndReadBack) {
  const ScratchFolder folder;
  const world::TileStore store = make_plane(folder / "world");
  render::SequencePlan plan = plan_of(rig_with(folder.path(), kClock));
  sensors::draw_clocks(plan.sensors, 1, plan.name);
  render::run_render_stage(store, plan, {}, {}, folder / "whole", {.log = kSilent});
  for (const int shard : {1, 0})
    render::run_render_stage(store, plan, {}, {.first = shard, .step = 2}, folder / "shards",
                             {.log = kSilent, .num_threads = 1 + shard});
  EXPECT_EQ(first_difference(folder / "whole", folder / "shards"), "");
  const capture::SequenceReader sequence = capture::SequenceReader::open(folder / "whole");
  const capture::StreamInfo& stream = sequence.info().streams.at(0);
  ASSERT_TRUE(stream.clock.has_value());
  EXPECT_EQ(stream.clock, plan.sensors[0].info.clock);
  EXPECT_NE(stream.clock->offset_s, 0.25);
  EXPECT_EQ(stream.clock->believed_offset_s, 0.25);
  EXPECT_EQ(stream.channels.back().name, "stamp_s");
  const capture::Samples samples = sequence.read_samples(0);
  ASSERT_GT(samples.times_s.size(), 200U);
  for (std::size_t i = 0; i < samples.times_s.size(); ++i) {
    const double t = samples.times_s[i];
    const double right_s = t + stream.clock->offset_s + stream.clock->drift * t;
    EXPECT_NEAR(samples.values[2 * i + 1], right_s, 4.0001e-5);
  }
}

TEST(SensorClock, WithoutKeysLeavesAllAsItWas) {
  const ScratchFolder folder;
  const std::string bare = R"(
[[sensors]]
name = "rod"
kind = "rangefinder"
rate_hz = 1000.0
euler_deg = [0.0, 90.0, 0.0]
)";
  const rigs::RigOptions with = rig_with(folder.path(), bare + "clock = {offset_s = 0.0}\n");
  const rigs::RigOptions without = rig_with(folder.path(), bare);
  EXPECT_EQ(plan_of(with).sensors[0].info, plan_of(without).sensors[0].info);
  EXPECT_EQ(plan_of(without).sensors[0].info.channels.size(), 1U);
  rigs::RigOptions copy = without;
  EXPECT_EQ(core::toml_text(copy).find("clock]"), std::string::npos);
}

}  // namespace
}  // namespace terracast::test
