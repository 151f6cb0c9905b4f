#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "core/instance_id.h"
#include "geo/frames.h"
#include "tests/labels/boxes_world.h"
#include "tests/labels/pose.h"

/// A scene for tracks: things pass behind a wall and before a tower, one has a bar that turns on it, one is gone after two
/// frames, and the camera drives past what it saw. And what it shows, by brute force.
namespace terracast::test::tracked {

inline constexpr int kWidth = 200, kHeight = 160, kFrames = 4;
inline constexpr double kLineTime_s = 2e-4;
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr double kRim_m = 1e-6;  // what a ray passes by less may fall to either side

inline const std::vector<WorldBox> kStill = {
    {.instance_id = 11,
     .semantic_class = core::SemanticClass::Wall,
     .low = {100, -5, 40},
     .high = {110, 5, 60}},
    {.instance_id = 12, .low = {180, -60, 30}, .high = {200, -10, 70}},
};
inline constexpr std::uint32_t kVan = core::kFirstMovingId;

struct Body {
  std::uint32_t instance_id;
  Eigen::Vector3d low, high;
};
/// In the order of the sequence: the van has a bar.
inline const std::vector<Body> kBodies = {{kVan, {-6.0, -3.0, 0.0}, {8.0, 3.0, 5.0}},
                                          {kVan, {-5.0, -0.5, -0.25}, {5.0, 0.5, 0.25}},
                                          {kVan + 1, {-2.0, -1.0, -1.0}, {2.0, 1.0, 1.5}},
                                          {kVan + 2, {-2.0, -2.0, -2.0}, {2.0, 2.0, 2.0}}};
inline constexpr int kBar = 1;

inline geo::BodyState state_of(int frame, const Eigen::Vector3d& place, double turn_rad,
                               const Eigen::Vector3d& velocity, const Eigen::Vector3d& turning) {
  geo::BodyState state;
  state.time_s = 0.1 * frame;
  state.world_from_body = {
      Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, Eigen::Vector3d(0.1, -0.2, 1.0).normalized())),
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
        .gone_m = std::vector<double>(kFrames, 0.0)};
  };
  std::vector<render::MovingThing> things = {thing("van", 0, core::SemanticClass::Van),
                                             thing("cart", 2, core::SemanticClass::Car),
                                             thing("gone", 3, core::SemanticClass::Drone)};
  things[0].parts = {
      {.name = "bar",
       .shape = moving_box(kBodies[1].low, kBodies[1].high, core::SemanticClass::Van),
       .origin_m = {1.0, 0.5, 6.0},
       .axis = Eigen::Vector3d::UnitZ(),
       .rate_radps = 20.0}};
  for (int frame = 0; frame < kFrames; ++frame) {
    things[0].states.push_back(state_of(frame, {frame < 3 ? 150.0 : 330.0, 8.0 - 3.0 * frame, 46.0},
                                        0.5 + 0.2 * frame, {5.0, -40.0, 3.0}, {0.2, 0.1, 1.5}));
    things[1].states.push_back(state_of(frame, {60.0, -9.0 - 2.0 * frame, 51.0}, 1.0 + 0.3 * frame,
                                        {-10.0, -20.0, 1.0}, {0.0, 0.5, 2.0}));
    things[2].states.emplace_back();
    if (frame < 2)
      things[2].states.back() =
          state_of(frame, {70.0, 20.0, 52.0}, 0.3, {5.0, 5.0, 0.0}, {0.0, 0.0, 0.5});
  }
  return things;
}

