#include <algorithm>

#include "geo/camera_model.h"

namespace terracast::geo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Parallel projection along the axis: u = fx x + cx, v = fy y + cy, fx and fy pixels a metre.
/// domain   z > 0, before the plane on which rays start
/// source   R. Hartley, A. Zisserman, Multiple view geometry in computer vision (2004), section 6.3.1
class OrthographicCamera final : public CameraModel {
 public:
  explicit OrthographicCamera(const CameraIntrinsics& intrinsics)
      : CameraModel(intrinsics),
        fx_(intrinsics.parameters[0]),
        fy_(intrinsics.parameters[1]),
        cx_(intrinsics.parameters[2]),
        cy_(intrinsics.parameters[3]) {}

  bool is_central() const override { return false; }

  Vector3d ray_from_pixel(const Vector2d&) const override { return Vector3d::UnitZ(); }

  Vector3d origin_from_pixel(const Vector2d& pixel) const override {
    return {(pixel.x() - cx_) / fx_, (pixel.y() - cy_) / fy_, 0.0};
  }

  std::optional<Vector2d> pixel_from_ray(const Vector3d& point_camera) const override {
    if (!(point_camera.z() > 0.0) || !point_camera.allFinite()) return std::nullopt;
    return Vector2d(fx_ * point_camera.x() + cx_, fy_ * point_camera.y() + cy_);
  }

  Eigen::Matrix<double, 2, 3> pixel_jacobian(const Vector3d&) const override {
    Eigen::Matrix<double, 2, 3> jacobian;
    jacobian << fx_, 0.0, 0.0,  //
        0.0, fy_, 0.0;
    return jacobian;
  }

  double finest_pixels_per_radian() const override { return 0.0; }
  double finest_pixels_per_m() const override { return std::max(fx_, fy_); }

 private:
  double fx_, fy_, cx_, cy_;
};

}  // namespace

CameraModelInfo orthographic_camera() {
  return {.name = "orthographic",
          .summary = "Parallel rays; fx and fy are pixels a metre.",
          .parameters = {},
          .make = [](const CameraIntrinsics& intrinsics) -> std::unique_ptr<CameraModel> {
            return std::make_unique<OrthographicCamera>(intrinsics);
          }};
}

}  // namespace terracast::geo
