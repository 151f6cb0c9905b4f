#include "geo/shutter.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <fstream>
#include <numbers>

#include "capture/channel.h"
#include "capture/labels.h"
#include "core/error.h"
#include "core/random.h"
#include "core/toml_reader.h"
#include "geo/frames.h"
#include "render/input_hash.h"
#include "scene/ground/sample_width.h"
#include "sensors/camera/sight.h"
#include "tests/sensors/plane_flight.h"
#include "tests/support/expect_error.h"
#include "tests/support/hills_flight.h"
#include "tests/support/test_data.h"

namespace terracast::sensors {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::TracedPlan;

using test::Flight;
using test::kPlane_z;
using test::Pose;
using test::set_moving;
using test::time_of;

/// Where a point is seen in the image, by halving the time between a tenth of a second before and after.
std::optional<Vector2d> seen_at(const render::SequencePlan& plan, int frame,
                                const geo::CameraModel& model, const Vector3d& point) {
  const geo::Shutter& shutter = plan.cameras[0].shutter;
  const auto miss = [&](double t) -> std::optional<double> {
    const auto pixel = Pose(plan, frame, t).project(model, point);
    if (!pixel) return std::nullopt;
    return time_of(shutter, model, *pixel) - t;
  };
  double low = -0.1, high = 0.1;
  if (!miss(low) || !miss(high) || *miss(low) < 0.0 || *miss(high) > 0.0) return std::nullopt;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    const auto there = miss(middle);
    if (!there) return std::nullopt;
    (*there > 0.0 ? low : high) = middle;
  }
  return Pose(plan, frame, low).project(model, point);
}

TEST(Shutter, APointThatRunsAlongWithTheLinesIsNotSeen) {
  const geo::Shutter shutter{.line_time_s = 1e-3};
  // Rows go down by one a millisecond, and so does the point, always a row ahead.
  const auto along = [](double t) -> std::optional<Vector2d> {
    return Vector2d(5.0, 17.0 + 1e3 * t);
  };
  EXPECT_FALSE(geo::find_seen(shutter, 40, 32, along));
  // Half as fast it is caught up with: t = (17 - 16 + 500 t) / 1000.
  const auto slow = [](double t) -> std::optional<Vector2d> {
    return Vector2d(5.0, 17.0 + 500.0 * t);
  };
  const auto seen = geo::find_seen(shutter, 40, 32, slow);
  ASSERT_TRUE(seen);
  EXPECT_NEAR(seen->offset_s, 2e-3, 1e-12);
  EXPECT_NEAR(seen->pixel.y(), 18.0, 1e-9);
}

TEST(Shutter, PointsAreSeenWhereRoundingsAreTheLargest) {
  // At the corner of a world of 50 km, a long lens close to the ground: a place in double is 4e-12 m off, which
  // is more of a line than the search's aim.
  render::SequencePlan plan = test::small_plan(1, 640, 480);
  plan.cameras.resize(1);
  plan.cameras[0].intrinsics.parameters = {3000, 3000, 320, 240};
  plan.cameras[0].shutter = {.line_time_s = 3e-5};
  plan.states[0].world_from_body.translation = {25000.0, -24000.0, 130.0};
  plan.states[0].velocity_world_mps = {20.0, -15.0, 3.0};
  plan.states[0].angular_velocity_body_radps = {0.2, -0.1, 0.3};
  const ViewTable views(plan.states, plan.cameras);
  const auto model = geo::make_camera(plan.cameras[0].intrinsics);
  for (int k = 0; k < 2000; ++k) {
    const auto draw = [&](std::uint64_t dimension) {
      return core::random_unit(7, dimension, static_cast<std::uint64_t>(k));
    };
    const Vector2d pixel(620 * draw(0) + 10, 460 * draw(1) + 10);
    const Pose pose(plan, 0, time_of(plan.cameras[0].shutter, *model, pixel));
    const Vector3d point = pose.center_world +
                           (2.0 + 8.0 * draw(2)) *
                               (pose.world_from_camera * model->ray_from_pixel(pixel).normalized());
    const auto seen = views.open(0, 0).that_sees(point);
    ASSERT_TRUE(seen) << pixel.transpose();
    // A line in a million, 3e-11 s, moves the camera by less than the place's own rounding.
    EXPECT_LT((seen->view.center_world - pose.center_world).norm(), 1e-8);
  }
}

