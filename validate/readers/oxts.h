#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>

#include "validate/geodesy.h"

/// KITTI raw's packets of an inertial and satellite unit.
namespace terracast::validate {

/// A packet; the unit's axes are x forward, y left, z up. Level axes are the same turned by roll
/// and pitch: forward and left in the horizontal plane, and up.
struct OxtsPacket {
  Geodetic place;
  double roll_rad = 0.0, pitch_rad = 0.0;  ///< as written; level_from_imu is made of them
  double yaw_rad = 0.0;
  Eigen::Matrix3d level_from_imu = Eigen::Matrix3d::Identity();
  Eigen::Vector3d velocity_enu_mps;    ///< in the east, north, up of the place
  Eigen::Vector2d velocity_level_mps;  ///< forward, left
  Eigen::Vector3d force_imu_mps2;      ///< specific force
  Eigen::Vector3d force_level_mps2;
  Eigen::Vector3d rate_imu_radps;
  Eigen::Vector3d rate_level_radps;

  Eigen::Matrix3d enu_from_level() const {
    return Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  }
  Eigen::Matrix3d enu_from_imu() const { return enu_from_level() * level_from_imu; }
  Pose ecef_from_imu() const;
};

/// throws  Input: not 30 finite numbers in one line, or no place on Earth; `where` names the file
OxtsPacket parse_oxts(std::string_view text, const std::string& where);

}  // namespace terracast::validate
