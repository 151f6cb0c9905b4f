#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "core/instance_id.h"
#include "geo/frames.h"
#include "tests/labels/boxes_world.h"
#include "tests/labels/pose.h"

/// Bodies that lean and turn before cameras of boxes_world.h, and what a test knows of them by itself: where a ray meets
/// their boxes, where a point appears, and when the line that shows it is exposed.
namespace terracast::test::moving_bodies {

inline constexpr int kWidth = 200, kHeight = 160;
inline constexpr double kLineTime_s = 2e-4;  // of cameras that read out line by line
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr double kRim_m = 1e-6;  // what a ray passes by less may fall to either side

/// A box along the axes of what moves.
struct Body {
  std::uint32_t instance_id = 0;
  Eigen::Vector3d low, high;
};

inline geo::BodyState leaning_state(int frame, const Eigen::Vector3d& place, double turn_rad,
                                    const Eigen::Vector3d& velocity,
                                    const Eigen::Vector3d& turning) {
  geo::BodyState state;
  state.time_s = 0.1 * frame;
  state.world_from_body = {
      Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, Eigen::Vector3d(0.1, -0.2, 1.0).normalized())),
      place};
  state.velocity_world_mps = velocity;
  state.acceleration_world_mps2 = {4.0, -6.0, 2.0};
  state.angular_velocity_body_radps = turning;
  state.terms = lively_terms();
  return state;
}

/// The thing of a body, without states; nothing of it is gone.
inline scene::MovingThing thing_of_body(const std::string& name, const Body& body,
                                        core::SemanticClass semantic_class,
                                        std::size_t num_frames) {
  return {.name = name,
          .shape = moving_box(body.low, body.high, semantic_class),
          .semantic_id = static_cast<std::uint32_t>(semantic_class),
          .parts = {},
          .states = {},
          .gone_m = std::vector<double>(num_frames, 0.0)};
}

/// Where a point appears that a camera has so in its frame, and the ray of a place in the image.
inline Eigen::Vector2d pixel_of(const Eigen::Vector3d& at_camera) {
  return {100.0 + 200.0 * at_camera.x() / at_camera.z(),
          80.0 + 200.0 * at_camera.y() / at_camera.z()};
}
inline Eigen::Vector3d ray_of(double x_px, double y_px) {
  return {(x_px - 100.0) / 200.0, (y_px - 80.0) / 200.0, 1.0};
}

/// Where a ray first meets a box, by its slabs: from outside, in lengths of the direction; infinite where it does not.
inline double slabs(const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                    const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  double in = 0.0, out = kInfinity;
  for (int axis = 0; axis < 3; ++axis) {
    const double a = (low[axis] - origin[axis]) / direction[axis];
    const double b = (high[axis] - origin[axis]) / direction[axis];
    in = std::max(in, std::min(a, b));
    out = std::min(out, std::max(a, b));
  }
  return in <= out ? in : kInfinity;
}

/// When a camera that reads out line by line exposes what stands at a height in its image, after the frame's time.
inline double exposed_s(double y_px) { return kLineTime_s * (y_px - 0.5 * kHeight); }

/// When the line that sees something is exposed, by halving. Lines that the image does not have follow on.
/// y_at     height in the image at a time after the frame's
/// reach_s  the time lies within it
template <class HeightAt>
double time_seen(double reach_s, const HeightAt& y_at) {
  double low = -reach_s, high = reach_s;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (exposed_s(y_at(middle)) > middle ? low : high) = middle;
  }
  return low;
}

// What sequences of two cameras show: a van with a bar that turns on it, a cart and something that is gone after some
// frames, before a wall and a tower.

inline const std::vector<WorldBox> kStill = {
    {.instance_id = 11,
     .semantic_class = core::SemanticClass::Wall,
     .low = {100, -5, 40},
     .high = {110, 5, 60}},
    {.instance_id = 12, .low = {180, -60, 30}, .high = {200, -10, 70}},
};
inline constexpr std::uint32_t kVan = core::kFirstMovingId;
inline const Body kVanBody{kVan, {-6.0, -3.0, 0.0}, {8.0, 3.0, 5.0}};
inline const Body kBarBody{
    kVan, {-5.0, -0.5, -0.25}, {5.0, 0.5, 0.25}};  // in the order of the sequence
inline const Body kCartBody{kVan + 1, {-2.0, -1.0, -1.0}, {2.0, 1.0, 1.5}};
inline Body gone_body(std::uint32_t instance_id) {
  return {instance_id, {-2.0, -2.0, -2.0}, {2.0, 2.0, 2.0}};
}

/// van_x_m   where it is in each frame
inline scene::MovingThing van(const std::vector<double>& van_x_m) {
  scene::MovingThing thing =
      thing_of_body("van", kVanBody, core::SemanticClass::Van, van_x_m.size());
  thing.parts = {{.name = "bar",
                  .shape = moving_box(kBarBody.low, kBarBody.high, core::SemanticClass::Van),
                  .origin_m = {1.0, 0.5, 6.0},
                  .axis = Eigen::Vector3d::UnitZ(),
                  .rate_radps = 20.0}};
  for (const double x_m : van_x_m) {
    const auto frame = static_cast<int>(thing.states.size());
    thing.states.push_back(leaning_state(frame, {x_m, 8.0 - 3.0 * frame, 46.0}, 0.5 + 0.2 * frame,
                                         {5.0, -40.0, 3.0}, {0.2, 0.1, 1.5}));
  }
  return thing;
}