TEST(Shutter, ImagesAreTracedInPartsOfLines) {
  // Wider than a part of a line is long, and with things in the way of it: each pixel is met as alone.
  const test::ScratchFolder folder;
  const world::TileStore store = test::make_hills(folder / "world");
  for (const geo::Readout readout : {geo::Readout::Down, geo::Readout::Left}) {
    render::SequencePlan plan = test::small_plan(1, 1100, 6);
    if (readout == geo::Readout::Left) plan = test::small_plan(1, 6, 1100);
    set_moving(plan.states);
    plan.cameras.resize(1);
    plan.cameras[0].shutter = {.line_time_s = 2e-3, .readout = readout};
    plan.cameras[0].intrinsics.parameters = {550, 550, 0.5 * plan.cameras[0].intrinsics.width_px,
                                             0.5 * plan.cameras[0].intrinsics.height_px};
    const TracedPlan scene(store, plan);
    const TruthFrame truth = scene.renderer.truth(0, 0);
    const auto model = geo::make_camera(plan.cameras[0].intrinsics);
    int num_ground = 0;
    for (int y = 0; y < model->height_px(); ++y)
      for (int x = 0; x < model->width_px(); ++x) {
        const Vector2d pixel(x + 0.5, y + 0.5);
        const Pose pose(plan, 0, time_of(plan.cameras[0].shutter, *model, pixel));
        const world::WorldRay ray{
            .origin_world = pose.center_world,
            .direction_world = pose.world_from_camera * model->ray_from_pixel(pixel).normalized()};
        world::SurfaceHit hit;
        scene.query.intersect(std::span(&ray, 1), std::span(&hit, 1), world::Coherence::Incoherent);
        const double range_m = truth.range_m[static_cast<std::size_t>(y * model->width_px() + x)];
        if (hit.is_sky() || std::isinf(range_m)) {
          // Only at the horizon may a rounding decide.
          EXPECT_EQ(hit.is_sky(), std::isinf(range_m)) << x << " " << y;
          continue;
        }
        ++num_ground;
        // Grazing rays carry the poses' roundings, 1e-13 rad, far.
        EXPECT_NEAR(range_m, hit.t, 1e-7 * hit.t) << x << " " << y;
      }
    EXPECT_GT(num_ground, 1000);
  }
}

TEST(Shutter, AnImageTakesNoLongerThanTheTimeToTheNext) {
  const Flight flight({"pinhole", 40, 32, {30, 30, 20, 16}}, {.line_time_s = 4e-3});
  render::SequencePlan plan = flight.plan;
  plan.rate_hz = 10.0;
  const test::ScratchFolder out;
  const core::Context context{.log = core::Log("test", core::LogLevel::Off)};
  try {
    render::run_render_stage(flight.store, plan, {}, {}, out / "P000", context);
    FAIL() << "32 lines of 4 ms in 100 ms";
  } catch (const core::Error& error) {
    EXPECT_NE(error.message().find("128 ms"), std::string::npos) << error.message();
    EXPECT_NE(error.message().find("line_time_us"), std::string::npos) << error.message();
  }
}

