#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "geo/cameras/plane_camera.h"

namespace terracast::geo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::array kParameters = {CameraParameter{
    "omega", "Field of view of the ideal fisheye lens, in radians.", 1.0, 1e-3, 3.14}};

/// The distance from the centre is atan(2 tan(t) tan(omega / 2)) / omega, t being the angle from the
/// axis.
/// domain   z > 0
/// source   F. Devernay, O. Faugeras, Straight lines have to be straight, Machine Vision and
///          Applications 13 (2001); FOV of COLMAP
class FovCamera final : public PlaneCamera {
 public:
  explicit FovCamera(const CameraIntrinsics& intrinsics)
      : PlaneCamera(intrinsics, PlaneDistortion(0.5 * std::numbers::pi / own(intrinsics, 0))),
        omega_(own(intrinsics, 0)),
        spread_(2.0 * std::tan(0.5 * omega_)) {
    measure_finest();
  }

 private:
  std::optional<Vector2d> plane_from_ray(const Vector3d& ray) const override {
    if (!(ray.z() > 0.0)) return std::nullopt;
    const double from_axis = std::hypot(ray.x(), ray.y());
    return radius_over(from_axis, ray.z()) * ray.head<2>();
  }

  Vector3d ray_from_plane(const Vector2d& place) const override {
    const double radius = place.norm();
    if (radius == 0.0) return Vector3d::UnitZ();
    const double angle = omega_ * radius;
    const double across = std::sin(angle) / radius;
    return Vector3d(across * place.x(), across * place.y(), spread_ * std::cos(angle)).normalized();
  }

  Eigen::Matrix<double, 2, 3> plane_jacobian(const Vector3d& ray) const override {
    const double from_axis = std::hypot(ray.x(), ray.y());
    const Vector2d outward = from_axis > 0.0 ? Vector2d(ray.head<2>() / from_axis) : Vector2d(0, 0);
    const double over = radius_over(from_axis, ray.z());
    const double rate =
        spread_ / (omega_ * (ray.z() * ray.z() + spread_ * spread_ * from_axis * from_axis));
    Eigen::Matrix<double, 2, 3> jacobian;
    jacobian.leftCols<2>() = over * Eigen::Matrix2d::Identity() +
                             (rate * ray.z() - over) * outward * outward.transpose();
    jacobian.col(2) = -rate * from_axis * outward;
    return jacobian;
  }

  /// Distance from the centre over that from the axis.
  double radius_over(double from_axis, double z) const {
    if (from_axis == 0.0) return spread_ / (omega_ * z);
    return std::atan2(spread_ * from_axis, z) / (omega_ * from_axis);
  }

  double omega_;
  double spread_;
};

}  // namespace

CameraModelInfo fov_camera() {
  return {.name = "fov",
          .summary = "Fisheye of one parameter, its field of view, Devernay-Faugeras.",
          .parameters = kParameters,
          .make = [](const CameraIntrinsics& intrinsics) -> std::unique_ptr<CameraModel> {
            return std::make_unique<FovCamera>(intrinsics);
          }};
}

}  // namespace terracast::geo
