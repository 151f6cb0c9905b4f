#include <algorithm>
#include <array>
#include <cmath>

#include "geo/camera_model.h"

namespace terracast::geo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// A line scanner that moves along its y axis while it takes the image, one row after the other, without
/// turning: u = fx x / z + cx, v = fy y + cy; fx is in pixels, fy rows a metre of the way.
/// domain   z > 0
/// source   R. Gupta, R. Hartley, Linear pushbroom cameras, PAMI 19 (1997)
class PushbroomCamera final : public CameraModel {
 public:
  explicit PushbroomCamera(const CameraIntrinsics& intrinsics)
      : CameraModel(intrinsics),
        fx_(intrinsics.parameters[0]),
        fy_(intrinsics.parameters[1]),
        cx_(intrinsics.parameters[2]),
        cy_(intrinsics.parameters[3]) {}

  bool is_central() const override { return false; }

  Vector3d ray_from_pixel(const Vector2d& pixel) const override {
    return {(pixel.x() - cx_) / fx_, 0.0, 1.0};
  }

  Vector3d origin_from_pixel(const Vector2d& pixel) const override {
    return {0.0, (pixel.y() - cy_) / fy_, 0.0};
  }

  std::optional<Vector2d> pixel_from_ray(const Vector3d& point_camera) const override {
    if (!(point_camera.z() > 0.0) || !point_camera.allFinite()) return std::nullopt;
    return Vector2d(fx_ * (point_camera.x() / point_camera.z()) + cx_,
                    fy_ * point_camera.y() + cy_);
  }

  Eigen::Matrix<double, 2, 3> pixel_jacobian(const Vector3d& point_camera) const override {
    const double per_z = 1.0 / point_camera.z();
    Eigen::Matrix<double, 2, 3> jacobian;
    jacobian << fx_ * per_z, 0.0, -fx_ * point_camera.x() * per_z * per_z,  //
        0.0, fy_, 0.0;
    return jacobian;
  }

  // Across the rays of a row it is a pinhole: fx / cos^2.
  double finest_pixels_per_radian() const override {
    const double widest = std::max(cx_, width_px() - cx_) / fx_;
    return fx_ * (1.0 + widest * widest);
  }
  double finest_pixels_per_m() const override { return fy_; }

 private:
  double fx_, fy_, cx_, cy_;
};

}  // namespace

CameraModelInfo pushbroom_camera() {
  return {.name = "pushbroom",
          .summary = "Line scanner on a straight way; fx in pixels, fy rows a metre.",
          .parameters = {},
          .make = [](const CameraIntrinsics& intrinsics) -> std::unique_ptr<CameraModel> {
            return std::make_unique<PushbroomCamera>(intrinsics);
          }};
}

}  // namespace terracast::geo
