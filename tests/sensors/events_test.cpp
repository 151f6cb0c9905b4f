// Event cameras in a scene: against the sky in closed form, against the light that they saw, and through a capture.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "capture/frame_reader.h"
#include "core/hash.h"
#include "core/log.h"
#include "render/checked_plan.h"
#include "render/render_stage.h"
#include "sensors/events/scene_looks.h"
#include "tests/sensors/brisk_motion.h"
#include "tests/support/expect_error.h"
#include "tests/support/folder_compare.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

using Eigen::Vector3d;

const core::Log kQuiet("test", core::LogLevel::Off);
constexpr double kDegree = 3.14159265358979323846 / 180.0;

/// Looks up into the sky, at its own place.
constexpr const char* kSkyward = R"([[sensors]]
name = "dvs"
kind = "events"
rate_hz = 100.0
euler_deg = [20.0, -120.0, 0.0]
width_px = 24
height_px = 16
fx_px = 1000.0
finest_step_us = 20.0
contrast_on = 0.02
contrast_off = 0.025
dark_cd_per_m2 = 1e-6
)";

/// Looks at the ground through the rig's camera.
constexpr const char* kThroughCamera = R"([[sensors]]
name = "dvs"
kind = "events"
rate_hz = 50.0
camera = "down"
contrast_on = 0.05
contrast_off = 0.06
contrast_sd = 0.005
samples = 4
brightness_step = 0.25
flow_step_px = 0.1
finest_step_us = 20.0
)";

/// A row of a scan.
struct Row {
  double time_s;
  int x;
  int y;
  bool is_on;
  double contrast;
};

std::vector<Row> rows_of(const capture::Samples& samples) {
  std::vector<Row> rows;
  for (std::size_t i = 0; i < samples.times_s.size(); ++i) {
    const double* const values = &samples.values[5 * i];
    rows.push_back({samples.times_s[i], static_cast<int>(values[0]), static_cast<int>(values[1]),
                    values[2] == 1.0, values[4]});
  }
  return rows;
}

std::vector<Row> measured(const world::TileStore& store, const render::SequencePlan& plan,
                          std::int64_t num_ticks) {
  const TracedPlan traced(store, plan);
  return rows_of(plan.sensors[0].measure(traced.scene, plan.motion, 1,
                                         {.first = 0, .end = num_ticks}, nullptr));
}

TEST(Events, OfTheSkyComeWhenItsRadianceSays) {
  const ScratchFolder folder;
  const world::TileStore store = make_plane(folder / "world");
  const render::SequencePlan plan = plan_of(rig_with(folder.path(), kSkyward));
  const TracedPlan traced(store, plan);
  const scene::Sky& sky = traced.scene.sky();
  // ln of the sky's luminance at the middle of a pixel, with the pose from the motion's own formulas and the mount and the
  // lens written out once more. The mean place of a pixel's samples is off its middle by some hundredths of a pixel, which
  // is 1 mrad: 5e-5 of the sky's light.
  const auto log_light = [&](int x, int y, double t) {
    const Eigen::Matrix3d world_from_sensor =
        BriskMotion::rotation(t).toRotationMatrix() *
        (Eigen::AngleAxisd(20.0 * kDegree, Vector3d::UnitZ()) *
         Eigen::AngleAxisd(-120.0 * kDegree, Vector3d::UnitY()))
            .toRotationMatrix();
    const Vector3d ray(1.0, -(x + 0.5 - 12.0) / 1000.0, -(y + 0.5 - 8.0) / 1000.0);
    const Vector3d direction = (world_from_sensor * ray).normalized();
    const scene::Color color = sky.radiance(direction.cast<float>());
    return std::log(1e3 * static_cast<double>(scene::luminance_of(color)) + 1e-6);
  };
  std::map<std::pair<int, int>, double> references;
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 24; ++x) references[{x, y}] = log_light(x, y, 0.0);
  const std::vector<Row> rows = rows_of(
      plan.sensors[0].measure(traced.scene, plan.motion, 1, {.first = 0, .end = 30}, nullptr));
  EXPECT_GT(rows.size(), 3000U);
  double worst = 0.0, fastest = 0.0;
  for (const Row& row : rows) {
    double& reference = references[{row.x, row.y}];
    reference += row.is_on ? 0.02 : -0.025;
    worst = std::max(worst, std::abs(log_light(row.x, row.y, row.time_s) - reference));
    fastest = std::max(fastest, std::abs(log_light(row.x, row.y, row.time_s + 1e-3) -
                                         log_light(row.x, row.y, row.time_s)));
  }
  EXPECT_LT(worst, 1e-4);
  EXPECT_GT(fastest, 1e-3);  // late by a millisecond would show
  // None is missing: what is left over is less than a threshold.
  for (const auto& [pixel, reference] : references) {
    const double left = log_light(pixel.first, pixel.second, 0.3) - reference;
    EXPECT_LT(left, 0.02 + 1e-4);
    EXPECT_GT(left, -0.025 - 1e-4);
  }
}

