#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "capture/channel.h"
#include "capture/labels.h"
#include "core/instance_id.h"
#include "render/checked_plan.h"
#include "scene/moving/moving_bodies.h"
#include "tests/sensors/moving_boxes.h"
#include "tests/sensors/plane_flight.h"
#include "tests/support/expect_error.h"
#include "tests/support/hills_flight.h"
#include "world/tile_id.h"

namespace terracast::sensors {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using test::box_shape;
using test::BoxPose;
using test::Flight;
using test::kPlane_z;
using test::meet_box;
using test::Pose;
using test::TracedPlan;
using test::Truth;
using test::turning_box;

TEST(MovingBodies, PartsTurnOnTheirThings) {
  const geo::BodyState thing{.time_s = 0.7,
                             .world_from_body = {Eigen::Quaterniond(Eigen::AngleAxisd(
                                                     0.8, Vector3d(1.0, 2.0, -0.5).normalized())),
                                                 {120.0, -40.0, 15.0}},
                             .velocity_world_mps = {8.0, 3.0, -1.0},
                             .acceleration_world_mps2 = {0.5, -0.25, 0.1},
                             .angular_velocity_body_radps = {0.0, 0.0, 0.3}};
  const scene::TurningPart wheel{.name = "wheel1",
                                 .shape = {},
                                 .origin_m = {1.2, 0.7, 0.3},
                                 .axis = Vector3d::UnitY(),
                                 .per_metre_rad = 1.0 / 0.3};
  const double gone_m = 4.0;
  const geo::BodyState part = scene::state_of_part(thing, wheel, gone_m);
  // The thing's own pose, and on it the wheel, turned by the way over its radius.
  const Eigen::AngleAxisd turned(gone_m / 0.3, Vector3d::UnitY());
  EXPECT_LT((part.world_from_body.translation - thing.world_from_body * wheel.origin_m).norm(),
            1e-12);
  EXPECT_LT((part.world_from_body.rotation.toRotationMatrix() -
             thing.world_from_body.rotation.toRotationMatrix() * turned.toRotationMatrix())
                .norm(),
            1e-12);
  // A little later both have gone on together. Without angular acceleration what is left of second order is the
  // turning of the wheel's axis: half the product of two turnings, 0.3 rad/s and 27 rad/s, times t^2.
  const double t = 1e-4;
  const double forward_mps =
      (thing.world_from_body.rotation * Vector3d::UnitX()).dot(thing.velocity_world_mps);
  const geo::Rigid3d moved = thing.pose_after(t);
  const Eigen::AngleAxisd rolled(gone_m / 0.3 + forward_mps * t / 0.3, Vector3d::UnitY());
  const geo::Rigid3d then = part.pose_after(t);
  EXPECT_LT((then.translation - moved * wheel.origin_m).norm(), 1e-12);
  EXPECT_LT((then.rotation.toRotationMatrix() -
             moved.rotation.toRotationMatrix() * rolled.toRotationMatrix())
                .norm(),
            0.3 * (forward_mps / 0.3) * t * t);
  // A wheel that rolls has its lowest point at rest on the road: forward speed and the turning cancel.
  geo::BodyState straight = thing;
  straight.angular_velocity_body_radps.setZero();
  straight.velocity_world_mps = thing.world_from_body.rotation * Vector3d(6.0, 0.0, 0.0);
  const geo::BodyState rolling = scene::state_of_part(straight, wheel, 0.0);
  const Vector3d foot_world = thing.world_from_body.rotation * Vector3d(0.0, 0.0, -0.3);
  const Vector3d turning_world =
      rolling.world_from_body.rotation * rolling.angular_velocity_body_radps;
  EXPECT_LT((rolling.velocity_world_mps + turning_world.cross(foot_world)).norm(), 1e-12);
}

// A thing in closed form that swings about three axes; a rotor and a wheel on it, over 30 ms.
TEST(MovingBodies, PartsFollowTheTermsOfTheirThings) {
  constexpr double kReach_s = 0.015;
  const auto pose_at = [](double t) -> geo::Rigid3d {
    const double w = 2.0 * std::numbers::pi * 1.5;
    const Eigen::AngleAxisd roll(0.1 * std::sin(w * t + 0.3), Vector3d::UnitX());
    const Eigen::AngleAxisd pitch(0.08 * std::cos(w * t), Vector3d::UnitY());
    return {Eigen::Quaterniond(roll * pitch),
            Vector3d(8.0 * t + 0.4 * std::sin(w * t), 0.2 * std::cos(w * t), 3.0)};
  };
  // First derivatives by differences: good to 1e-10, and the rest goes into the terms.
  geo::BodyState thing{.time_s = 0.7, .world_from_body = pose_at(0.0)};
  const double h = 1e-3;
  const auto at = [&](double t) { return pose_at(t).translation; };
  const auto turn = [&](double t) {
    return geo::rotation_vector_of(pose_at(0.0).rotation.conjugate() * pose_at(t).rotation);
  };
  const auto slope = [&](const auto& value) -> Vector3d {
    return (8.0 * (value(h) - value(-h)) - (value(2 * h) - value(-2 * h))) / (12.0 * h);
  };
  thing.velocity_world_mps = slope(at);
  thing.acceleration_world_mps2 =
      (16.0 * (at(h) + at(-h)) - (at(2 * h) + at(-2 * h)) - 30.0 * at(0.0)) / (12.0 * h * h);
  thing.angular_velocity_body_radps = slope(turn);
  thing.terms = geo::fit_terms(thing, pose_at, kReach_s);
  const double gone_m = 4.0;
  const scene::TurningPart rotor{.name = "rotor1",
                                 .shape = {},
                                 .origin_m = {0.2, 0.3, 0.1},
                                 .axis = Vector3d::UnitZ(),
                                 .rate_radps = 500.0};
  const scene::TurningPart wheel{.name = "wheel1",
                                 .shape = {},
                                 .origin_m = {1.2, 0.7, 0.3},
                                 .axis = Vector3d::UnitY(),
                                 .per_metre_rad = 1.0 / 0.3};
  // A leg that swings: its angle goes as asin(0.97 sin(phase)), in a phase of its own.
  const scene::TurningPart leg{.name = "leg1",
                               .shape = {},
                               .origin_m = {0.0, 0.1, 0.9},
                               .axis = Vector3d::UnitY(),
                               .per_metre_rad = 0.7,
                               .swing_rad = 0.4,
                               .phase_rad = 0.5};
  // At the very end of its swing, where it changes the fastest.
  scene::TurningPart at_end = leg;
  at_end.phase_rad = 0.5 * std::numbers::pi - leg.per_metre_rad * gone_m;
  for (const scene::TurningPart& part : {rotor, wheel, leg, at_end}) {
    const geo::BodyState state = scene::state_of_part(thing, part, gone_m);
    const bool is_at_end = part.phase_rad == at_end.phase_rad;
    EXPECT_LT(state.terms.error_rad, is_at_end ? 2e-5 : 1e-6) << part.name;
    const double allowed_rad = is_at_end ? state.terms.error_rad : 1e-7;
    double forward_m = 0.0;  // since the frame's time, by the midpoint rule
    constexpr int kSteps = 3000;
    for (int side : {-1, 1}) {
      forward_m = 0.0;
      for (int i = 1; i <= kSteps; ++i) {
        const double step_s = side * kReach_s / kSteps;
        const double t = i * step_s;
        const geo::Rigid3d middle = pose_at(t - 0.5 * step_s);
        forward_m += (middle.rotation * Vector3d::UnitX()).dot(at(t) - at(t - step_s));
        if (i % 100 != 0) continue;
        const double phase_rad = part.phase_rad + part.rate_radps * (thing.time_s + t) +
                                 part.per_metre_rad * (gone_m + forward_m);
        const double angle_rad =
            part.swing_rad > 0.0
                ? part.swing_rad * std::asin(0.97 * std::sin(phase_rad)) / std::asin(0.97)
                : phase_rad;
        const Eigen::Quaterniond rotation =
            pose_at(t).rotation * Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, part.axis));
        const geo::Rigid3d stated = state.pose_after(t);
        ASSERT_LT(geo::rotation_vector_of(rotation.conjugate() * stated.rotation).norm(),
                  allowed_rad)
            << part.name << ' ' << t;
        ASSERT_LT((stated.translation - pose_at(t) * part.origin_m).norm(), 1e-7)
            << part.name << ' ' << t;
      }
    }
  }
}

