// A laser over a plane, against the plane's closed form, and through a capture.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

#include "capture/frame_reader.h"
#include "core/atomic_file.h"
#include "core/log.h"
#include "core/toml_reader.h"
#include "render/render_stage.h"
#include "rigs/rig.h"
#include "tests/support/expect_error.h"
#include "tests/support/folder_compare.h"
#include "tests/support/hills_flight.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

using Eigen::Vector3d;

constexpr double kPlaneHeight_m = 40.0;
constexpr double kDuration_s = 0.3;

/// A body that falls, drifts, and turns about two axes at uneven rates: angles up to 10 rad/s^2.
class BriskMotion : public geo::Trajectory {
 public:
  double duration_s() const override { return kDuration_s; }
  geo::MotionState at(double time_s) const override {
    geo::MotionState state;
    state.time_s = time_s;
    state.world_from_body = {.rotation = rotation(time_s), .translation = position(time_s)};
    return state;
  }
  std::vector<double> knots_s() const override { return {0.0, kDuration_s}; }

  static Vector3d position(double t) {
    return {3.0 + 25.0 * t, -4.0 + 6.0 * t * t, 140.0 - 4.9 * t * t + 8.0 * t * t * t};
  }
  static Eigen::Quaterniond rotation(double t) {
    return Eigen::AngleAxisd(0.4 + 5.0 * t * t, Vector3d::UnitZ()) *
           Eigen::AngleAxisd(1.1 + 0.3 * std::sin(7.0 * t), Vector3d::UnitY());
  }
};

/// Keys of a rig with one camera and rangefinders.
rigs::RigOptions rig_with(const std::filesystem::path& folder, const std::string& sensors) {
  core::write_file(folder / "rig.toml", R"(name = "r"
[[cameras]]
name = "down"
width_px = 24
height_px = 16
fx_px = 20.0
euler_deg = [0.0, 70.0, 0.0]
)" + sensors);
  return core::read_toml<rigs::RigOptions>(folder / "rig.toml");
}

constexpr const char* kLaser = R"([[sensors]]
name = "laser"
kind = "rangefinder"
rate_hz = 100.0
offset_mm = [300.0, -50.0, -120.0]
euler_deg = [2.0, 12.0, 0.0]
)";

render::SequencePlan plan_of(const rigs::RigOptions& rig) {
  render::SequencePlan plan = small_plan(4, 24, 16);
  plan.cameras = rigs::build_cameras({rig});
  plan.sensors = rigs::mount_sensors({rig});
  plan.rate_hz = 10.0;
  plan.motion = {.trajectory = std::make_shared<BriskMotion>(), .start_s = 0.0};
  for (std::size_t i = 0; i < plan.states.size(); ++i)
    plan.states[i] = plan.motion.at(static_cast<double>(i) / plan.rate_hz);
  plan.tracks.num_points = 0;
  return plan;
}

world::TileStore make_plane(const std::filesystem::path& folder) {
  return make_tiny_world(folder, [](double, double) { return kPlaneHeight_m; },
                         {.finest_level = 3, .coarsest_level = 3});
}

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
      plan.sensors[0].measure(traced.scene, plan.motion, 1, {0.0, 0.1}, nullptr);
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
