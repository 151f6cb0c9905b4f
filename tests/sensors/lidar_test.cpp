// A scanner over a plane, pulse by pulse against the plane's closed form, and through a capture.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "capture/frame_reader.h"
#include "core/log.h"
#include "core/parallel.h"
#include "render/render_stage.h"
#include "tests/sensors/brisk_motion.h"
#include "tests/support/expect_error.h"
#include "tests/support/folder_compare.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

using Eigen::Vector3d;

const core::Log kQuiet("test", core::LogLevel::Off);

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kLight_mps = 299792458.0;
constexpr double kMostRange_m = 400.0;
// Doubles of a few hundred metres, through rotations: 1e-12 of 400 m is what they err by.
constexpr double kTolerance_m = 1e-9;

/// Four lasers that fire one after the other, 250 cycles a second and 25.3 a turn.
constexpr const char* kScanner = R"([[sensors]]
name = "lidar"
kind = "lidar"
rate_hz = 10.0
offset_mm = [300.0, -50.0, -120.0]
euler_deg = [2.0, 12.0, 0.0]
most_range_m = 400.0
pattern = "spinning"
elevation_deg = [-50.0, -25.0, 0.0, 20.0]
azimuth_deg = [0.0, 1.5, -2.0, 0.5]
firing_us = [0.0, 900.0, 1700.0, 2900.0]
cycle_us = 3952.569169960474
origin_mm = 40.0
vertical_mm = [10.0, 5.0, 0.0, -5.0]
)";
constexpr double kCycle_s = 3952.569169960474e-6;

/// What one pulse should meet, from the motion's own formulas and the keys above written out once more.
struct Expected {
  double time_s = 0.0;
  int ring = 0;
  double range_m = 0.0;
  double cosine = 0.0;
  Vector3d point_sensor = Vector3d::Zero();
  Vector3d point_world = Vector3d::Zero();
  Vector3d by_frame_world = Vector3d::Zero();  ///< had the body stood still since the scan began
};

Eigen::Affine3d world_from_sensor(double time_s) {
  Eigen::Affine3d body_from_sensor = Eigen::Affine3d::Identity();
  body_from_sensor.translation() = Vector3d(0.3, -0.05, -0.12);
  body_from_sensor.linear() = (Eigen::AngleAxisd(2.0 * kDegree, Vector3d::UnitZ()) *
                               Eigen::AngleAxisd(12.0 * kDegree, Vector3d::UnitY()))
                                  .toRotationMatrix();
  Eigen::Affine3d world_from_body = Eigen::Affine3d::Identity();
  world_from_body.translation() = BriskMotion::position(time_s);
  world_from_body.linear() = BriskMotion::rotation(time_s).toRotationMatrix();
  return world_from_body * body_from_sensor;
}

