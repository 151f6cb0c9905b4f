// A laser over a plane, against the plane's closed form, and through a capture.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

#include "capture/frame_reader.h"
#include "core/log.h"
#include "render/render_stage.h"
#include "tests/sensors/brisk_motion.h"
#include "tests/support/expect_error.h"
#include "tests/support/folder_compare.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

using Eigen::Vector3d;

constexpr const char* kLaser = R"([[sensors]]
name = "laser"
kind = "rangefinder"
rate_hz = 100.0
offset_mm = [300.0, -50.0, -120.0]
euler_deg = [2.0, 12.0, 0.0]
)";

/// The range to the plane at a time, from the motion's own formulas and the mount written out once more.
double range_to_plane_m(double time_s) {
  constexpr double kDegree = 3.14159265358979323846 / 180.0;
  const Eigen::Matrix3d world_from_body = BriskMotion::rotation(time_s).toRotationMatrix();
  const Eigen::Matrix3d body_from_sensor = (Eigen::AngleAxisd(2.0 * kDegree, Vector3d::UnitZ()) *
                                            Eigen::AngleAxisd(12.0 * kDegree, Vector3d::UnitY()))
                                               .toRotationMatrix();
  const Vector3d from =
      BriskMotion::position(time_s) + world_from_body * Vector3d(0.3, -0.05, -0.12);
  const Vector3d ray = world_from_body * body_from_sensor.col(0);
  return (kPlaneHeight_m - from.z()) / ray.z();
}

const core::Log kQuiet("test", core::LogLevel::Off);

// Doubles of a few hundred metres, through rotations: 1e-12 of 200 m is what they err by.
constexpr double kTolerance_m = 1e-9;

TEST(Rangefinder, MeasuresEachRangeAtItsOwnTime) {
  const ScratchFolder folder;
  const world::TileStore store = make_plane(folder / "world");
  const render::SequencePlan plan = plan_of(rig_with(folder.path(), kLaser));
  render::run_render_stage(store, plan, {}, {}, folder / "P000", {.log = kQuiet});
  const capture::SequenceReader sequence = capture::SequenceReader::open(folder / "P000");
  ASSERT_EQ(sequence.info().streams.size(), 1U);
  EXPECT_EQ(sequence.info().streams[0].channels[0].unit, "m");
  const capture::Samples samples = sequence.read_samples(0);
  ASSERT_EQ(samples.times_s.size(), 31U);
  double least = 1e9, most = 0.0;
  for (std::size_t i = 0; i < samples.times_s.size(); ++i) {
    EXPECT_EQ(samples.times_s[i], static_cast<double>(i) / 100.0);
    EXPECT_NEAR(samples.values[i], range_to_plane_m(samples.times_s[i]), kTolerance_m);
    least = std::min(least, samples.values[i]);
    most = std::max(most, samples.values[i]);
  }
  EXPECT_GT(most - least, 2.0);  // the motion is one that counts
}

TEST(Rangefinder, SamplesAreTheSameFromAnyShards) {
  const ScratchFolder folder;
  const world::TileStore store = make_plane(folder / "world");
  const render::SequencePlan plan = plan_of(rig_with(folder.path(), kLaser));
  render::run_render_stage(store, plan, {}, {}, folder / "whole", {.log = kQuiet});
  for (const int shard : {1, 0, 2})
    render::run_render_stage(store, plan, {}, {.first = shard, .step = 3}, folder / "shards",
                             {.log = kQuiet, .num_threads = 1 + shard});
  EXPECT_EQ(first_difference(folder / "whole", folder / "shards"), "");
}

TEST(Rangefinder, DamagedSamplesAreMeasuredAgain) {
  const ScratchFolder folder;
  const world::TileStore store = make_plane(folder / "world");
  const render::SequencePlan plan = plan_of(rig_with(folder.path(), kLaser));
  render::run_render_stage(store, plan, {}, {}, folder / "P000", {.log = kQuiet});
  const std::filesystem::path file = folder / "P000/r/laser/000001.npy";
  const std::string whole = core::read_text_file(file);
  std::string damaged = whole;
  damaged.back() = static_cast<char>(damaged.back() ^ 1);
  core::write_file(file, damaged);
  expect_error(core::ErrorKind::Input, {"000001.npy", "damaged"},
               [&] { capture::SequenceReader::open(folder / "P000").read_samples(0); });
  const render::RenderedFrames again =
      render::run_render_stage(store, plan, {}, {}, folder / "P000", {.log = kQuiet});
  EXPECT_EQ(again.rendered, std::vector<int>{1});
  EXPECT_EQ(core::read_text_file(file), whole);
}

TEST(Rangefinder, BeyondItsReachThereIsNothing) {
  const ScratchFolder folder;
  const world::TileStore store = make_plane(folder / "world");
  const render::SequencePlan plan =
      plan_of(rig_with(folder.path(), std::string(kLaser) + "most_range_m = 20.0\n"));
  render::run_render_stage(store, plan, {}, {.end = 1}, folder / "P000", {.log = kQuiet});
  const TracedPlan traced(store, plan);
  const capture::Samples samples =
      plan.sensors[0].measure(traced.scene, plan.motion, 1, {.first = 0, .end = 10}, nullptr);
  for (const double range_m : samples.values)
    EXPECT_EQ(range_m, std::numeric_limits<double>::infinity());
}

TEST(Rangefinder, OptionsThatContradictEachOtherAreRefused) {
  const ScratchFolder folder;
  const auto refuse = [&](const std::string& keys, const std::vector<std::string>& words) {
    expect_error(core::ErrorKind::Config, words,
                 [&] { rigs::mount_sensors({rig_with(folder.path(), keys)}); });
  };
  refuse(std::string(kLaser) + "least_range_m = 3.0\nmost_range_m = 2.0\n",
         {"least_range_m = 3", "most_range_m = 2"});
  refuse(std::string(kLaser) + kLaser, {"laser"});
  refuse("[[sensors]]\nname = \"down\"\nkind = \"rangefinder\"\n", {"down"});
  refuse("[[sensors]]\nname = \"a/b\"\nkind = \"rangefinder\"\n", {"a/b"});
  refuse("[[sensors]]\nname = \"a\"\nkind = \"rangefinde\"\n", {"rangefinder"});
  refuse("[[sensors]]\nname = \"a\"\nkind = \"rangefinder\"\nrate_hz = 0.0\n", {"rate_hz"});
}

}  // namespace
}  // namespace terracast::test
