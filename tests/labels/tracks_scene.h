#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "tests/labels/moving_bodies.h"

/// A scene for tracks: things pass behind a wall and before a tower, one has a bar that turns on it, one is gone after two
/// frames, and the camera drives past what it saw. And what it shows, by brute force.
namespace terracast::test::tracked {

using namespace moving_bodies;

inline constexpr int kFrames = 4;
inline const std::vector<Body> kBodies = {kVanBody, kBarBody, kCartBody, gone_body(kVan + 2)};
inline constexpr int kBar = 1;

inline std::vector<scene::MovingThing> moving_things() {
  return {van({150.0, 150.0, 150.0, 330.0}), cart(kFrames), gone(2, kFrames)};
}

/// The last frame is far ahead of the others.
inline render::SequencePlan plan_of(const std::vector<scene::MovingThing>& things) {
  return two_camera_plan({0.0, 4.0, 8.0, 250.0}, things);
}

/// Where a ray first meets a box, by its twelve triangles: T. Möller and B. Trumbore, Fast, Minimum Storage
/// Ray-Triangle Intersection, 1997.
inline double meet_triangles(const Eigen::Vector3d& low, const Eigen::Vector3d& high,
                             const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
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

/// What a sequence shows, by all triangles of all boxes.
struct Truth : ShownBodies {
  explicit Truth(const capture::SequenceReader& shown) : ShownBodies{shown, kBodies} {}

  Hit meet(int frame, double time, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
           double grown = 0.0) const {
    return ShownBodies::meet(frame, time, origin, direction, grown, meet_triangles);
  }

  /// What the centre of a pixel shows; nothing where that is the sky, the end of the world or unsure.
  struct Shown {
    Hit hit;
    Eigen::Vector3d own;  ///< in the frame of its body, or in the world
  };
  std::optional<Shown> shown(int frame, int camera, const Eigen::Vector2d& pixel) const {
    const double t = time_of(camera, pixel.y());
    const Pose pose = camera_pose(frame, t);
    const Eigen::Vector3d ray = pose.rotation * ray_of(pixel.x(), pixel.y());
    const Hit hit = meet(frame, t, pose.place, ray);
    if (!hit.is_same(meet(frame, t, pose.place, ray, kRim_m)) ||
        !hit.is_same(meet(frame, t, pose.place, ray, -kRim_m)))
      return std::nullopt;
    const Eigen::Vector3d point = pose.place + hit.t * ray;
    if (!point.allFinite() || point.head<2>().norm() > 900.0) return std::nullopt;
    return Shown{hit, hit.body < 0 ? point : Pose(*state(frame, hit.body), t).own(point)};
  }
};

}  // namespace terracast::test::tracked
