#include "validate/geometry.h"

#include <Eigen/Geometry>

namespace terracast::validate {

Eigen::Vector3d Pose::operator*(const Eigen::Vector3d& point) const {
  return rotation * point + translation;
}

Pose Pose::operator*(const Pose& other) const {
  return {rotation * other.rotation, rotation * other.translation + translation};
}

Pose Pose::inverse() const { return {rotation.transpose(), -(rotation.transpose() * translation)}; }

double rotation_angle_rad(const Eigen::Matrix3d& rotation) {
  const Eigen::Vector3d twice_sine_axis(rotation(2, 1) - rotation(1, 2),
                                        rotation(0, 2) - rotation(2, 0),
                                        rotation(1, 0) - rotation(0, 1));
  return std::atan2(0.5 * twice_sine_axis.norm(), 0.5 * (rotation.trace() - 1.0));
}

Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn{Eigen::Quaterniond(rotation)};
  return turn.angle() * turn.axis();
}

}  // namespace terracast::validate
