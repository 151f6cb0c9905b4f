#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "capture/channel.h"
#include "capture/labels.h"
#include "core/instance_id.h"
#include "render/moving_bodies.h"
#include "tests/render/plane_flight.h"
#include "tests/render/scene.h"
#include "tests/support/expect_error.h"
#include "world/tile_id.h"

namespace terracast::render {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using test::Flight;
using test::kPlane_z;
using test::Pose;
using test::RollingCase;
using test::Scene;
using test::time_of;

/// A box about its frame's origin.
MovingShape box_shape(const Vector3d& half_m) {
  world::Shape shape;
  const Eigen::Vector3i half = (half_m / world::kHeightStep_m).array().round().cast<int>();
  for (int corner = 0; corner < 8; ++corner)
    shape.vertices_steps.emplace_back((corner & 1) != 0 ? half.x() : -half.x(),
                                      (corner & 2) != 0 ? half.y() : -half.y(),
                                      (corner & 4) != 0 ? half.z() : -half.z());
  constexpr std::uint32_t kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                          {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& f : kFaces)
    for (const auto& corners : {std::array{f[0], f[1], f[2]}, std::array{f[0], f[2], f[3]}})
      shape.triangles.push_back({.corners = corners, .finish = 0});
  shape.finishes = {{.material = world::Material::Plain,
                     .semantic_class = core::SemanticClass::Car,
                     .color_srgb = {200, 40, 30}}};
  return {.thing = "box",
          .shown = std::make_shared<const world::PrototypeLibrary::Shown>(std::move(shape))};
}

const Vector3d kHalf_m(7.0, 5.0, 4.0);
const Vector3d kPartHalf_m(9.0, 1.0, 1.0);
const Vector3d kPartOrigin_m(2.0, 1.0, 6.5);  // above the box: they do not touch

/// A box that turns as it goes, with a bar that turns on it.
MovingThing turning_box(const SequencePlan& plan, const Vector3d& place_world) {
  MovingThing thing{.name = "box",
                    .shape = box_shape(kHalf_m),
                    .semantic_id = static_cast<std::uint32_t>(core::SemanticClass::Car),
                    .parts = {{.name = "bar1",
                               .shape = box_shape(kPartHalf_m),
                               .origin_m = kPartOrigin_m,
                               .axis = Vector3d(0.0, 0.6, 0.8),
                               .rate_radps = 30.0}},
                    .states = {},
                    .gone_m = {}};
  for (std::size_t frame = 0; frame < plan.states.size(); ++frame) {
    const double turn = 0.4 + 0.5 * static_cast<double>(frame);
    thing.states.push_back(geo::BodyState{
        .time_s = plan.states[frame].time_s,
        .world_from_body = {Eigen::Quaterniond(
                                Eigen::AngleAxisd(turn, Vector3d(0.2, -0.3, 1.0).normalized())),
                            place_world + static_cast<double>(frame) * Vector3d(3.0, -2.0, 1.5)},
        .velocity_world_mps = {25.0, -18.0, 9.0},
        .acceleration_world_mps2 = {-12.0, 6.0, 3.0},
        .angular_velocity_body_radps = {0.8, -0.6, 2.5}});
    thing.gone_m.push_back(0.0);
  }
  return thing;
}

/// A body's pose so much after a frame's time, by Rodrigues' formula.
struct BoxPose {
  Matrix3d world_from_box;
  Vector3d place_world;

  BoxPose(const geo::BodyState& state, double t)
      : world_from_box(state.world_from_body.rotation.toRotationMatrix()),
        place_world(state.world_from_body.translation + t * state.velocity_world_mps +
                    0.5 * t * t * state.acceleration_world_mps2) {
    if (t != 0.0)
      world_from_box = world_from_box * Pose::turned(t * state.angular_velocity_body_radps);
  }
  Vector3d box_from_world(const Vector3d& point) const {
    return world_from_box.transpose() * (point - place_world);
  }
  Vector3d world_from(const Vector3d& point_box) const {
    return place_world + world_from_box * point_box;
  }
};

/// Where a ray comes into a box, by its slabs, and through which side; nothing where it passes.
struct BoxHit {
  double t;
  Vector3d normal_world;
};
std::optional<BoxHit> meet_box(const BoxPose& pose, const Vector3d& half_m, const Vector3d& origin,
                               const Vector3d& direction) {
  const Vector3d o = pose.box_from_world(origin);
  const Vector3d d = pose.world_from_box.transpose() * direction;
  double in = -1e300, out = 1e300;
  int side = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (-half_m[axis] - o[axis]) / d[axis], b = (half_m[axis] - o[axis]) / d[axis];
    if (std::min(a, b) > in) side = axis;
    in = std::max(in, std::min(a, b));
    out = std::min(out, std::max(a, b));
  }
  if (!(in < out) || in <= 0.0) return std::nullopt;
  Vector3d normal = Vector3d::Zero();
  normal[side] = d[side] > 0.0 ? -1.0 : 1.0;
  return BoxHit{in, pose.world_from_box * normal};
}

