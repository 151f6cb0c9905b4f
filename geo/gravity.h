#pragma once

#include <Eigen/Core>

#include "geo/geodesy.h"

/// Gravity and turning of the Earth, as inertial sensors measure them.
namespace terracast::geo {

/// WGS84's rate of turning, rad/s.
inline constexpr double kEarthRate_radps = 7.292115e-5;

/// Gravity of WGS84's normal field, the centrifugal part included, along the world's axes, m/s^2.
/// accuracy   of the normal field: 1e-11 m/s^2, at any height (GeographicLib's closed form); Gravity.…. The Earth's own
///            departs from it by up to 5e-4 m/s^2 and 0.3 mrad.
/// source     Heiskanen and Moritz 1967, sections 2-7 to 2-8
/// threads    safe
Eigen::Vector3d gravity_world_mps2(const WorldFrame& frame, const Eigen::Vector3d& point_world);

/// The Earth's turning along the world's axes, rad/s.
Eigen::Vector3d earth_rate_world_radps(const WorldFrame& frame);

}  // namespace terracast::geo
