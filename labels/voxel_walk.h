#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <limits>

#include "labels/voxel.h"

/// Which voxels a ray passes (J. Amanatides and A. Woo, A Fast Voxel Traversal Algorithm for Ray Tracing, Eurographics
/// 1987).
namespace terracast::labels {

/// Calls visit(voxel, t_in, t_out) for all voxels in which a ray has a length between t = 0 and the one in which
/// t_end lies, in order; t_out of one is t_in of the next.
/// accuracy   each crossing of a plane of voxels is reckoned by itself, from the ray: roundings do not add up
template <class Visit>
void walk_voxels(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction, double t_end,
                 double voxel_m, const Visit& visit) {
  Voxel voxel = voxel_of(origin_m, voxel_m);
  std::array<double, 3> t_next;
  const auto set_next = [&](std::size_t axis) {
    const auto k = static_cast<Eigen::Index>(axis);
    const double side = static_cast<double>(voxel[axis] + (direction[k] > 0.0 ? 1 : 0)) * voxel_m;
    t_next[axis] = direction[k] == 0.0 ? std::numeric_limits<double>::infinity()
                                       : (side - origin_m[k]) / direction[k];
  };
  for (std::size_t axis = 0; axis < 3; ++axis) set_next(axis);
  double t = 0.0;
  for (;;) {
    std::size_t axis = t_next[1] < t_next[0] ? 1 : 0;
    if (t_next[2] < t_next[axis]) axis = 2;
    const double t_out = t_next[axis];
    if (t_out > t) visit(voxel, t, t_out);
    if (!(t_out <= t_end)) return;
    t = std::max(t, t_out);
    voxel[axis] += direction[static_cast<Eigen::Index>(axis)] > 0.0 ? 1 : -1;
    set_next(axis);
  }
}

}  // namespace terracast::labels