/// The plane and both boxes, at a frame.
struct Truth {
  enum What { kNothing = -2, kPlane = -1, kBox = 0, kBar = 1 };
  struct Hit {
    double t = 1e300;
    int what = kNothing;
    Vector3d normal_world = Vector3d::UnitZ();
  };
  std::vector<std::optional<geo::BodyState>> states;

  Hit meet(double time_s, const Vector3d& origin, const Vector3d& direction,
           double grown_m = 0.0) const {
    Hit hit;
    const double t = (kPlane_z - origin.z()) / direction.z();
    if (t > 0.0) hit = {t, kPlane, Vector3d::UnitZ()};
    for (const int what : {kBox, kBar}) {
      const Vector3d half = (what == kBox ? kHalf_m : kPartHalf_m) + Vector3d::Constant(grown_m);
      const auto met = meet_box(BoxPose(*states[static_cast<std::size_t>(what)], time_s), half,
                                origin, direction);
      if (met && met->t < hit.t) hit = {met->t, what, met->normal_world};
    }
    return hit;
  }
};

/// Where and when a point that may move is seen, by halving the time.
struct Seen {
  Vector2d pixel;
  double time_s;
};
template <class PointAt>
std::optional<Seen> seen_at(const SequencePlan& plan, int frame, const geo::CameraModel& model,
                            const PointAt& point_at) {
  const geo::Shutter& shutter = plan.cameras[0].shutter;
  const auto pixel_at = [&](double t) { return Pose(plan, frame, t).project(model, point_at(t)); };
  if (!shutter.is_rolling()) {
    const auto pixel = pixel_at(0.0);
    if (!pixel) return std::nullopt;
    return Seen{*pixel, 0.0};
  }
  const auto miss = [&](double t) -> std::optional<double> {
    const auto pixel = pixel_at(t);
    if (!pixel) return std::nullopt;
    return time_of(shutter, model, *pixel) - t;
  };
  double low = -0.05, high = 0.05;
  if (!miss(low) || !miss(high) || *miss(low) < 0.0 || *miss(high) > 0.0) return std::nullopt;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    const auto there = miss(middle);
    if (!there) return std::nullopt;
    (*there > 0.0 ? low : high) = middle;
  }
  return Seen{*pixel_at(low), low};
}

class EachMovingView : public testing::TestWithParam<RollingCase> {};

