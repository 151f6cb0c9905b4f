#include "geo/cameras/equidistant_camera.h"

#include <cmath>
#include <numbers>

namespace terracast::geo {

EquidistantCamera::EquidistantCamera(const CameraIntrinsics& intrinsics,
                                     const PlaneDistortion::Coefficients& distortion)
    : PlaneCamera(intrinsics, PlaneDistortion(distortion, std::numbers::pi)) {
  measure_finest();
}

std::optional<Eigen::Vector2d> EquidistantCamera::plane_from_ray(const Eigen::Vector3d& ray) const {
  if (!ray.allFinite()) return std::nullopt;
  const double from_axis = std::hypot(ray.x(), ray.y());
  if (from_axis == 0.0) {
    if (!(ray.z() > 0.0)) return std::nullopt;
    return Eigen::Vector2d(0.0, 0.0);
  }
  return std::atan2(from_axis, ray.z()) / from_axis * ray.head<2>();
}

Eigen::Vector3d EquidistantCamera::ray_from_plane(const Eigen::Vector2d& place) const {
  const double angle = place.norm();
  if (angle == 0.0) return Eigen::Vector3d::UnitZ();
  const double share = std::sin(angle) / angle;
  return {share * place.x(), share * place.y(), std::cos(angle)};
}

Eigen::Matrix<double, 2, 3> EquidistantCamera::plane_jacobian(const Eigen::Vector3d& ray) const {
  const double from_axis = std::hypot(ray.x(), ray.y());
  Eigen::Matrix<double, 2, 3> jacobian = Eigen::Matrix<double, 2, 3>::Zero();
  if (from_axis == 0.0) {
    jacobian.leftCols<2>() = Eigen::Matrix2d::Identity() / ray.z();
    return jacobian;
  }
  const Eigen::Vector2d outward = ray.head<2>() / from_axis;
  const double stretch = std::atan2(from_axis, ray.z()) / from_axis;
  const double square = from_axis * from_axis + ray.z() * ray.z();
  jacobian.leftCols<2>() = stretch * Eigen::Matrix2d::Identity() +
                           (ray.z() / square - stretch) * outward * outward.transpose();
  jacobian.col(2) = -from_axis / square * outward;
  return jacobian;
}

}  // namespace terracast::geo
