#include "geo/cameras/distorted_pinhole.h"

#include <limits>

namespace terracast::geo {

DistortedPinholeCamera::DistortedPinholeCamera(const CameraIntrinsics& intrinsics,
                                               const PlaneDistortion::Coefficients& distortion)
    : PlaneCamera(intrinsics,
                  PlaneDistortion(distortion, std::numeric_limits<double>::infinity())) {
  measure_finest();
}

std::optional<Eigen::Vector2d> DistortedPinholeCamera::plane_from_ray(
    const Eigen::Vector3d& ray) const {
  if (!(ray.z() > 0.0)) return std::nullopt;
  return Eigen::Vector2d(ray.x() / ray.z(), ray.y() / ray.z());
}

Eigen::Vector3d DistortedPinholeCamera::ray_from_plane(const Eigen::Vector2d& place) const {
  return {place.x(), place.y(), 1.0};
}

Eigen::Matrix<double, 2, 3> DistortedPinholeCamera::plane_jacobian(
    const Eigen::Vector3d& ray) const {
  const double per_z = 1.0 / ray.z();
  Eigen::Matrix<double, 2, 3> jacobian;
  jacobian << per_z, 0.0, -ray.x() * per_z * per_z,  //
      0.0, per_z, -ray.y() * per_z * per_z;
  return jacobian;
}

}  // namespace terracast::geo