TEST_P(EachMovingView, FactsFlowAndVisibilityOfWhatMovesAreThoseOfBoxes) {
  Flight flight(GetParam().intrinsics, GetParam().shutter);
  const auto model = geo::make_camera(GetParam().intrinsics);
  const geo::Shutter& shutter = GetParam().shutter;
  // In the middle of the first image.
  const Pose first(flight.plan, 0, 0.0);
  const Vector3d axis = first.world_from_camera *
                        model->ray_from_pixel({0.5 * model->width_px(), 0.5 * model->height_px()});
  // Wide lenses see it from near by.
  const double range_m = GetParam().intrinsics.parameters[0] < 25.0 ? 22.0 : 60.0;
  const Vector3d place = first.center_world + range_m * axis.normalized();
  flight.plan.moving = {turning_box(flight.plan, place)};
  const Scene scene(flight.store, flight.plan);
  const auto bodies = describe_moving(flight.plan.moving);
  ASSERT_EQ(bodies.size(), 2U);
  EXPECT_EQ(bodies[1].name, "box-bar1");
  EXPECT_EQ(bodies[1].first_triangle, 12U);

  const std::array<capture::CameraView, 2> views = {
      capture::view_of(*model, flight.plan.cameras[0], flight.plan.states[0]),
      capture::view_of(*model, flight.plan.cameras[0], flight.plan.states[1])};
  std::array<int, 2> num_met = {};
  int num_followed = 0, num_seen = 0, num_hidden = 0, num_shaded = 0;
  for (const int frame : {0, 1}) {
    const int other = 1 - frame;
    const Truth here{scene.renderer.moving().states(frame)};
    const Truth there{scene.renderer.moving().states(other)};
    const capture::BodyMotions motions(bodies, here.states, there.states);
    const TruthFrame truth = scene.renderer.truth(frame, 0);
    const core::ImageF flow_image =
        capture::flow_image(views[static_cast<std::size_t>(frame)],
                            views[static_cast<std::size_t>(other)], motions, truth.facts);
    const std::uint32_t visible = frame == 0 ? capture::kVisibleNext : capture::kVisiblePrevious;
    for (int y = 0; y < model->height_px(); ++y)
      for (int x = 0; x < model->width_px(); ++x) {
        const Vector2d pixel(x + 0.5, y + 0.5);
        const auto index = static_cast<std::size_t>(y * model->width_px() + x);
        const double time_s = time_of(shutter, *model, pixel);
        const Pose pose(flight.plan, frame, time_s);
        const Vector3d ray = pose.world_from_camera * model->ray_from_pixel(pixel).normalized();
        if (!ray.allFinite()) continue;
        const Truth::Hit hit = here.meet(time_s, pose.center_world, ray);
        // What a ray passes by less than a micrometre may fall to either side.
        if (here.meet(time_s, pose.center_world, ray, 1e-6).what != hit.what ||
            here.meet(time_s, pose.center_world, ray, -1e-6).what != hit.what)
          continue;
        const Vector3d point = pose.center_world + hit.t * ray;
        if (hit.what == Truth::kNothing || point.head<2>().cwiseAbs().maxCoeff() > 1900.0) continue;
        const bool is_moving = hit.what >= 0;
        ASSERT_NEAR(truth.range_m[index], hit.t, 1e-8 * hit.t) << x << " " << y;
        ASSERT_EQ(truth.facts.instance_id(x, y), is_moving ? core::kFirstMovingId : 0U);
        if (is_moving) {
          ++num_met[static_cast<std::size_t>(hit.what)];
          EXPECT_EQ(truth.facts.semantic_id(x, y),
                    static_cast<std::uint32_t>(core::SemanticClass::Car));
          const Vector3d normal(truth.facts.normal_world(x, y, 0),
                                truth.facts.normal_world(x, y, 1),
                                truth.facts.normal_world(x, y, 2));
          EXPECT_LT((normal - hit.normal_world).norm(), 1e-6);
          EXPECT_EQ((truth.facts.primitive_id(x, y) - capture::kObjectPrimitives) / 12,
                    static_cast<std::uint32_t>(hit.what));
        }
        // Where the same point is in the other image.
        const auto body = static_cast<std::size_t>(std::max(hit.what, 0));
        const Vector3d on_box = BoxPose(*here.states[body], time_s).box_from_world(point);
        const auto point_at = [&](double t) -> Vector3d {
          return is_moving ? BoxPose(*there.states[body], t).world_from(on_box) : point;
        };
        const auto expected = seen_at(flight.plan, other, *model, point_at);
        if (!expected) continue;
        const capture::BodyMotion* motion =
            motions.find(truth.facts.instance_id(x, y), truth.facts.primitive_id(x, y));
        ASSERT_EQ(motion != nullptr, is_moving);
        const auto& from = views[static_cast<std::size_t>(frame)];
        const auto& to = views[static_cast<std::size_t>(other)];
        const auto flow = is_moving ? capture::flow(from, to, *motion, pixel, hit.t)
                                    : capture::flow(from, to, pixel, hit.t);
        ASSERT_TRUE(flow);
        EXPECT_LT((pixel + *flow - expected->pixel).norm(), 1e-6);
        // Stored ranges are float32.
        EXPECT_NEAR(static_cast<double>(flow_image(x, y, 0)), flow->x(), 1e-3);
        EXPECT_NEAR(static_cast<double>(flow_image(x, y, 1)), flow->y(), 1e-3);
        num_followed += is_moving ? 1 : 0;
        // And back again.
        if (is_moving) {
          const capture::BodyMotion backward{.from = *motion->to, .to = motion->from};
          const Pose then(flight.plan, other, expected->time_s);
          const auto back = capture::flow(to, from, backward, expected->pixel,
                                          (point_at(expected->time_s) - then.center_world).norm());
          ASSERT_TRUE(back);
          EXPECT_LT((*flow + *back).norm(), 1e-6);
        }
        // Seen there: in the image, and nothing in the way.
        const Vector2d& at = expected->pixel;
        if (std::min({std::abs(at.x()), std::abs(at.y()), std::abs(at.x() - model->width_px()),
                      std::abs(at.y() - model->height_px())}) < 1e-3)
          continue;
        const Pose then(flight.plan, other, expected->time_s);
        const Vector3d to_point = point_at(expected->time_s) - then.center_world;
        const auto is_first = [&](double grown_m) {
          const Truth::Hit met = there.meet(expected->time_s, then.center_world, to_point, grown_m);
          return met.what == hit.what && std::abs(met.t - 1.0) < 1e-5;
        };
        if (is_first(1e-6) != is_first(-1e-6)) continue;
        const bool is_seen = model->contains(at) && is_first(0.0);
        ASSERT_EQ((truth.facts.flags(x, y) & visible) != 0, is_seen)
            << "pixel " << x << " " << y << " of frame " << frame;
        num_seen += is_moving && is_seen ? 1 : 0;
        num_hidden += model->contains(at) && !is_seen ? 1 : 0;
        num_shaded += !is_moving && model->contains(at) && !is_seen ? 1 : 0;
      }
  }
  EXPECT_GT(num_met[0], 20);
  EXPECT_GT(num_met[1], 3);
  EXPECT_GT(num_followed, 20);
  EXPECT_GT(num_seen, 10);
  EXPECT_GT(num_hidden, 0);
  EXPECT_GT(num_shaded, 0) << "of the plane, by what moves";
}