TEST(Shutter, TracksAreSeenWhereTheirLinesSeeThem) {
  const test::ScratchFolder folder;
  const world::TileStore store = test::make_hills(folder / "world");
  render::SequencePlan plan = test::small_plan(2, 64, 48);
  set_moving(plan.states);
  plan.cameras.resize(1);
  plan.cameras[0].shutter = {.line_time_s = 1e-3};
  const TracedPlan scene(store, plan);
  const auto model = geo::make_camera(plan.cameras[0].intrinsics);
  // Points of pixels of a frame are seen in that frame.
  const TruthFrame truth = scene.renderer.truth(0, 0);
  std::vector<Vector3d> points;
  for (std::size_t pixel = 0; pixel < truth.range_m.size(); ++pixel)
    if (std::isfinite(truth.range_m[pixel])) points.push_back(truth.point_world[pixel]);
  ASSERT_GT(points.size(), 1000u);
  const auto seen = visible_in_view(scene.query, scene.renderer.views().open(0, 0), points);
  const auto num_seen = std::count(seen.begin(), seen.end(), 1);
  EXPECT_GE(num_seen, static_cast<std::int64_t>(0.999 * static_cast<double>(points.size())));
  // A camera at one place sees many of them hidden or elsewhere.
  plan.cameras[0].shutter = {};
  const TracedPlan still(store, plan);
  const auto model_view = still.renderer.views().open(0, 0);
  double farthest_px = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto at_once = model_view.middle.project(points[i]);
    const auto rolling = seen_at(scene.plan, 0, *model, points[i]);
    if (at_once && rolling) farthest_px = std::max(farthest_px, (*at_once - *rolling).norm());
  }
  EXPECT_GT(farthest_px, 0.5);
}

TEST(Exposure, RaysComeAllAlongTheMotionAndThroughThePupil) {
  render::SequencePlan plan = test::small_plan(1, 40, 32);
  set_moving(plan.states);
  plan.cameras.resize(1);
  plan.cameras[0].shutter = {.exposure_s = 0.02, .line_time_s = 1e-4};
  const Vector2d pixel(7.25, 29.5);
  {
    const ViewTable views(plan.states, plan.cameras);
    const double line_s = 1e-4 * (29.5 - 16.0);
    for (const double share : {0.0, 0.25, 0.5, 0.999}) {
      const auto ray = views.open(0, 0).lens_ray(pixel, share, {0.3, -0.8});
      const Pose pose(plan, 0, line_s + 0.02 * (share - 0.5));
      EXPECT_LT((ray.origin_world - pose.center_world).norm(), 1e-10);
      const auto model = geo::make_camera(plan.cameras[0].intrinsics);
      EXPECT_LT((ray.direction_world -
                 (pose.world_from_camera * model->ray_from_pixel(pixel)).normalized())
                    .norm(),
                1e-12);
    }
  }
  // All rays through a lens that is focused at 25 m meet in one point at that depth.
  plan.cameras[0].shutter = {};
  plan.cameras[0].aperture = {.diameter_m = 0.05, .focus_m = 25.0};
  for (const double focus_m : {25.0, 0.0}) {
    plan.cameras[0].aperture.focus_m = focus_m;
    const ViewTable views(plan.states, plan.cameras);
    const Pose pose(plan, 0, 0.0);
    const auto model = geo::make_camera(plan.cameras[0].intrinsics);
    const Vector3d straight = pose.world_from_camera * model->ray_from_pixel(pixel);
    for (const Vector2d& at : {Vector2d(0, 0), Vector2d(1, 0), Vector2d(-0.6, 0.8)}) {
      const auto ray = views.open(0, 0).lens_ray(pixel, 0.5, at);
      EXPECT_NEAR((ray.origin_world - pose.center_world).norm(), 0.025 * at.norm(), 1e-9);
      if (focus_m == 0.0) {
        EXPECT_LT((ray.direction_world - straight.normalized()).norm(), 1e-12);
        continue;
      }
      const Vector3d focus = pose.center_world + focus_m * straight;
      const double along = (focus - ray.origin_world).dot(ray.direction_world);
      EXPECT_LT((ray.origin_world + along * ray.direction_world - focus).norm(), 1e-9);
    }
  }
}