std::vector<Expected> expected_of(int scan) {
  constexpr double kElevation_deg[] = {-50.0, -25.0, 0.0, 20.0};
  constexpr double kAzimuth_deg[] = {0.0, 1.5, -2.0, 0.5};
  constexpr double kFiring_s[] = {0.0, 900e-6, 1700e-6, 2900e-6};
  constexpr double kVertical_m[] = {0.010, 0.005, 0.0, -0.005};
  std::vector<Expected> all;
  for (int cycle = 0; cycle < 120; ++cycle)
    for (int ring = 0; ring < 4; ++ring) {
      const double time_s = cycle * kCycle_s + kFiring_s[ring];
      if (time_s < 0.1 * scan || time_s >= 0.1 * (scan + 1)) continue;
      const double head = -2.0 * std::numbers::pi * 10.0 * time_s;
      const double e = kElevation_deg[ring] * kDegree;
      const double a = head + kAzimuth_deg[ring] * kDegree;
      const Vector3d from(0.04 * std::cos(head), 0.04 * std::sin(head), kVertical_m[ring]);
      const Vector3d ray(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
      const Eigen::Affine3d pose = world_from_sensor(time_s);
      const Vector3d ray_world = pose.linear() * ray;
      const double range_m = (kPlaneHeight_m - (pose * from).z()) / ray_world.z();
      if (!(range_m >= 0.5 && range_m <= kMostRange_m)) continue;
      all.push_back({.time_s = time_s,
                     .ring = ring,
                     .range_m = range_m,
                     .cosine = std::abs(ray_world.z()),
                     .point_sensor = from + range_m * ray,
                     .point_world = pose * (from + range_m * ray),
                     .by_frame_world = world_from_sensor(0.1 * scan) * (from + range_m * ray)});
    }
  return all;
}

/// A scan's rows by the names of their columns.
class Rows {
 public:
  Rows(const capture::SequenceReader& sequence, int frame)
      : samples_(sequence.read_samples(0, frame)) {
    const auto& channels = sequence.info().streams[0].channels;
    for (std::size_t k = 0; k < channels.size(); ++k) columns_[channels[k].name] = k;
  }
  std::size_t size() const { return samples_.times_s.size(); }
  double time_s(std::size_t row) const { return samples_.times_s[row]; }
  double at(const std::string& column, std::size_t row) const {
    return samples_.values[row * columns_.size() + columns_.at(column)];
  }
  Vector3d point(const std::string& prefix, std::size_t row) const {
    return {at(prefix + "x_m", row), at(prefix + "y_m", row), at(prefix + "z_m", row)};
  }

 private:
  capture::Samples samples_;
  std::map<std::string, std::size_t> columns_;
};

capture::SequenceReader scanned(const std::filesystem::path& folder, const std::string& keys) {
  core::make_folder(folder);
  const world::TileStore store = make_plane(folder / "world");
  const render::SequencePlan plan = plan_of(rig_with(folder, keys));
  render::run_render_stage(store, plan, {}, {}, folder / "P000", {.log = kQuiet});
  return capture::SequenceReader::open(folder / "P000");
}

TEST(Lidar, EachPulseIsMeasuredAtItsOwnTime) {
  const ScratchFolder folder;
  const capture::SequenceReader sequence = scanned(folder.path(), kScanner);
  double most_skew_m = 0.0;
  for (int scan = 0; scan < 4; ++scan) {
    const Rows rows(sequence, scan);
    const std::vector<Expected> expected = expected_of(scan);
    ASSERT_EQ(rows.size(), expected.size()) << scan;
    EXPECT_GT(rows.size(), 30U);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const Expected& one = expected[i];
      EXPECT_NEAR(rows.time_s(i), one.time_s, 1e-15);
      EXPECT_EQ(rows.at("ring", i), one.ring);
      EXPECT_NEAR(rows.at("true_range_m", i), one.range_m, kTolerance_m);
      EXPECT_EQ(rows.at("range_m", i), rows.at("true_range_m", i));  // no errors are stated
      EXPECT_LT((rows.point("", i) - one.point_sensor).norm(), kTolerance_m);
      EXPECT_LT((rows.point("world_", i) - one.point_world).norm(), kTolerance_m);
      // Stored as float: half of its last place.
      EXPECT_NEAR(rows.at("incidence_rad", i), std::acos(one.cosine), 1e-7);
      const double power = 0.2 * one.cosine / (one.range_m * one.range_m);
      EXPECT_NEAR(rows.at("power_per_m2", i) / power, 1.0, 1e-7);
      EXPECT_NEAR(rows.at("reflectance", i), 0.2 * one.cosine, 2e-8);
      EXPECT_EQ(rows.at("return_number", i), 1.0);
      EXPECT_EQ(rows.at("num_returns", i), 1.0);
      EXPECT_EQ(rows.at("instance_id", i), 0.0);
      most_skew_m = std::max(most_skew_m, (one.by_frame_world - one.point_world).norm());
    }
  }
  EXPECT_GT(most_skew_m, 10.0);  // the frame's pose would not do
}

