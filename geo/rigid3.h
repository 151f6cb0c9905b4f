#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace terracast::geo {

/// A rotation and a translation; named target_from_source, it takes points of source into target.
struct Rigid3d {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  /// Point of source in target.
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return rotation * point + translation;
  }
  /// a_from_b * b_from_c = a_from_c; the rotation stays normalised.
  Rigid3d operator*(const Rigid3d& other) const {
    return {(rotation * other.rotation).normalized(), rotation * other.translation + translation};
  }
  Rigid3d inverse() const {
    const Eigen::Quaterniond back = rotation.conjugate();
    return {back, -(back * translation)};
  }
  bool operator==(const Rigid3d& other) const {
    return rotation.coeffs() == other.rotation.coeffs() && translation == other.translation;
  }
};

}  // namespace terracast::geo
