#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "geo/geodesy.h"
#include "world/tile_objects.h"

namespace terracast::world {

/// Where an instance's prototype stands: its point p (m, in the frame of Shape) lies in the world at
///
///     place_world + scale * (world_from_prototype * p)
struct InstanceFrame {
  Eigen::Vector3d place_world = Eigen::Vector3d::Zero();
  Eigen::Quaterniond world_from_prototype = Eigen::Quaterniond::Identity();
  double scale = 1.0;

  Eigen::Vector3d operator*(const Eigen::Vector3d& point_prototype) const {
    return place_world + scale * (world_from_prototype * point_prototype);
  }
};

/// The frame of an instance. Its place, P, is place_steps * kHeightStep_m, exact in double. East,
/// north and up are those of WGS84 through P (WorldFrame::world_from_enu). With h = heading * 2 pi /
/// 65536 the prototype's axes lie in the world along
///
///     x = cos h * east + sin h * north,    y = -sin h * east + cos h * north,    z = up
///
/// and its lengths are multiplied by scale / 4096.
/// accuracy   of the rotation 1e-15; of up what WorldFrame's is
/// threads    safe
InstanceFrame instance_frame(const Instance& instance, const geo::WorldFrame& frame);

}  // namespace terracast::world