// Of a swing, its rate is the derivative of its angle, and its ends are those that are stated.
TEST(MovingBodies, PartsSwingToAndFro) {
  const scene::TurningPart arm{.name = "arm1",
                               .shape = {},
                               .axis = Vector3d::UnitY(),
                               .rate_radps = 0.5,
                               .per_metre_rad = 4.0,
                               .swing_rad = 0.4,
                               .phase_rad = 0.3};
  constexpr double kForward_mps = 1.3, kStep_s = 1e-5;
  double least = 1.0, most = -1.0;
  for (double time_s = 0.0; time_s < 3.0; time_s += 0.0037) {
    const auto at = [&](double t) {
      return scene::turn_of_part(arm, t, kForward_mps * t, kForward_mps);
    };
    const scene::PartTurn turn = at(time_s);
    EXPECT_NEAR((at(time_s + kStep_s).angle_rad - at(time_s - kStep_s).angle_rad) / (2.0 * kStep_s),
                turn.rate_radps, 1e-6);
    least = std::min(least, turn.angle_rad);
    most = std::max(most, turn.angle_rad);
  }
  EXPECT_NEAR(most, 0.4, 1e-3);
  EXPECT_NEAR(least, -0.4, 1e-3);
}

TEST(MovingBodies, SettleOnAPlaneThatLeans) {
  // z = 30 + x / 4 - y / 8, on the lattice of heights.
  const test::ScratchFolder folder;
  const auto ground = [](double x, double y) { return 30.0 + 0.25 * x - 0.125 * y; };
  const world::TileStore store =
      test::make_tiny_world(folder / "world", ground, {.finest_level = 3, .coarsest_level = 3});
  render::SequencePlan plan = test::small_plan(1, 16, 12);
  plan.states[0].world_from_body.translation.z() = 900.0;
  const TracedPlan scene(store, plan);
  const geo::WorldFrame frame(store.manifest().origin);
  geo::BodyState wanted;
  wanted.world_from_body = {Eigen::Quaterniond(Eigen::AngleAxisd(0.6, Vector3d::UnitZ())),
                            {40.0, 25.0, 500.0}};
  wanted.velocity_world_mps = wanted.world_from_body.rotation * Vector3d(10.0, 0.0, 0.0);
  const geo::BodyState state =
      scene::settle(wanted, scene::Ride::Ground, 4.4, 1.8, scene.query, frame);
  const Vector3d& place = state.world_from_body.translation;
  EXPECT_NEAR(place.x(), 40.0, 1e-12);
  EXPECT_NEAR(place.y(), 25.0, 1e-12);
  // The mean of four corners about it, to roundings of the level directions of the ellipsoid there (1e-5 rad).
  EXPECT_NEAR(place.z(), ground(40.0, 25.0), 1e-4);
  const Vector3d normal = Vector3d(-0.25, 0.125, 1.0).normalized();
  EXPECT_LT((state.world_from_body.rotation * Vector3d::UnitZ() - normal).norm(), 1e-6);
  // It looks ahead and climbs as the plane does.
  const Vector3d ahead = state.world_from_body.rotation * Vector3d::UnitX();
  EXPECT_NEAR(std::atan2(ahead.y(), ahead.x()), 0.6, 0.05);
  EXPECT_NEAR(state.velocity_world_mps.z(),
              0.25 * wanted.velocity_world_mps.x() - 0.125 * wanted.velocity_world_mps.y(), 1e-6);
  EXPECT_LT(state.angular_velocity_body_radps.norm(), 1e-6);
  // People stand upright on their feet, and climb as the plane does.
  const geo::BodyState person =
      scene::settle(wanted, scene::Ride::Ground, 0.0, 0.0, scene.query, frame);
  EXPECT_NEAR(person.world_from_body.translation.z(), ground(40.0, 25.0), 1e-6);
  EXPECT_LT((person.world_from_body.rotation * Vector3d::UnitZ() -
             frame.up_world(wanted.world_from_body.translation))
                .norm(),
            1e-12);
  EXPECT_NEAR(person.velocity_world_mps.z(), state.velocity_world_mps.z(), 1e-6);
  scene::MovingThing walker{.name = "walker",
                            .shape = box_shape({0.25, 0.25, 0.875}),
                            .semantic_id = static_cast<std::uint32_t>(core::SemanticClass::Person),
                            .ride = scene::Ride::Ground,
                            .parts = {},
                            .states = {wanted},
                            .gone_m = {0.0}};
  const scene::MovingBodies bodies(std::array{walker}, scene.query, frame);
  EXPECT_LT(bodies.states(0).at(0)->world_from_body.rotation.angularDistance(
                person.world_from_body.rotation),
            1e-12);
  wanted.world_from_body.translation.x() = 9000.0;
  EXPECT_THROW(scene::settle(wanted, scene::Ride::Ground, 4.4, 1.8, scene.query, frame),
               core::Error);
}