TEST(Events, OfTheGroundAddUpToTheLightThatPixelsSee) {
  const ScratchFolder folder;
  const world::TileStore store = make_plane(folder / "world");
  const render::SequencePlan plan = plan_of(rig_with(folder.path(), kThroughCamera));
  const std::vector<Row> rows = measured(store, plan, 15);
  EXPECT_GT(rows.size(), 5000U);
  // The light at times of its own, at the place that the rig's file states, apart from any steps.
  const TracedPlan traced(store, plan);
  const std::unique_ptr<geo::CameraModel> model = geo::make_camera(plan.cameras[0].intrinsics);
  const sensors::events::PixelOptions pixel_options;
  const scene::PixelSampler sampler(4);
  const sensors::SensorSite site{
      .scene = traced.scene,
      .body = plan.motion,
      .body_from_sensor = {.rotation = Eigen::Quaterniond(
                               Eigen::AngleAxisd(70.0 * kDegree, Vector3d::UnitY())),
                           .translation = Vector3d::Zero()},
      .rate_hz = 50.0,
      .stream_seed = 1 ^ core::content_hash64(std::as_bytes(std::span(std::string_view("r/dvs")))),
      .trail = nullptr};
  const sensors::events::SceneLooks looks(site, *model, pixel_options, sampler, 4,
                                          {.start_s = 0.0, .end_s = 0.3}, nullptr);
  sensors::events::SceneLooks::Scratch scratch;
  std::vector<sensors::events::LookPlace> places;
  std::vector<double> times_s = {0.0};
  std::mt19937 random(4);
  for (int i = 0; i < 40; ++i) times_s.push_back(std::uniform_real_distribution(0.0, 0.3)(random));
  std::sort(times_s.begin(), times_s.end());
  for (const double time_s : times_s)
    for (std::uint32_t pixel = 0; pixel < 24 * 16; ++pixel)
      places.push_back({.pixel = pixel, .time_s = time_s});
  std::vector<sensors::events::Look> seen(places.size());
  looks.look(places, seen, scratch);
  std::vector<double> references(24 * 16);
  for (std::size_t i = 0; i < references.size(); ++i) references[i] = seen[i].log_light;
  std::size_t next = 0;
  int num_beyond = 0;
  double worst = 0.0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    for (; next < rows.size() && rows[next].time_s <= places[i].time_s; ++next)
      references[static_cast<std::size_t>(rows[next].y * 24 + rows[next].x)] +=
          rows[next].is_on ? rows[next].contrast : -rows[next].contrast;
    const double change = seen[i].log_light - references[places[i].pixel];
    // Thresholds are 0.05 and 0.06 with a deviation of 0.005.
    const double beyond = std::max(change - 0.05 - 0.015, -change - 0.06 - 0.015);
    worst = std::max(worst, beyond);
    if (beyond > 0.0) ++num_beyond;
  }
  // A pixel of four samples leaps where one of them meets another shade, and the reference is late by a step at most, the
  // time of a tenth of a pixel: 0.5 % of the looks are seen to fall into such a step, by no more than a sample's share.
  EXPECT_LT(num_beyond, static_cast<int>(0.01 * static_cast<double>(places.size())));
  EXPECT_LT(worst, std::log(4.0 / 3.0));
}

TEST(Events, AreTheSameFromAnyShards) {
  const ScratchFolder folder;
  const world::TileStore store = make_plane(folder / "world");
  const render::SequencePlan plan =
      plan_of(rig_with(folder.path(), std::string(kThroughCamera) +
                                          "cutoff_hz = 200.0\nleak_hz = 1.0\nshot_noise_hz = 5.0\n"
                                          "refractory_us = 300.0\nfirst_reference = \"drawn\"\n"));
  render::run_render_stage(store, plan, {}, {}, folder / "whole", {.log = kQuiet});
  for (const int shard : {1, 0, 2})
    render::run_render_stage(store, plan, {}, {.first = shard, .step = 3}, folder / "shards",
                             {.log = kQuiet, .num_threads = 1 + shard});
  EXPECT_EQ(first_difference(folder / "whole", folder / "shards"), "");
  const capture::SequenceReader sequence = capture::SequenceReader::open(folder / "whole");
  ASSERT_EQ(sequence.info().streams.size(), 1U);
  EXPECT_TRUE(sequence.info().streams[0].is_scan);
  std::size_t num_events = 0;
  for (int frame = 0; frame < 4; ++frame)
    num_events += sequence.read_samples(0, frame).times_s.size();
  EXPECT_GT(num_events, 1000U);
}

