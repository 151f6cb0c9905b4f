#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "geo/cameras/plane_camera.h"

namespace terracast::geo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;

/// Longitude and latitude of a sphere: atan2(x, z) to the right and atan2(y, |(x, z)|) down, fx and fy
/// pixels a radian.
/// domain   all rays but those straight up and down (no column is theirs); image points with longitudes
///          in (-pi, pi] and latitudes within pi / 2. The seam is straight behind the camera.
/// source   J. P. Snyder, Map projections: a working manual, USGS Professional Paper 1395 (1987), 12
class EquirectangularCamera final : public PlaneCamera {
 public:
  explicit EquirectangularCamera(const CameraIntrinsics& intrinsics)
      : PlaneCamera(intrinsics, PlaneDistortion(std::numeric_limits<double>::infinity())) {
    set_finest(std::max(intrinsics.parameters[0], intrinsics.parameters[1]));
  }

 private:
  std::optional<Vector2d> plane_from_ray(const Vector3d& ray) const override {
    const double level = std::hypot(ray.x(), ray.z());
    if (!(level > 0.0) || !std::isfinite(ray.y())) return std::nullopt;
    return Vector2d(std::atan2(ray.x(), ray.z()), std::atan2(ray.y(), level));
  }

  // Columns of the image's edges may pass the seam by a rounding.
  Vector3d ray_from_plane(const Vector2d& place) const override {
    constexpr double kRounding = 4.0 * std::numeric_limits<double>::epsilon();
    if (!(std::abs(place.x()) <= kPi + kRounding) ||
        !(std::abs(place.y()) <= 0.5 * kPi + kRounding))
      return Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
    return {std::cos(place.y()) * std::sin(place.x()), std::sin(place.y()),
            std::cos(place.y()) * std::cos(place.x())};
  }

  Eigen::Matrix<double, 2, 3> plane_jacobian(const Vector3d& ray) const override {
    const double level = std::hypot(ray.x(), ray.z());
    const double square = ray.squaredNorm();
    Eigen::Matrix<double, 2, 3> jacobian;
    jacobian << ray.z() / (level * level), 0.0, -ray.x() / (level * level),  //
        -ray.y() * ray.x() / (level * square), level / square,
        -ray.y() * ray.z() / (level * square);
    return jacobian;
  }
};

}  // namespace

CameraModelInfo equirectangular_camera() {
  return {.name = "equirectangular",
          .summary = "Longitude and latitude: the whole sphere, 360 by 180 deg.",
          .parameters = {},
          .make = [](const CameraIntrinsics& intrinsics) -> std::unique_ptr<CameraModel> {
            return std::make_unique<EquirectangularCamera>(intrinsics);
          },
          .whole_view = [](int width_px, int height_px) -> Vector2d {
            return Vector2d(width_px / (2.0 * kPi), height_px / kPi);
          }};
}

}  // namespace terracast::geo