TEST(Exposure, RaysStartWhereTheImagePointsDoAllAlongTheMotion) {
  render::SequencePlan plan = test::small_plan(1, 40, 32);
  set_moving(plan.states);
  plan.cameras.resize(1);
  const Vector2d pixel(7.25, 29.5);
  // 2 and 2.5 px a metre: (7.25 - 20) / 2 and (29.5 - 16) / 2.5 m.
  for (const auto& [model, start] :
       {std::pair{"orthographic", Vector3d(-6.375, 5.4, 0.0)}, {"pushbroom", {0.0, 5.4, 0.0}}}) {
    plan.cameras[0].intrinsics = {model, 40, 32, {2.0, 2.5, 20.0, 16.0}};
    plan.cameras[0].shutter = {.exposure_s = 0.02};
    const double line_s = std::string(model) == "orthographic" ? 1e-4 : 0.0;
    plan.cameras[0].shutter.line_time_s = line_s;
    const ViewTable views(plan.states, plan.cameras);
    EXPECT_TRUE(views.has_open_views());
    const Vector3d direction =
        std::string(model) == "orthographic" ? Vector3d(0, 0, 1) : Vector3d(-6.375, 0, 1);
    for (const double share : {0.0, 0.25, 0.999}) {
      const auto ray = views.open(0, 0).lens_ray(pixel, share, {0.3, -0.8});
      const Pose pose(plan, 0, line_s * 13.5 + 0.02 * (share - 0.5));
      EXPECT_LT((ray.origin_world - pose.center_world - pose.world_from_camera * start).norm(),
                1e-10);
      EXPECT_LT((ray.direction_world - (pose.world_from_camera * direction).normalized()).norm(),
                1e-12);
    }
    // Where rays start at the image's corners and middle.
    const std::vector<Vector3d> starts = views.at(0, 0).starts_world(2);
    EXPECT_EQ(starts.size(), line_s > 0.0 ? 9U : 3U);
    const Pose middle(plan, 0, 0.0);
    EXPECT_LT((starts[0] - middle.center_world -
               middle.world_from_camera * Vector3d(line_s > 0.0 ? -10.0 : 0.0, -6.4, 0.0))
                  .norm(),
              1e-10);
  }
}

TEST(SampleWidth, IsTheSideOfTheSamplesArea) {
  EXPECT_EQ(scene::SampleWidth{.angle_rad = 2e-3}.at(50.0), 0.1);
  // Parallel rays: as wide everywhere. A line scanner: 4 rows a metre, and 1e-3 rad across.
  const scene::SampleWidth parallel{.start_m = {0.5, 0.125}};
  const scene::SampleWidth scanner{.start_m = {0.0, 0.25}, .growth = {1e-3, 0.0}};
  for (const double t : {1.0, 1000.0}) {
    EXPECT_DOUBLE_EQ(parallel.at(t), 0.25);
    EXPECT_DOUBLE_EQ(scanner.at(t), std::sqrt(1e-3 * t * 0.25));
  }
}

TEST(Clearance, CountsWhereverRaysStart) {
  // A plane at 40 m, and parallel rays that start 20 m above and below a place 51 m up, and 40 m to both sides.
  Flight flight({"orthographic", 40, 20, {0.5, 0.5, 20.0, 10.0}}, {});
  const core::Context context{.log = core::Log("test", core::LogLevel::Off)};
  render::SequencePlan plan = flight.plan;
  plan.states.resize(1);
  plan.cameras[0].rig_from_camera.rotation = Eigen::Quaterniond(geo::rig_from_forward_camera());
  plan.cameras[0].body_from_rig = {};
  plan.states[0].world_from_body = {Eigen::Quaterniond::Identity(), {0.0, 0.0, kPlane_z + 11.0}};
  const auto render = [&] {
    render::run_render_stage(flight.store, plan, {}, {}, flight.folder / "P000", context);
  };
  test::expect_error(core::ErrorKind::Input, {"camera pair/left", "1.50 m under the ground"},
                     render);
  plan.states[0].world_from_body.translation = {0.0, 2030.0, kPlane_z + 100.0};
  test::expect_error(core::ErrorKind::Input, {"outside the world"}, render);
}

