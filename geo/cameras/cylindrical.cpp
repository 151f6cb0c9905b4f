#include <cmath>
#include <limits>
#include <numbers>

#include "geo/cameras/plane_camera.h"

namespace terracast::geo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Central projection on an upright cylinder, unrolled: atan2(x, z) to the right, fx pixels a radian,
/// and y / |(x, z)| down, fy pixels being the cylinder's radius.
/// domain   all rays but those straight up and down; image points with angles in (-pi, pi]. The seam is
///          straight behind the camera.
/// source   R. Szeliski, Image alignment and stitching: a tutorial, Foundations and Trends in Computer
///          Graphics and Vision 2 (2006), section 2.4
class CylindricalCamera final : public PlaneCamera {
 public:
  explicit CylindricalCamera(const CameraIntrinsics& intrinsics)
      : PlaneCamera(intrinsics, PlaneDistortion(std::numeric_limits<double>::infinity())) {
    measure_finest();
  }

 private:
  std::optional<Vector2d> plane_from_ray(const Vector3d& ray) const override {
    const double level = std::hypot(ray.x(), ray.z());
    if (!(level > 0.0) || !std::isfinite(ray.y())) return std::nullopt;
    return Vector2d(std::atan2(ray.x(), ray.z()), ray.y() / level);
  }

  // Columns of the image's edges may pass the seam by a rounding.
  Vector3d ray_from_plane(const Vector2d& place) const override {
    constexpr double kRounding = 4.0 * std::numeric_limits<double>::epsilon();
    if (!(std::abs(place.x()) <= std::numbers::pi + kRounding))
      return Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
    return Vector3d(std::sin(place.x()), place.y(), std::cos(place.x())).normalized();
  }

  Eigen::Matrix<double, 2, 3> plane_jacobian(const Vector3d& ray) const override {
    const double level = std::hypot(ray.x(), ray.z());
    const double cube = level * level * level;
    Eigen::Matrix<double, 2, 3> jacobian;
    jacobian << ray.z() / (level * level), 0.0, -ray.x() / (level * level),  //
        -ray.y() * ray.x() / cube, 1.0 / level, -ray.y() * ray.z() / cube;
    return jacobian;
  }
};

}  // namespace

CameraModelInfo cylindrical_camera() {
  return {.name = "cylindrical",
          .summary = "Central projection on an upright cylinder: panoramas up to 360 deg.",
          .parameters = {},
          .make = [](const CameraIntrinsics& intrinsics) -> std::unique_ptr<CameraModel> {
            return std::make_unique<CylindricalCamera>(intrinsics);
          },
          .whole_view = [](int width_px, int) -> Vector2d {
            const double px_per_rad = width_px / (2.0 * std::numbers::pi);
            return Vector2d(px_per_rad, px_per_rad);
          }};
}

}  // namespace terracast::geo
