#include "geo/fixes/fix.h"

#include "core/error.h"
#include "geo/frames.h"

namespace terracast::geo {

Eigen::Quaterniond rotation_by_angles(double yaw_rad, double pitch_rad, double roll_rad) {
  return Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(pitch_rad, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX());
}

Eigen::Quaterniond enu_from_ned() {
  return Eigen::Quaterniond((Eigen::Matrix3d() << 0, 1, 0, 1, 0, 0, 0, 0, -1).finished());
}

Eigen::Quaterniond axes_from_body(const std::string& axes) {
  if (axes == "flu") return Eigen::Quaterniond::Identity();
  if (axes == "frd")
    return Eigen::Quaterniond(Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal().toDenseMatrix());
  if (axes == "urf")
    return Eigen::Quaterniond((Eigen::Matrix3d() << 0, 0, 1, 0, -1, 0, 1, 0, 0).finished());
  TERRACAST_CHECK(axes == "rdf", "axes {}", axes);
  return Eigen::Quaterniond(rig_from_rdf().transpose());
}

Eigen::Quaterniond enu_from_body_by_ned_angles(double yaw_rad, double pitch_rad, double roll_rad) {
  return enu_from_ned() * rotation_by_angles(yaw_rad, pitch_rad, roll_rad) * axes_from_body("frd");
}

}  // namespace terracast::geo
