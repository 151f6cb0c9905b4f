#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geo/geodesy.h"

namespace terracast::geo {

/// A vector of the world and its first two derivatives by time.
struct Changing {
  Eigen::Vector3d value, rate, second;
};

/// The unit vector along a changing vector.
Changing normalised(const Changing& v);
Changing crossed(const Changing& a, const Changing& b);
/// The part of a changing vector at right angles to a changing unit vector.
Changing without(const Changing& v, const Changing& unit);

/// The Earth's axis along the world's axes, northward.
Eigen::Vector3d polar_axis_of(const WorldFrame& frame);
/// The ellipsoid's normal at a moving point.
Changing up_along(const WorldFrame& frame, const Eigen::Vector3d& position,
                  const Eigen::Vector3d& velocity, const Eigen::Vector3d& acceleration);

/// A body's attitude and how it turns; the derivative of the components of the angular velocity is the angular
/// acceleration.
struct Turning {
  Eigen::Quaterniond world_from_body;
  Eigen::Vector3d angular_velocity_body_radps;
  Eigen::Vector3d angular_acceleration_body_radps2;
};
/// The turning of a body whose axes x, y and z move so: unit vectors at right angles.
Turning turning_of(const Changing& forward, const Changing& left, const Changing& up);

/// The turning of a body whose rotation has the parts w x y z of a changing vector, whatever the vector's length.
Turning turning_of_parts(const Eigen::Vector4d& value, const Eigen::Vector4d& rate,
                         const Eigen::Vector4d& second);

}  // namespace terracast::geo