TEST(Exposure, AnImageIsTheMeanOfItsMoments) {
  const test::ScratchFolder folder;
  const world::TileStore store = test::make_hills(folder / "world");
  render::SequencePlan plan = test::small_plan(1, 48, 32);
  plan.cameras.resize(1);
  plan.conditions.color_samples = 64;
  plan.states[0].angular_velocity_body_radps = {0.0, 0.0, 2.0};
  plan.states[0].velocity_world_mps = {30.0, 0.0, 0.0};
  plan.cameras[0].shutter = {.exposure_s = 0.06};
  const TracedPlan blurred(store, plan);
  const core::Image8 image = blurred.renderer.color(0, 0);
  EXPECT_EQ(blurred.renderer.truth(0, 0).range_m, [&] {
    render::SequencePlan sharp = plan;
    sharp.cameras[0].shutter = {};
    return TracedPlan(store, sharp).renderer.truth(0, 0).range_m;
  }()) << "facts are of the exposure's middle";

  // Light adds up, images' numbers do not: what each number stands for.
  std::array<double, 256> light{};
  for (int value = 0; value < 256; ++value) {
    double low = 0.0, high = 64.0;
    for (int i = 0; i < 50; ++i) {
      const double middle = 0.5 * (low + high);
      (scene::srgb_from_linear(scene::film_curve(static_cast<float>(middle))) * 255.0f <
               static_cast<float>(value)
           ? low
           : high) = middle;
    }
    light[static_cast<std::size_t>(value)] = low;
  }
  constexpr int kMoments = 32;
  std::vector<double> sum(static_cast<std::size_t>(image.width() * image.height() * 3), 0.0);
  core::Image8 sharp;
  for (int k = 0; k < kMoments; ++k) {
    render::SequencePlan moment = plan;
    moment.cameras[0].shutter = {};
    moment.conditions.color_samples = 16;
    const double t = 0.06 * ((k + 0.5) / kMoments - 0.5);
    moment.states[0].world_from_body = plan.states[0].pose_after(t);
    const core::Image8 there = TracedPlan(store, moment).renderer.color(0, 0);
    if (k == kMoments / 2) sharp = there;
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += light[there.data()[i]] / kMoments;
  }
  double error = 0.0, change = 0.0;
  for (std::size_t i = 0; i < sum.size(); ++i) {
    error += std::abs(light[image.data()[i]] - sum[i]) / static_cast<double>(sum.size());
    change +=
        std::abs(light[image.data()[i]] - light[sharp.data()[i]]) / static_cast<double>(sum.size());
  }
  // Both are means of samples; a shutter of no time differs by many times that.
  EXPECT_LT(error, 0.2 * change);
}

TEST(Exposure, WhatMakesNoSenseIsRefused) {
  const test::ScratchFolder folder;
  const auto message_of = [&](const std::string& keys) -> std::string {
    std::ofstream(folder / "rig.toml")
        << "name = \"rig\"\n[[cameras]]\nname = \"cam\"\nwidth_px = 64\nheight_px = 48\n"
           "fx_px = 50.0\n"
        << keys;
    try {
      rigs::build_cameras({core::read_toml<rigs::RigOptions>(folder / "rig.toml")});
    } catch (const core::Error& error) {
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(message_of("exposure_ms = 10.0\nline_time_us = 30.0\nreadout = \"up\"\n"
                       "aperture_mm = 4.0\nfocus_m = 12.0\n"),
            "no error");
  EXPECT_NE(message_of("focus_m = 12.0\n").find("give aperture_mm"), std::string::npos);
  EXPECT_NE(message_of("readout = \"up\"\n").find("give line_time_us"), std::string::npos);
  EXPECT_NE(message_of("readout = \"sideways\"\n").find("down"), std::string::npos);
  EXPECT_NE(message_of("exposure_ms = -1.0\n").find("exposure_ms"), std::string::npos);
}

}  // namespace
}  // namespace terracast::sensors
