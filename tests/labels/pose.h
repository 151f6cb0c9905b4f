#pragma once

#include <Eigen/Geometry>

#include "tests/support/motion_terms.h"

namespace terracast::test {

/// A pose so much after a frame's time, from the definition.
struct Pose {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d place;
  Pose(const geo::BodyState& state, double t) {
    const BodyThen body(state, t);
    rotation = body.rotation;
    place = body.place;
  }
  Eigen::Vector3d world(const Eigen::Vector3d& point) const { return place + rotation * point; }
  Eigen::Vector3d own(const Eigen::Vector3d& point) const { return turned(point - place); }
  Eigen::Vector3d turned(const Eigen::Vector3d& direction) const {
    return rotation.transpose() * direction;
  }
};

}  // namespace terracast::test
