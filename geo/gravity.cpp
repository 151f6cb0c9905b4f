#include "geo/gravity.h"

#include <GeographicLib/NormalGravity.hpp>

namespace terracast::geo {

Eigen::Vector3d gravity_world_mps2(const WorldFrame& frame, const Eigen::Vector3d& point_world) {
  const Eigen::Vector3d point = frame.ecef_from_world() * point_world;
  Eigen::Vector3d gravity;
  GeographicLib::NormalGravity::WGS84().U(point.x(), point.y(), point.z(), gravity.x(), gravity.y(),
                                          gravity.z());
  return frame.ecef_from_world().rotation.conjugate() * gravity;
}

Eigen::Vector3d earth_rate_world_radps(const WorldFrame& frame) {
  return frame.ecef_from_world().rotation.conjugate() *
         (kEarthRate_radps * Eigen::Vector3d::UnitZ());
}

}  // namespace terracast::geo
