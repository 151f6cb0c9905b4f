#pragma once

#include <Eigen/Core>

#include "world/instance_frame.h"
#include "world/triangle_crossing.h"

/// What the crossings of rays with triangles of objects (triangle_crossing.h) err by, by running error analysis
/// (geo/rounding.h). The truth is what exact arithmetic makes of the same doubles: the world's ray, corners in
/// steps, and of an instance its frame, whose quaternion stands for a rotation whatever its length.
///
/// accuracy   never below the error; of each thousand triangles of a kind some have errors of over a hundredth of
///            their bound: CrossingError tests, against 113-bit arithmetic
/// cost       60 ns
/// threads    safe
namespace terracast::world {

/// By how much a ray may differ from the exact one, as lengths of vectors.
struct RayError {
  double origin_m = 0.0;
  double direction = 0.0;  ///< in the unit of the direction
};

/// What moving a world ray into an instance's frame makes wrong of it.
/// origin_m, direction   as moved (in the frame of Shape)
/// world_from_shape      of the instance
RayError error_of_moved_ray(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction,
                            const Eigen::Quaterniond& world_from_shape);

/// By how much the t of a crossing that was found may differ from that of the exact ray and the triangle's plane.
/// origin_m, direction   of the ray, in the frame of the corners
/// returns   +inf: the ray does not cross it, or runs so nearly in its plane that doubles do not tell
double crossing_error(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction,
                      const RayError& ray_error, const TriangleCorners& corners);

}  // namespace terracast::world
