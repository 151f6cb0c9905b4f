#pragma once

#include "geo/cameras/plane_camera.h"

namespace terracast::geo {

/// The angle t between a ray and the axis is the distance from the plane's origin, t (x, y) / |(x, y)|;
/// a lens moves the plane's points.
/// domain   t < pi, inside the distortion's disc (plane_distortion.h): all but the ray straight back
class EquidistantCamera final : public PlaneCamera {
 public:
  EquidistantCamera(const CameraIntrinsics& intrinsics,
                    const PlaneDistortion::Coefficients& distortion);

 private:
  std::optional<Eigen::Vector2d> plane_from_ray(const Eigen::Vector3d& ray) const override;
  Eigen::Vector3d ray_from_plane(const Eigen::Vector2d& place) const override;
  Eigen::Matrix<double, 2, 3> plane_jacobian(const Eigen::Vector3d& ray) const override;
};

}  // namespace terracast::geo