TEST(Lidar, PulsesAreNumberedWithThoseThatMetNothing) {
  const ScratchFolder folder;
  const capture::SequenceReader sequence = scanned(folder.path(), kScanner);
  for (int scan = 0; scan < 4; ++scan) {
    const Rows rows(sequence, scan);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      // The number of pulses before it, of all cycles from the scan's beginning on.
      const double cycle = std::floor(rows.time_s(i) / kCycle_s + 1e-9);
      int before = 0;
      for (int at = 0; at <= static_cast<int>(cycle); ++at)
        for (const double firing_s : {0.0, 900e-6, 1700e-6, 2900e-6}) {
          const double time_s = at * kCycle_s + firing_s;
          before += time_s >= 0.1 * scan && time_s < rows.time_s(i) - 1e-12 ? 1 : 0;
        }
      EXPECT_EQ(rows.at("pulse", i), before);
    }
  }
}

TEST(Lidar, ScansAreTheSameFromAnyShardsAndThreads) {
  const ScratchFolder folder;
  const std::string keys =
      std::string(kScanner) + "range_noise_m = 0.03\nrays = 7\ndivergence_mrad = 3.0\n";
  const world::TileStore store = make_plane(folder / "world");
  const render::SequencePlan plan = plan_of(rig_with(folder.path(), keys));
  render::run_render_stage(store, plan, {}, {}, folder / "whole", {.log = kQuiet});
  for (const int shard : {1, 0, 2})
    render::run_render_stage(store, plan, {}, {.first = shard, .step = 3}, folder / "shards",
                             {.log = kQuiet, .num_threads = 1 + shard});
  EXPECT_EQ(first_difference(folder / "whole", folder / "shards"), "");
}

TEST(Lidar, DamagedScansAreRefusedAndMeasuredAgain) {
  const ScratchFolder folder;
  const capture::SequenceReader sequence = scanned(folder.path(), kScanner);
  const std::filesystem::path file = folder / "P000/r/lidar/000001.npy";
  const std::string whole = core::read_text_file(file);
  EXPECT_NE(whole.find("('time_s', '<f8')"), std::string::npos);
  EXPECT_NE(whole.find("('ring', '<u2')"), std::string::npos);
  core::write_file(file, whole.substr(0, whole.size() - 1));
  expect_error(core::ErrorKind::Input, {"000001.npy"}, [&] { sequence.read_samples(0, 1); });
  render::run_render_stage(world::TileStore::open(folder / "world"),
                           plan_of(rig_with(folder.path(), kScanner)), {}, {}, folder / "P000",
                           {.log = kQuiet});
  EXPECT_EQ(core::read_text_file(file), whole);
}

TEST(Lidar, NoiseScattersAsStatedAndStepsAreMultiples) {
  const ScratchFolder folder;
  constexpr double kNoise_m = 0.25;
  constexpr double kStep_m = 0.002;
  std::string keys = kScanner;
  keys.replace(keys.find("cycle_us = 3952.569169960474"), 28, "columns = 2000");
  keys += "range_noise_m = 0.25\nrange_step_m = 0.002\n";
  const capture::SequenceReader sequence = scanned(folder.path(), keys);
  double sum = 0.0, squares = 0.0, products = 0.0, before = 0.0;
  int count = 0;
  for (int scan = 0; scan < 4; ++scan) {
    const Rows rows(sequence, scan);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double range_m = rows.at("range_m", i);
      EXPECT_NEAR(range_m / kStep_m, std::round(range_m / kStep_m), 1e-9);
      const double error_m = range_m - rows.at("true_range_m", i);
      sum += error_m;
      squares += error_m * error_m;
      products += error_m * before;
      before = error_m;
      ++count;
    }
  }
  ASSERT_GT(count, 10000);
  const double mean_m = sum / count;
  const double variance = squares / count - mean_m * mean_m;
  // Four standard errors: of a mean, of a variance (chi squared), of a correlation.
  EXPECT_LT(std::abs(mean_m), 4.0 * kNoise_m / std::sqrt(count));
  EXPECT_NEAR(variance / (kNoise_m * kNoise_m + kStep_m * kStep_m / 12.0), 1.0,
              4.0 * std::sqrt(2.0 / count));
  EXPECT_LT(std::abs(products / count) / variance, 4.0 / std::sqrt(count));
}

