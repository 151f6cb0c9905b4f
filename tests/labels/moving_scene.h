#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/instance_id.h"
#include "geo/frames.h"
#include "tests/labels/boxes_world.h"
#include "tests/labels/pose.h"
#include "tests/support/test_data.h"

/// Things that move before two cameras, known by slabs and bisection: one with a bar that turns on it passes behind a wall,
/// another before a tower, one leaves the image, one is gone in the next frame. A camera that moves sees them with all
/// lines at once, and another with one after the other.
namespace terracast::test::moving_scene {

using Eigen::Vector2d;
using Eigen::Vector3d;

inline constexpr int kWidth = 200, kHeight = 160;
inline constexpr double kLineTime_s = 2e-4;

inline const std::vector<WorldBox> kStill = {
    {.instance_id = 11,
     .semantic_class = core::SemanticClass::Wall,
     .low = {100, -5, 40},
     .high = {110, 5, 60}},
    {.instance_id = 12, .low = {180, -60, 30}, .high = {200, -10, 70}},
};
inline constexpr std::uint32_t kVan = core::kFirstMovingId, kCart = kVan + 1, kTruck = kVan + 2,
                               kGone = kVan + 3;

struct Body {
  std::uint32_t instance_id;
  Vector3d low, high;
};
/// In the order of the sequence: the van has a bar.
inline const std::vector<Body> kBodies = {
    {kVan, {-6.0, -3.0, 0.0}, {8.0, 3.0, 5.0}},   {kVan, {-5.0, -0.5, -0.25}, {5.0, 0.5, 0.25}},
    {kCart, {-2.0, -1.0, -1.0}, {2.0, 1.0, 1.5}}, {kTruck, {-4.0, -3.0, -2.0}, {4.0, 3.0, 2.0}},
    {kGone, {-2.0, -2.0, -2.0}, {2.0, 2.0, 2.0}},
};
inline const Vector3d kBarOrigin(1.0, 0.5, 6.0);

inline geo::BodyState state_of(int frame, const Vector3d& place, double turn_rad,
                               const Vector3d& velocity, const Vector3d& turning) {
  geo::BodyState state;
  state.time_s = 0.1 * frame;
  state.world_from_body = {
      Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, Vector3d(0.1, -0.2, 1.0).normalized())),
      place};
  state.velocity_world_mps = velocity;
  state.acceleration_world_mps2 = {4.0, -6.0, 2.0};
  state.angular_velocity_body_radps = turning;
  return state;
}

inline std::vector<render::MovingThing> moving_things() {
  const auto thing = [](const char* name, std::size_t body, core::SemanticClass semantic_class) {
    return render::MovingThing{
        .name = name,
        .shape = moving_box(kBodies[body].low, kBodies[body].high, semantic_class),
        .semantic_id = static_cast<std::uint32_t>(semantic_class),
        .parts = {},
        .states = {},
        .gone_m = {0.0, 0.0}};
  };
  std::vector<render::MovingThing> things = {
      thing("van", 0, core::SemanticClass::Van), thing("cart", 2, core::SemanticClass::Car),
      thing("truck", 3, core::SemanticClass::Truck), thing("gone", 4, core::SemanticClass::Drone)};
  things[0].parts = {
      {.name = "bar",
       .shape = moving_box(kBodies[1].low, kBodies[1].high, core::SemanticClass::Van),
       .origin_m = kBarOrigin,
       .axis = Vector3d::UnitZ(),
       .rate_radps = 20.0}};
  for (int frame = 0; frame < 2; ++frame) {
    things[0].states.push_back(state_of(frame, Vector3d(150.0, 8.0 - 3.0 * frame, 46.0),
                                        0.5 + 0.2 * frame, {5.0, -40.0, 3.0}, {0.2, 0.1, 1.5}));
    things[1].states.push_back(state_of(frame, Vector3d(60.0, -9.0 - 2.0 * frame, 51.0),
                                        1.0 + 0.3 * frame, {-10.0, -20.0, 1.0}, {0.0, 0.5, 2.0}));
    things[2].states.push_back(state_of(frame, Vector3d(80.0, -41.0 + 2.0 * frame, 55.0),
                                        -0.4 + 0.1 * frame, {3.0, 15.0, 0.0}, {0.3, 0.0, -1.0}));
  }
  things[3].states = {state_of(0, {70.0, 20.0, 52.0}, 0.3, {5.0, 5.0, 0.0}, {0.0, 0.0, 0.5}),
                      std::nullopt};
  return things;
}

