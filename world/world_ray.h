#pragma once

#include <Eigen/Core>
#include <limits>

namespace terracast::world {

/// A ray of the world frame, double. The direction need not have unit length; t counts in its
/// lengths.
struct WorldRay {
  Eigen::Vector3d origin_world;
  Eigen::Vector3d direction_world;
  double t_min = 0.0;
  double t_max = std::numeric_limits<double>::infinity();
};

}  // namespace terracast::world