TEST(Lidar, WhatBringsBackTooLittleIsLost) {
  const ScratchFolder folder;
  constexpr double kReach_m = 90.0;
  constexpr double kExtinction_per_m = 2.5e-3;
  const capture::SequenceReader sequence =
      scanned(folder.path(), std::string(kScanner) +
                                 "range_at_10_percent_m = 90.0\nextinction_per_km = 2.5\n"
                                 "reflectances = { others = 0.15 }\n");
  const double least = 0.1 * std::exp(-2.0 * kExtinction_per_m * kReach_m) / (kReach_m * kReach_m);
  std::size_t num_lost = 0;
  for (int scan = 0; scan < 4; ++scan) {
    const Rows rows(sequence, scan);
    std::size_t row = 0;
    for (const Expected& one : expected_of(scan)) {
      const double power = 0.15 * one.cosine * std::exp(-2.0 * kExtinction_per_m * one.range_m) /
                           (one.range_m * one.range_m);
      ASSERT_GT(std::abs(power / least - 1.0), 1e-9);
      if (power < least) {
        ++num_lost;
        continue;
      }
      ASSERT_LT(row, rows.size());
      EXPECT_NEAR(rows.at("true_range_m", row), one.range_m, kTolerance_m);
      EXPECT_NEAR(rows.at("power_per_m2", row) / power, 1.0, 1e-7);
      ++row;
    }
    EXPECT_EQ(row, rows.size());
  }
  EXPECT_GT(num_lost, 20U);
}

// An echo of a slope is as wide as its range varies over the beam: R tan(incidence) times the standard deviation of the
// beam's angle, a quarter of its divergence at 1/e2.
TEST(Lidar, AnEchoOfASlopeIsAsWideAsTheBeamMakesIt) {
  const ScratchFolder folder;
  constexpr double kDivergence_rad = 1e-3;
  const std::string beam = "rays = 37\npulse_ns = 1000.0\ndivergence_mrad = ";
  const capture::SequenceReader sequence = scanned(folder / "full", kScanner + beam + "1.0\n");
  const capture::SequenceReader half =
      scanned(folder / "half",
              kScanner + beam + fmt::format("{}\ndivergence_at = \"half\"\n", 1.0 / 1.69864));
  int num_steep = 0;
  for (int scan = 0; scan < 4; ++scan) {
    const Rows rows(sequence, scan);
    const Rows rows_at_half(half, scan);
    ASSERT_EQ(rows.size(), rows_at_half.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double range_m = rows.at("true_range_m", i);
      const double slope = std::tan(rows.at("incidence_rad", i));
      if (slope > 4.0 || range_m > 0.95 * kMostRange_m)
        continue;  // where the second order counts, and rays miss, or end beyond the reach
      const double spread_m = range_m * slope * kDivergence_rad / 4.0;
      // Of second order are (slope divergence)^2, 2e-5, of the spread and R divergence^2 beside it.
      EXPECT_NEAR(rows.at("spread_m", i), spread_m, 1e-3 * spread_m + 1e-6 * range_m);
      EXPECT_NEAR(rows_at_half.at("spread_m", i), rows.at("spread_m", i),
                  1e-3 * spread_m + 1e-6 * range_m);
      num_steep += slope > 1.0 ? 1 : 0;
    }
  }
  EXPECT_GT(num_steep, 20);
}

// Light ends at what is too near to be measured.
TEST(Lidar, WhatIsTooNearHidesWhatIsBehind) {
  const ScratchFolder folder;
  const capture::SequenceReader sequence =
      scanned(folder.path(), std::string(kScanner) + "least_range_m = 150.0\n");
  std::size_t num_near = 0;
  for (int scan = 0; scan < 4; ++scan) {
    const Rows rows(sequence, scan);
    std::size_t row = 0;
    for (const Expected& one : expected_of(scan)) {
      if (one.range_m < 150.0) {
        ++num_near;
        continue;
      }
      ASSERT_LT(row, rows.size());
      EXPECT_NEAR(rows.at("true_range_m", row++), one.range_m, kTolerance_m);
    }
    EXPECT_EQ(row, rows.size());
  }
  EXPECT_GT(num_near, 20U);
}