TEST(MovingBodies, RideWhatIsThere) {
  // Land in the west, and in the east a lake of the same level.
  const test::ScratchFolder folder;
  const world::TileStore store = test::make_wet_world(
      folder / "world", [](double, double) { return 30.0; },
      [](double x, double) { return x > 0.0 ? 3.0 : 0.0; },
      {.finest_level = 3, .coarsest_level = 3});
  render::SequencePlan plan = test::small_plan(1, 16, 12);
  plan.states[0].world_from_body.translation.z() = 900.0;
  const TracedPlan scene(store, plan);
  const geo::WorldFrame frame(store.manifest().origin);
  geo::BodyState wanted;
  wanted.world_from_body = {Eigen::Quaterniond(Eigen::AngleAxisd(0.6, Vector3d::UnitZ())) *
                                Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Vector3d::UnitX())),
                            {120.0, 25.0, 500.0}};
  // Water is level whatever is wanted.
  const geo::BodyState afloat =
      scene::settle(wanted, scene::Ride::Water, 4.4, 1.8, scene.query, frame);
  const Vector3d& place = afloat.world_from_body.translation;
  EXPECT_LT((afloat.world_from_body.rotation * Vector3d::UnitZ() - frame.up_world(place)).norm(),
            1e-8)
      << "up is that of the place that was wanted, 470 m higher";
  EXPECT_NEAR(place.z(), 30.0, 1e-9);
  test::expect_error(core::ErrorKind::Input, {"it rides the ground", "there is water"}, [&] {
    scene::settle(wanted, scene::Ride::Ground, 4.4, 1.8, scene.query, frame);
  });
  wanted.world_from_body.translation.x() = -120.0;
  EXPECT_NEAR(scene::settle(wanted, scene::Ride::Ground, 4.4, 1.8, scene.query, frame)
                  .world_from_body.translation.z(),
              30.0, 1e-4);
  test::expect_error(core::ErrorKind::Input, {"it rides the water", "there is ground"}, [&] {
    scene::settle(wanted, scene::Ride::Water, 4.4, 1.8, scene.query, frame);
  });
  // The same of a sequence, before any is rendered.
  plan.moving = {{.name = "boat",
                  .shape = box_shape({2.0, 1.0, 1.0}),
                  .ride = scene::Ride::Water,
                  .parts = {},
                  .states = {wanted},
                  .gone_m = {0.0}}};
  test::expect_error(core::ErrorKind::Input, {"boat at frame 0", "there is ground"},
                     [&] { render::check_rides(plan, store, {}); });
  plan.moving[0].ride = scene::Ride::Ground;
  EXPECT_NO_THROW(render::check_rides(plan, store, {}));
}