std::vector<RollingCase> global_and_rolling() {
  std::vector<RollingCase> cases;
  for (const RollingCase& rolling : test::rolling_cases()) {
    cases.push_back(rolling);
    cases.push_back({rolling.intrinsics, {}});
  }
  return cases;
}

INSTANTIATE_TEST_SUITE_P(Models, EachMovingView, testing::ValuesIn(global_and_rolling()),
                         [](const auto& example) {
                           return example.param.intrinsics.model +
                                  (example.param.shutter.is_rolling() ? "_rolling" : "_global");
                         });

TEST(MovingBodies, PartsTurnOnTheirThings) {
  const geo::BodyState thing{.time_s = 0.7,
                             .world_from_body = {Eigen::Quaterniond(Eigen::AngleAxisd(
                                                     0.8, Vector3d(1.0, 2.0, -0.5).normalized())),
                                                 {120.0, -40.0, 15.0}},
                             .velocity_world_mps = {8.0, 3.0, -1.0},
                             .acceleration_world_mps2 = {0.5, -0.25, 0.1},
                             .angular_velocity_body_radps = {0.0, 0.0, 0.3}};
  const TurningPart wheel{.name = "wheel1",
                          .shape = {},
                          .origin_m = {1.2, 0.7, 0.3},
                          .axis = Vector3d::UnitY(),
                          .per_metre_rad = 1.0 / 0.3};
  const double gone_m = 4.0;
  const geo::BodyState part = state_of_part(thing, wheel, gone_m);
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
  const geo::BodyState rolling = state_of_part(straight, wheel, 0.0);
  const Vector3d foot_world = thing.world_from_body.rotation * Vector3d(0.0, 0.0, -0.3);
  const Vector3d turning_world =
      rolling.world_from_body.rotation * rolling.angular_velocity_body_radps;
  EXPECT_LT((rolling.velocity_world_mps + turning_world.cross(foot_world)).norm(), 1e-12);
}

TEST(MovingBodies, SettleOnAPlaneThatLeans) {
  // z = 30 + x / 4 - y / 8, on the lattice of heights.
  const test::ScratchFolder folder;
  const auto ground = [](double x, double y) { return 30.0 + 0.25 * x - 0.125 * y; };
  const world::TileStore store =
      test::make_tiny_world(folder / "world", ground, {.finest_level = 3, .coarsest_level = 3});
  SequencePlan plan = test::small_plan(1, 16, 12);
  plan.states[0].world_from_body.translation.z() = 900.0;
  const Scene scene(store, plan);
  const geo::WorldFrame frame(store.manifest().origin);
  geo::BodyState wanted;
  wanted.world_from_body = {Eigen::Quaterniond(Eigen::AngleAxisd(0.6, Vector3d::UnitZ())),
                            {40.0, 25.0, 500.0}};
  wanted.velocity_world_mps = wanted.world_from_body.rotation * Vector3d(10.0, 0.0, 0.0);
  const geo::BodyState state = settle(wanted, Ride::Ground, 4.4, 1.8, scene.query, frame);
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
  wanted.world_from_body.translation.x() = 9000.0;
  EXPECT_THROW(settle(wanted, Ride::Ground, 4.4, 1.8, scene.query, frame), core::Error);
}

