#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <span>

namespace terracast::world {

/// A ray of the world frame, double. The direction need not have unit length; t counts in its
/// lengths.
struct WorldRay {
  Eigen::Vector3d origin_world;
  Eigen::Vector3d direction_world;
  double t_min = 0.0;
  double t_max = std::numeric_limits<double>::infinity();
};

/// Rays from one point, field by field. The spans are of one size.
struct RayFan {
  Eigen::Vector3d origin_world;
  std::span<const double> x, y, z;  ///< directions in the world frame, of any length
  double t_min = 0.0;
  double t_max = std::numeric_limits<double>::infinity();
  std::span<const double> t_ends = {};  ///< of each ray, in place of t_max; empty: all end at that

  std::size_t size() const { return x.size(); }
  WorldRay operator[](std::size_t i) const {
    return {.origin_world = origin_world,
            .direction_world = {x[i], y[i], z[i]},
            .t_min = t_min,
            .t_max = t_ends.empty() ? t_max : t_ends[i]};
  }
  RayFan subspan(std::size_t first, std::size_t count) const {
    return {.origin_world = origin_world,
            .x = x.subspan(first, count),
            .y = y.subspan(first, count),
            .z = z.subspan(first, count),
            .t_min = t_min,
            .t_max = t_max,
            .t_ends = t_ends.empty() ? t_ends : t_ends.subspan(first, count)};
  }
};

}  // namespace terracast::world