TEST(MovingBodies, RideTheGeometryThatAllSequencesShow) {
  // A pond between the samples of the coarse tiles that a camera high above asks for, and in the fine ones of another.
  const Vector3d kPond(80.0, 16.0, 30.0);
  const test::ScratchFolder folder;
  const world::TileStore store = test::make_wet_world(
      folder / "world", [](double, double) { return 30.0; },
      [&](double x, double y) {
        return (Vector2d(x, y) - kPond.head<2>()).norm() < 9.0 ? 3.0 : 0.0;
      },
      {.finest_level = 1, .coarsest_level = 5, .refine = [&](const world::TileId& id) {
         const Vector2d low = id.corner_world(), high = low.array() + id.side_m();
         const Vector2d pond = kPond.head<2>();
         return (pond - pond.cwiseMax(low).cwiseMin(high)).norm() < 100.0;
       }});
  render::SequencePlan plan = test::small_plan(1, 16, 12);
  plan.states[0].world_from_body.translation.z() = 3000.0;
  geo::BodyState at_pond;
  at_pond.world_from_body.translation = kPond;
  plan.moving = {{.name = "boat",
                  .shape = box_shape({2.0, 1.0, 1.0}),
                  .ride = scene::Ride::Water,
                  .parts = {},
                  .states = {at_pond},
                  .gone_m = {0.0}}};
  render::SequencePlan shared = plan;
  shared.shared_viewpoints =
      std::make_shared<std::vector<world::Viewpoint>>(std::vector<world::Viewpoint>{
          {.position_world = kPond + Vector3d(0.0, 0.0, 20.0), .pixels_per_radian = 100.0}});
  test::expect_error(core::ErrorKind::Input, {"boat at frame 0", "there is ground"},
                     [&] { render::check_rides(plan, store, {}); });
  EXPECT_NO_THROW(render::check_rides(shared, store, {}));
  for (render::SequencePlan* one : {&plan, &shared}) one->moving[0].ride = scene::Ride::Ground;
  EXPECT_NO_THROW(render::check_rides(plan, store, {}));
  test::expect_error(core::ErrorKind::Input, {"boat at frame 0", "there is water"},
                     [&] { render::check_rides(shared, store, {}); });
}