TEST(MovingBodies, RideWhatIsThere) {
  // Land in the west, and in the east a lake of the same level.
  const test::ScratchFolder folder;
  const world::TileStore store = test::make_wet_world(
      folder / "world", [](double, double) { return 30.0; },
      [](double x, double) { return x > 0.0 ? 3.0 : 0.0; },
      {.finest_level = 3, .coarsest_level = 3});
  SequencePlan plan = test::small_plan(1, 16, 12);
  plan.states[0].world_from_body.translation.z() = 900.0;
  const Scene scene(store, plan);
  const geo::WorldFrame frame(store.manifest().origin);
  geo::BodyState wanted;
  wanted.world_from_body = {Eigen::Quaterniond(Eigen::AngleAxisd(0.6, Vector3d::UnitZ())) *
                                Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Vector3d::UnitX())),
                            {120.0, 25.0, 500.0}};
  // Water is level whatever is wanted.
  const geo::BodyState afloat = settle(wanted, Ride::Water, 4.4, 1.8, scene.query, frame);
  const Vector3d& place = afloat.world_from_body.translation;
  EXPECT_LT((afloat.world_from_body.rotation * Vector3d::UnitZ() - frame.up_world(place)).norm(),
            1e-8)
      << "up is that of the place that was wanted, 470 m higher";
  EXPECT_NEAR(place.z(), 30.0, 1e-9);
  test::expect_error(core::ErrorKind::Input, {"it rides the ground", "there is water"},
                     [&] { settle(wanted, Ride::Ground, 4.4, 1.8, scene.query, frame); });
  wanted.world_from_body.translation.x() = -120.0;
  EXPECT_NEAR(
      settle(wanted, Ride::Ground, 4.4, 1.8, scene.query, frame).world_from_body.translation.z(),
      30.0, 1e-4);
  test::expect_error(core::ErrorKind::Input, {"it rides the water", "there is ground"},
                     [&] { settle(wanted, Ride::Water, 4.4, 1.8, scene.query, frame); });
}

TEST(MovingBodies, WhatMovesCastsShadowsAndIsBlurred) {
  Flight flight({"pinhole", 64, 48, {60, 60, 32, 24}}, {});
  // It looks to the east, where the sun stands: shadows fall towards it.
  flight.plan.states[0].world_from_body.translation.z() = kPlane_z + 35.0;
  flight.plan.conditions.sun_azimuth_deg = 90.0;
  flight.plan.conditions.sun_elevation_deg = 45.0;
  flight.plan.conditions.color_samples = 16;
  const Scene still(flight.store, flight.plan);
  const core::Image8 without = still.renderer.color(0, 0);
  const Pose pose(flight.plan, 0, 0.0);
  const Vector3d axis = pose.world_from_camera.col(2);
  const Vector3d place =
      pose.center_world + (kPlane_z + 14.0 - pose.center_world.z()) / axis.z() * axis;
  flight.plan.moving = {turning_box(flight.plan, place)};
  flight.plan.moving[0].parts.clear();
  const Vector3d kRoof_m(16.0, 12.0, 2.0);
  flight.plan.moving[0].shape = box_shape(kRoof_m);
  const Scene moving(flight.store, flight.plan);
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
  const Scene open(flight.store, flight.plan);
  const core::Image8 blurred = open.renderer.color(0, 0);
  double worst = 0.0, spread = 0.0;
  std::vector<double> mean(64 * 48, 0.0);
  constexpr int kMoments = 32;
  for (int k = 0; k < kMoments; ++k) {
    SequencePlan moment = flight.plan;
    moment.cameras[0].shutter = {};
    const double t = ((k + 0.5) / kMoments - 0.5) * 0.16;
    moment.states[0].world_from_body = flight.plan.states[0].pose_after(t);
    moment.moving[0].states[0]->world_from_body = flight.plan.moving[0].states[0]->pose_after(t);
    const core::Image8 image = Scene(flight.store, moment).renderer.color(0, 0);
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
  EXPECT_GT(spread, 60.0) << "nothing is blurred";
}

}  // namespace
}  // namespace terracast::render
