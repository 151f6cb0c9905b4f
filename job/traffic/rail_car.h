#pragma once

#include <Eigen/Core>

#include "job/traffic/drive.h"
#include "job/traffic/lane_path.h"

namespace terracast::job {

/// Motion of a rigid car whose two pivots keep to a curve, on the map.
struct CarMotion {
  Eigen::Vector2d at_world;  ///< the middle between the pivots
  Eigen::Vector2d forward;   ///< of length 1
  Eigen::Vector2d velocity_mps;
  Eigen::Vector2d acceleration_mps2;
  double turning_radps = 0.0;  ///< anticlockwise
  double rear_m = 0.0;         ///< of its rear pivot, along the curve
};

/// front_m    of its front pivot, along the curve
/// progress   speed and acceleration along the curve, of the front pivot
/// pivots_m   from pivot to pivot, straight
/// accuracy   both pivots lie on the curve to PathCurve's own accuracy; velocities and accelerations are the exact
///            derivatives (RailCar tests, against circles in closed form and differences)
CarMotion car_motion(const PathCurve& curve, double front_m, const Drive::Progress& progress,
                     double pivots_m);

}  // namespace terracast::job