TEST(MovingBodies, WhatMovesCastsShadowsAndIsBlurred) {
  Flight flight({"pinhole", 64, 48, {60, 60, 32, 24}}, {});
  // It looks to the east, where the sun stands: shadows fall towards it.
  flight.plan.states[0].world_from_body.translation.z() = kPlane_z + 35.0;
  flight.plan.conditions.sun_azimuth_deg = 90.0;
  flight.plan.conditions.sun_elevation_deg = 45.0;
  flight.plan.conditions.color_samples = 16;
  const TracedPlan still(flight.store, flight.plan);
  const core::Image8 without = still.renderer.color(0, 0);
  const Pose pose(flight.plan, 0, 0.0);
  const Vector3d axis = pose.world_from_camera.col(2);
  const Vector3d place =
      pose.center_world + (kPlane_z + 14.0 - pose.center_world.z()) / axis.z() * axis;
  flight.plan.moving = {turning_box(flight.plan, place)};
  flight.plan.moving[0].parts.clear();
  const Vector3d kRoof_m(16.0, 12.0, 2.0);
  flight.plan.moving[0].shape = box_shape(kRoof_m);
  const TracedPlan moving(flight.store, flight.plan);
  const core::Image8 with = moving.renderer.color(0, 0);
  const TruthFrame truth = moving.renderer.truth(0, 0);
  const Truth boxes{moving.renderer.moving().states(0)};
  const Vector3d sun = moving.renderer.sky().daylight().sun_direction_world;
  const auto linear = [](std::uint8_t value) { return std::pow(value / 255.0, 2.2); };
  double light_with = 0.0, light_without = 0.0;
  int num_shaded = 0, num_lit = 0;
  for (int y = 1; y < 47; ++y)
    for (int x = 1; x < 63; ++x) {
      bool shows_box = false;
      for (int j = y - 1; j <= y + 1; ++j)
        for (int i = x - 1; i <= x + 1; ++i) shows_box |= truth.facts.instance_id(i, j) != 0;
      if (shows_box) continue;
      const auto index = static_cast<std::size_t>(y * 64 + x);
      const Vector3d point = truth.point_world[index] + Vector3d(0.0, 0.0, 1e-3);
      const auto hides = [&](double grown_m) {
        return meet_box(BoxPose(*boxes.states[0], 0.0), kRoof_m + Vector3d::Constant(grown_m),
                        point, sun)
            .has_value();
      };
      // Clear of the border of the shadow by a metre, more than a pixel and half the sun's disc.
      if (hides(-1.0)) {
        ++num_shaded;
        EXPECT_LE(with(x, y, 1), without(x, y, 1)) << x << " " << y;
        light_with += linear(with(x, y, 1));
        light_without += linear(without(x, y, 1));
      } else if (!hides(1.5)) {
        ++num_lit;
        EXPECT_EQ(with(x, y, 1), without(x, y, 1)) << x << " " << y;
      }
    }
  EXPECT_GT(num_shaded, 30);
  EXPECT_GT(num_lit, 300);
  // In clear air the sun gives ground well over half of its light.
  EXPECT_LT(light_with, 0.5 * light_without);

  // Blurred, it is what 32 images of moments come to.
  flight.plan.cameras[0].shutter.exposure_s = 0.16;
  flight.plan.conditions.color_samples = 64;
  const TracedPlan open(flight.store, flight.plan);
  const core::Image8 blurred = open.renderer.color(0, 0);
  double worst = 0.0, spread = 0.0;
  std::vector<double> mean(64 * 48, 0.0);
  constexpr int kMoments = 32;
  for (int k = 0; k < kMoments; ++k) {
    render::SequencePlan moment = flight.plan;
    moment.cameras[0].shutter = {};
    const double t = ((k + 0.5) / kMoments - 0.5) * 0.16;
    moment.states[0].world_from_body = flight.plan.states[0].pose_after(t);
    moment.moving[0].states[0]->world_from_body = flight.plan.moving[0].states[0]->pose_after(t);
    const core::Image8 image = TracedPlan(flight.store, moment).renderer.color(0, 0);
    for (int y = 0; y < 48; ++y)
      for (int x = 0; x < 64; ++x)
        mean[static_cast<std::size_t>(y * 64 + x)] += linear(image(x, y, 1)) / kMoments;
  }
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) {
      const double expected =
          255.0 * std::pow(mean[static_cast<std::size_t>(y * 64 + x)], 1.0 / 2.2);
      worst = std::max(worst, std::abs(blurred(x, y, 1) - expected));
      spread = std::max(spread, static_cast<double>(std::abs(with(x, y, 1) - blurred(x, y, 1))));
    }
  // 64 samples of a pixel, of which an edge takes some share: an eighth of the range it spans at the worst.
  EXPECT_LT(worst, 24.0);
  EXPECT_GT(spread, 48.0) << "nothing is blurred";  // twice what samples alone may do
}

}  // namespace
}  // namespace terracast::sensors