inline scene::MovingThing cart(int num_frames) {
  scene::MovingThing thing = thing_of_body("cart", kCartBody, core::SemanticClass::Car,
                                           static_cast<std::size_t>(num_frames));
  for (int frame = 0; frame < num_frames; ++frame)
    thing.states.push_back(leaning_state(frame, {60.0, -9.0 - 2.0 * frame, 51.0}, 1.0 + 0.3 * frame,
                                         {-10.0, -20.0, 1.0}, {0.0, 0.5, 2.0}));
  return thing;
}

/// It is there in the first frames alone.
inline scene::MovingThing gone(int num_there, int num_frames) {
  scene::MovingThing thing = thing_of_body("gone", gone_body(0), core::SemanticClass::Drone,
                                           static_cast<std::size_t>(num_frames));
  thing.states.resize(static_cast<std::size_t>(num_frames));
  for (int frame = 0; frame < num_there; ++frame)
    thing.states[static_cast<std::size_t>(frame)] =
        leaning_state(frame, {70.0, 20.0, 52.0}, 0.3, {5.0, 5.0, 0.0}, {0.0, 0.0, 0.5});
  return thing;
}

/// Two cameras of one rig, the second of which reads out line by line.
/// camera_x_m   where they are in each frame
inline render::SequencePlan two_camera_plan(const std::vector<double>& camera_x_m,
                                            const std::vector<scene::MovingThing>& things) {
  render::SequencePlan plan = level_plan(static_cast<int>(camera_x_m.size()));
  for (std::size_t i = 0; i < camera_x_m.size(); ++i) {
    geo::BodyState& state = plan.states[i];
    state.world_from_body.translation = Eigen::Vector3d(camera_x_m[i], 0.3, 50.0);
    state.world_from_body.rotation =
        Eigen::AngleAxisd(0.02 * static_cast<double>(i), Eigen::Vector3d::UnitZ());
    state.velocity_world_mps = {12.0, 3.0, -2.0};
    state.acceleration_world_mps2 = {0.0, 5.0, 1.0};
    state.angular_velocity_body_radps = {0.1, -0.2, 0.4};
    state.terms = lively_terms();
  }
  plan.cameras.push_back(plan.cameras[0]);
  plan.cameras[1].name = "cam1";
  plan.cameras[1].shutter = {.line_time_s = kLineTime_s};
  plan.moving = things;
  return plan;
}

/// What a ray meets first.
struct Hit {
  double t = kInfinity;
  std::uint32_t instance_id = 0;
  int body = -1;
  bool is_same(const Hit& other) const {
    return instance_id == other.instance_id && body == other.body &&
           std::isfinite(t) == std::isfinite(other.t);
  }
};

/// What a sequence of two cameras shows of the ground, kStill and bodies.
struct ShownBodies {
  const capture::SequenceReader& sequence;
  const std::vector<Body>& bodies;  ///< in the order of the sequence

  static double time_of(int camera, double y_px) { return camera == 0 ? 0.0 : exposed_s(y_px); }
  Pose camera_pose(int frame, double t) const {
    const capture::FrameRecord& record = sequence.frames()[static_cast<std::size_t>(frame)];
    Pose pose(record.state(), t);
    pose.rotation = pose.rotation * geo::rig_from_rdf();
    return pose;
  }
  const std::optional<geo::BodyState>& state(int frame, int body) const {
    return sequence.frames()[static_cast<std::size_t>(frame)]
        .moving[static_cast<std::size_t>(body)];
  }

  /// Where a ray meets a body alone.
  /// grown      by how much boxes are larger on every side, m
  /// meet_box   t of a ray and a box: low, high, origin, direction
  template <class MeetBox>
  double meet_body(int frame, int body, double time, const Eigen::Vector3d& origin,
                   const Eigen::Vector3d& direction, double grown, const MeetBox& meet_box) const {
    if (!state(frame, body)) return kInfinity;
    const Pose pose(*state(frame, body), time);
    const Body& box = bodies[static_cast<std::size_t>(body)];
    const Eigen::Vector3d more = Eigen::Vector3d::Constant(grown);
    return meet_box(box.low - more, box.high + more, pose.own(origin), pose.turned(direction));
  }
  template <class MeetBox>
  Hit meet(int frame, double time, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
           double grown, const MeetBox& meet_box) const {
    Hit hit;
    if (direction.z() < 0.0) hit.t = -origin.z() / direction.z();
    const Eigen::Vector3d more = Eigen::Vector3d::Constant(grown);
    for (const WorldBox& box : kStill) {
      const double t = meet_box(box.low - more, box.high + more, origin, direction);
      if (t < hit.t) hit = {t, box.instance_id, -1};
    }
    for (int body = 0; body < static_cast<int>(bodies.size()); ++body) {
      const double t = meet_body(frame, body, time, origin, direction, grown, meet_box);
      if (t < hit.t) hit = {t, bodies[static_cast<std::size_t>(body)].instance_id, body};
    }
    return hit;
  }
};

}  // namespace terracast::test::moving_bodies
