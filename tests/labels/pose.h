#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "geo/trajectory.h"

namespace terracast::test {

/// A pose so much after a frame's time, from the definition.
struct Pose {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d place;
  Pose(const geo::BodyState& state, double t)
      : rotation(state.world_from_body.rotation.toRotationMatrix()),
        place(state.world_from_body.translation + t * state.velocity_world_mps +
              0.5 * t * t * state.acceleration_world_mps2) {
    const Eigen::Vector3d& w = state.angular_velocity_body_radps;
    if (w.norm() * std::abs(t) > 0.0)
      rotation = rotation * Eigen::AngleAxisd(w.norm() * t, w.normalized()).toRotationMatrix();
  }
  Eigen::Vector3d world(const Eigen::Vector3d& point) const { return place + rotation * point; }
  Eigen::Vector3d own(const Eigen::Vector3d& point) const { return turned(point - place); }
  Eigen::Vector3d turned(const Eigen::Vector3d& direction) const {
    return rotation.transpose() * direction;
  }
};

}  // namespace terracast::test