/// Two cameras of one rig, the second of which reads out line by line; the last frame is far ahead of the others.
inline render::SequencePlan plan_of(const std::vector<render::MovingThing>& things) {
  render::SequencePlan plan = level_plan(kFrames);
  for (int i = 0; i < kFrames; ++i) {
    geo::BodyState& state = plan.states[static_cast<std::size_t>(i)];
    state.world_from_body.translation = Eigen::Vector3d(i < 3 ? 4.0 * i : 250.0, 0.3, 50.0);
    state.world_from_body.rotation = Eigen::AngleAxisd(0.02 * i, Eigen::Vector3d::UnitZ());
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

/// What a sequence shows, by all triangles of all boxes.
class Truth {
 public:
  explicit Truth(const capture::SequenceReader& sequence) : sequence_(sequence) {}

  struct Hit {
    double t = kInfinity;
    std::uint32_t instance_id = 0;
    int body = -1;
    bool is_same(const Hit& other) const {
      return instance_id == other.instance_id && body == other.body &&
             std::isfinite(t) == std::isfinite(other.t);
    }
  };

  static double time_of(int camera, double y) {
    return camera == 0 ? 0.0 : kLineTime_s * (y - 0.5 * kHeight);
  }
  Pose camera_pose(int frame, double t) const {
    const capture::FrameRecord& record = sequence_.frames()[static_cast<std::size_t>(frame)];
    Pose pose({.time_s = 0.0,
               .world_from_body = record.world_from_body,
               .velocity_world_mps = record.velocity_world_mps,
               .acceleration_world_mps2 = record.acceleration_world_mps2,
               .angular_velocity_body_radps = record.angular_velocity_body_radps},
              t);
    pose.rotation = pose.rotation * geo::rig_from_rdf();
    return pose;
  }
  const std::optional<geo::BodyState>& state(int frame, int body) const {
    return sequence_.frames()[static_cast<std::size_t>(frame)]
        .moving[static_cast<std::size_t>(body)];
  }

  Hit meet(int frame, double time, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
           double grown = 0.0) const {
    Hit hit;
    if (direction.z() < 0.0) hit.t = -origin.z() / direction.z();
    for (const WorldBox& box : kStill)
      keep_nearest(meet_box(box.low, box.high, grown, origin, direction), box.instance_id, -1, hit);
    for (std::size_t i = 0; i < kBodies.size(); ++i) {
      const auto body = static_cast<int>(i);
      if (!state(frame, body)) continue;
      const Pose pose(*state(frame, body), time);
      keep_nearest(meet_box(kBodies[i].low, kBodies[i].high, grown, pose.own(origin),
                            pose.rotation.transpose() * direction),
                   kBodies[i].instance_id, body, hit);
    }
    return hit;
  }

  /// What the centre of a pixel shows; nothing where that is the sky, the end of the world or unsure.
  struct Shown {
    Hit hit;
    Eigen::Vector3d own;  ///< in the frame of its body, or in the world
  };
  std::optional<Shown> shown(int frame, int camera, const Eigen::Vector2d& pixel) const {
    const double t = time_of(camera, pixel.y());
    const Pose pose = camera_pose(frame, t);
    const Eigen::Vector3d ray = pose.rotation * Eigen::Vector3d((pixel.x() - 100.0) / 200.0,
                                                                (pixel.y() - 80.0) / 200.0, 1.0);
    const Hit hit = meet(frame, t, pose.place, ray);
    if (!hit.is_same(meet(frame, t, pose.place, ray, kRim_m)) ||
        !hit.is_same(meet(frame, t, pose.place, ray, -kRim_m)))
      return std::nullopt;
    const Eigen::Vector3d point = pose.place + hit.t * ray;
    if (!point.allFinite() || point.head<2>().norm() > 900.0) return std::nullopt;
    return Shown{hit, hit.body < 0 ? point : Pose(*state(frame, hit.body), t).own(point)};
  }

 private:
  static void keep_nearest(double t, std::uint32_t instance_id, int body, Hit& hit) {
    if (t < hit.t) hit = {t, instance_id, body};
  }

  /// Of its twelve triangles the first: T. Möller and B. Trumbore, Fast, Minimum Storage Ray-Triangle Intersection,
  /// 1997.
  static double meet_box(const Eigen::Vector3d& box_low, const Eigen::Vector3d& box_high,
                         double grown, const Eigen::Vector3d& origin,
                         const Eigen::Vector3d& direction) {
    const Eigen::Vector3d low = box_low - Eigen::Vector3d::Constant(grown);
    const Eigen::Vector3d high = box_high + Eigen::Vector3d::Constant(grown);
    double first = kInfinity;
    for (int axis = 0; axis < 3; ++axis)
      for (const bool is_high : {false, true}) {
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        const auto corner = [&](bool is_high_u, bool is_high_v) {
          Eigen::Vector3d at;
          at[axis] = is_high ? high[axis] : low[axis];
          at[u] = is_high_u ? high[u] : low[u];
          at[v] = is_high_v ? high[v] : low[v];
          return at;
        };
        for (const bool is_second : {false, true}) {
          const Eigen::Vector3d a = corner(is_second, is_second), b = corner(true, false),
                                c = corner(false, true);
          const Eigen::Vector3d ab = b - a, ac = c - a, across = direction.cross(ac);
          const double det = ab.dot(across);
          if (det == 0.0) continue;
          const double share_b = (origin - a).dot(across) / det;
          const Eigen::Vector3d turned = (origin - a).cross(ab);
          const double share_c = direction.dot(turned) / det;
          const double t = ac.dot(turned) / det;
          if (share_b >= 0.0 && share_c >= 0.0 && share_b + share_c <= 1.0 && t > 0.0)
            first = std::min(first, t);
        }
      }
    return first;
  }

  const capture::SequenceReader& sequence_;
};

}  // namespace terracast::test::tracked
