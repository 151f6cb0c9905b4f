#pragma once

#include "geo/cameras/plane_camera.h"

namespace terracast::geo {

/// Central projection on the plane z = 1, x / z and y / z, whose points a lens moves.
/// domain   z > 0, inside the distortion's disc (plane_distortion.h)
class DistortedPinholeCamera final : public PlaneCamera {
 public:
  DistortedPinholeCamera(const CameraIntrinsics& intrinsics,
                         const PlaneDistortion::Coefficients& distortion);

 private:
  std::optional<Eigen::Vector2d> plane_from_ray(const Eigen::Vector3d& ray) const override;
  Eigen::Vector3d ray_from_plane(const Eigen::Vector2d& place) const override;
  Eigen::Matrix<double, 2, 3> plane_jacobian(const Eigen::Vector3d& ray) const override;
};

}  // namespace terracast::geo