/// Two frames by two cameras of one rig, the second of which reads out line by line.
inline render::SequencePlan plan_of(const std::vector<render::MovingThing>& things) {
  render::SequencePlan plan = level_plan(2);
  for (std::size_t i = 0; i < 2; ++i) {
    geo::BodyState& state = plan.states[i];
    state.world_from_body.translation = Vector3d(0.5 * double(i), 0.3, 50.0);
    state.world_from_body.rotation = Eigen::AngleAxisd(0.02 * double(i), Vector3d::UnitZ());
    state.velocity_world_mps = {12.0, 3.0, -2.0};
    state.acceleration_world_mps2 = {0.0, 5.0, 1.0};
    state.angular_velocity_body_radps = {0.1, -0.2, 0.4};
  }
  plan.cameras.push_back(plan.cameras[0]);
  plan.cameras[1].name = "cam1";
  plan.cameras[1].shutter = {.line_time_s = kLineTime_s};
  plan.moving = things;
  return plan;
}

/// What a sequence shows, known by closed forms.
struct Truth {
  const capture::SequenceReader& sequence;

  static double time_of(int camera, double y) {
    return camera == 0 ? 0.0 : kLineTime_s * (y - 0.5 * kHeight);
  }
  Pose camera_pose(int frame, double t) const {
    const capture::FrameRecord& record = sequence.frames()[static_cast<std::size_t>(frame)];
    Pose pose({.time_s = 0.0,
               .world_from_body = record.world_from_body,
               .velocity_world_mps = record.velocity_world_mps,
               .acceleration_world_mps2 = record.acceleration_world_mps2,
               .angular_velocity_body_radps = record.angular_velocity_body_radps},
              t);
    pose.rotation = pose.rotation * geo::rig_from_rdf();
    return pose;
  }
  const std::optional<geo::BodyState>& body(int frame, std::size_t i) const {
    return sequence.frames()[static_cast<std::size_t>(frame)].moving[i];
  }
  static Vector3d ray_of(double x, double y) {
    return {(x - 100.0) / 200.0, (y - 80.0) / 200.0, 1.0};
  }
  static double slabs(const Vector3d& low, const Vector3d& high, const Vector3d& origin,
                      const Vector3d& direction) {
    double in = 0.0, out = std::numeric_limits<double>::infinity();
    for (int axis = 0; axis < 3; ++axis) {
      const double a = (low[axis] - origin[axis]) / direction[axis];
      const double b = (high[axis] - origin[axis]) / direction[axis];
      in = std::max(in, std::min(a, b));
      out = std::min(out, std::max(a, b));
    }
    return in <= out ? in : std::numeric_limits<double>::infinity();
  }

  struct Hit {
    double t = std::numeric_limits<double>::infinity();
    std::uint32_t instance_id = 0;
    int body = -1;
  };
  /// t of a body alone.
  double meet_body(int frame, std::size_t i, double time, const Vector3d& origin,
                   const Vector3d& direction, double grown = 0.0) const {
    if (!body(frame, i)) return std::numeric_limits<double>::infinity();
    const Pose pose(*body(frame, i), time);
    const Vector3d more = Vector3d::Constant(grown);
    return slabs(kBodies[i].low - more, kBodies[i].high + more, pose.own(origin),
                 pose.rotation.transpose() * direction);
  }
  Hit meet(int frame, double time, const Vector3d& origin, const Vector3d& direction,
           double grown = 0.0) const {
    Hit hit;
    if (direction.z() < 0.0) hit.t = -origin.z() / direction.z();
    const Vector3d more = Vector3d::Constant(grown);
    for (const WorldBox& box : kStill) {
      const double t = slabs(box.low - more, box.high + more, origin, direction);
      if (t < hit.t) hit = {t, box.instance_id, -1};
    }
    for (std::size_t i = 0; i < kBodies.size(); ++i) {
      const double t = meet_body(frame, i, time, origin, direction, grown);
      if (t < hit.t) hit = {t, kBodies[i].instance_id, static_cast<int>(i)};
    }
    return hit;
  }

  /// Where and when a point is seen by a camera, by halving the time.
  template <class PointAt>
  std::pair<Vector2d, double> seen(int frame, int camera, const PointAt& point_at) const {
    const auto pixel_at = [&](double t) -> Vector2d {
      const Vector3d at = camera_pose(frame, t).own(point_at(t));
      return {100.0 + 200.0 * at.x() / at.z(), 80.0 + 200.0 * at.y() / at.z()};
    };
    if (camera == 0) return {pixel_at(0.0), 0.0};
    double low = -0.2, high = 0.2;  // lines that the image does not have follow on
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (low + high);
      (time_of(camera, pixel_at(middle).y()) > middle ? low : high) = middle;
    }
    return {pixel_at(low), low};
  }
};

struct MovingLabels : testing::Test {
  static inline std::unique_ptr<ScratchFolder> folder;
  static inline std::optional<world::TileStore> store;
  static inline std::optional<capture::SequenceReader> sequence;
  static inline std::vector<render::MovingThing> things;

  void SetUp() override {
    if (folder) return;
    folder = std::make_unique<ScratchFolder>();
    store = make_boxes_world(*folder / "world", kStill);
    things = moving_things();
    sequence = render_plan(*store, plan_of(things), *folder / "boxes");
  }
  static void TearDownTestSuite() {
    sequence.reset();
    store.reset();
    folder.reset();
  }
};

}  // namespace terracast::test::moving_scene