TEST(Events, TimesAreWholeNanosecondsWithinTheirScan) {
  const ScratchFolder folder;
  const world::TileStore store = make_plane(folder / "world");
  const render::SequencePlan plan = plan_of(rig_with(folder.path(), kSkyward));
  const TracedPlan traced(store, plan);
  for (std::int64_t tick = 0; tick < 5; ++tick) {
    const capture::TickRange ticks{.first = tick, .end = tick + 1};
    const capture::Samples scan =
        plan.sensors[0].measure(traced.scene, plan.motion, 1, ticks, nullptr);
    EXPECT_TRUE(capture::are_times_of_scans(scan.times_s, ticks, 100.0));
    for (const double time_s : scan.times_s)
      EXPECT_EQ(static_cast<double>(std::llround(time_s * 1e9)) / 1e9, time_s);
  }
}

TEST(Events, KeysThatContradictEachOtherAreRefused) {
  const ScratchFolder folder;
  const auto refuse = [&](const std::string& keys, const std::vector<std::string>& words) {
    const std::string head = "[[sensors]]\nname = \"dvs\"\nkind = \"events\"\nrate_hz = 50.0\n";
    expect_error(core::ErrorKind::Config, words,
                 [&] { plan_of(rig_with(folder.path(), head + keys)); });
  };
  refuse("", {"camera", "width_px"});
  refuse("camera = \"left\"\n", {"rig r", "left", "lacks"});
  refuse("camera = \"down\"\nwidth_px = 10\n", {"width_px", "down"});
  refuse("camera = \"down\"\noffset_mm = [1.0, 0.0, 0.0]\n", {"offset_mm", "down"});
  refuse("camera = \"down\"\ncontrast_sd = 0.1\n", {"contrast_sd = 0.1", "0.0667"});
  refuse("camera = \"down\"\ncutoff_least_share = 0.5\n", {"cutoff_least_share", "cutoff_hz"});
  refuse("camera = \"down\"\nin_refractory = \"held\"\n", {"in_refractory", "lost"});
}

TEST(Events, ShippedSetsAreRead) {
  const ScratchFolder folder;
  for (const auto& [name, keys] :
       {std::pair{"v2e_pixels", "camera = \"down\"\n"}, std::pair{"davis346", ""}}) {
    const render::SequencePlan plan = plan_of(rig_with(
        folder.path(), fmt::format("[[sensors]]\nextends = \"{}/configs/sensors/{}.toml\"\n"
                                   "name = \"dvs\"\n{}",
                                   TERRACAST_SOURCE_DIR, name, keys)));
    ASSERT_EQ(plan.sensors.size(), 1U);
    EXPECT_EQ(plan.sensors[0].camera.has_value(), !std::string(keys).empty());
    // A look each 10 ms, of 8 rays a pixel.
    const double num_pixels = plan.sensors[0].camera ? 24.0 * 16.0 : 346.0 * 260.0;
    EXPECT_EQ(plan.sensors[0].least_rays_per_s(), 100.0 * 8.0 * num_pixels);
  }
}

TEST(Events, MoreRaysThanAnybodyWaitsForAreRefused) {
  const ScratchFolder folder;
  const world::TileStore store = make_plane(folder / "world");
  const render::SequencePlan plan = plan_of(
      rig_with(folder.path(),
               "[[sensors]]\nname = \"dvs\"\nkind = \"events\"\nrate_hz = 1000.0\nwidth_px = "
               "4096\nheight_px = 4096\nfx_px = 1000.0\nsamples = 256\n"));
  // 4096 x 4096 pixels, 256 rays each, 1000 times a second for 0.4 s.
  expect_error(core::ErrorKind::Config, {"r/dvs", "1.7e+12 rays"},
               [&] { render::CheckedPlan(plan, store); });
}

}  // namespace
}  // namespace terracast::test