/// Sets of instruments, by the pulses a second that their makers and sources state.
TEST(Lidar, ShippedSetsHaveTheirInstrumentsPulses) {
  const ScratchFolder folder;
  const std::vector<std::pair<std::string, double>> sets = {
      {"velodyne_vlp16", 16.0 / 55.296e-6},
      {"ouster_os1_64", 64.0 * 1024.0 * 10.0},
      {"livox_mid40", 100e3},
      {"riegl_vq780i", 500e3 * 2.0 / 3.0},
      {"riegl_vux1uav", 200e3 * 330.0 / 360.0},
      {"leica_als50ii", 150e3}};
  for (const auto& [name, pulses_per_s] : sets) {
    const rigs::RigOptions rig = rig_with(
        folder.path(), fmt::format("[[sensors]]\nextends = \"{}/configs/sensors/{}.toml\"\nname = "
                                   "\"lidar\"\n",
                                   TERRACAST_SOURCE_DIR, name));
    const std::vector<sensors::MountedSensor> mounted = rigs::mount_sensors({rig});
    ASSERT_EQ(mounted.size(), 1U);
    const auto* const scanner = dynamic_cast<const sensors::Scanner*>(&*mounted[0].sensor);
    ASSERT_NE(scanner, nullptr) << name;
    const std::string& settings = mounted[0].info.settings_toml;
    const std::size_t at = settings.find("most_returns = ") + 15;
    EXPECT_NEAR(scanner->rows_per_s(mounted[0].info.rate_hz) / std::stod(settings.substr(at)),
                pulses_per_s, 1e-6 * pulses_per_s)
        << name;
  }
}

TEST(Lidar, KeysThatContradictEachOtherAreRefused) {
  const ScratchFolder folder;
  const auto refuse = [&](const std::string& keys, const std::vector<std::string>& words) {
    expect_error(core::ErrorKind::Config, words, [&] {
      rigs::mount_sensors({rig_with(folder.path(), std::string(kScanner) + keys)});
    });
  };
  refuse("least_range_m = 500.0\n", {"least_range_m = 500", "most_range_m = 400"});
  refuse("most_returns = 3\n", {"most_returns = 3", "rays = 7"});
  refuse("rays = 5\ndivergence_mrad = 1.0\n", {"rays = 5", "7, 19"});
  refuse("rays = 7\n", {"rays = 7", "divergence_mrad"});
  refuse("across_mm = [1.0, 2.0]\n", {"across_mm has 2 numbers", "elevation_deg 4"});
  refuse("reflectances = { gras = 0.5 }\n", {"gras"});
  const auto refuse_all = [&](const std::string& keys, const std::vector<std::string>& words) {
    const std::string head = "[[sensors]]\nname = \"lidar\"\nkind = \"lidar\"\nrate_hz = 10.0\n";
    expect_error(core::ErrorKind::Config, words,
                 [&] { rigs::mount_sensors({rig_with(folder.path(), head + keys)}); });
  };
  refuse_all("pattern = \"raster\"\nrows = 65536\ncolumns = 65536\n",
             {"lidar", "4.29e+09 points", "1.6e+07 fit"});
  refuse_all("pattern = \"spinning\"\ncycle_us = 1e-9\n", {"cycle_us = 1e-09", "0.001"});
  refuse_all("pattern = \"spiral\"\n", {"spiral", "spinning"});
  refuse_all("pattern = \"spinning\"\nelevation_deg = []\n", {"1 to 4096 lasers"});
  refuse_all("pattern = \"spinning\"\nelevation_deg = [nan]\n", {"elevation_deg[0] = nan"});
  refuse_all("pattern = \"spinning\"\ncolumns = 0\n", {"cycle_us and columns"});
  refuse_all("pattern = \"risley\"\nturns_hz = [1.0]\n", {"turns_hz has 1", "wedge_deg 2"});
  refuse_all("pattern = \"risley\"\nwedge_deg = [59.0, 59.0]\n", {"throw the beam back"});
}

}  // namespace
}  // namespace terracast::test
