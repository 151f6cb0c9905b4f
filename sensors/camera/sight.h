#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "sensors/camera/unit_rays.h"
#include "sensors/camera/views.h"
#include "world/moving_scene.h"
#include "world/timed_query.h"

namespace terracast::sensors {

/// Two crossings are the same point of the surface when they differ by less than this share of the
/// distance. The surface's own t is good to 1e-12; a surface in front of the point by less than a
/// micrometre a kilometre hides nothing.
inline constexpr double kSamePointRelative = 1e-9;

/// t   of the first crossing of a ray to a point, which is at 1
inline bool is_at_point(double t) { return std::abs(t - 1.0) <= kSamePointRelative; }

/// A view that shall say whether it sees a pixel's point, and the bit that says so.
struct Target {
  OpenView view;
  int frame;
  std::uint32_t flag;
  world::TimedQuery scene;  ///< about the view's frame
};

/// Sets the target's flag of those points of a unit that it sees: of what stands.
/// scratch   the buffers of rays are used again
void see_standing(const Target& target, MetPoints& met, UnitScratch& scratch,
                  world::RayTrail* trail);

/// A point of something that moves, as it was met.
struct MovingPoint {
  Eigen::Vector3d point_world;
  const world::MovingBody* body;  ///< at the frame at which it was met
  std::size_t pixel;
};

/// Sets the target's flag of those pixels whose points it sees: where they are when it looks.
/// then       what moves about the target's frame
/// offset_s   when the points were met, counted from their bodies' time
/// flags      of all pixels
void see_moving(const Target& target, const world::MovingScene& then,
                std::span<const MovingPoint> points, double offset_s,
                std::span<std::uint32_t> flags, world::RayTrail* trail);

/// Which of some points of what stands are seen in a view, by ray.
/// scene   about the time of the view's frame
std::vector<std::uint8_t> visible_in_view(const world::TimedQuery& scene, const OpenView& view,
                                          std::span<const Eigen::Vector3d> points_world);

}  // namespace terracast::sensors
