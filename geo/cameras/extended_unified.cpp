#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "geo/cameras/plane_camera.h"

namespace terracast::geo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::array kParameters = {
    CameraParameter{"alpha", "From 0, a pinhole, to 1, projection from the surface alone.", 0.5,
                    0.0, 1.0},
    CameraParameter{"beta", "Shape of the ellipsoid; 1 is a sphere.", 1.0, 1e-3, 1e3}};

/// (x, y) / (alpha d + (1 - alpha) z) with d = sqrt(beta (x^2 + y^2) + z^2).
/// domain   z > -w d with w = alpha / (1 - alpha), or its inverse where alpha > 1/2
/// source   B. Khomutenko, G. Garcia, P. Martinet, An enhanced unified camera model, IEEE Robotics and
///          Automation Letters 1 (2016); V. Usenko, N. Demmel, D. Cremers, The double sphere camera
///          model, 3DV 2018, section 2.3; Kalibr's eucm-none
class ExtendedUnifiedCamera final : public PlaneCamera {
 public:
  explicit ExtendedUnifiedCamera(const CameraIntrinsics& intrinsics)
      : PlaneCamera(intrinsics,
                    PlaneDistortion(radius_of_plane(own(intrinsics, 0), own(intrinsics, 1)))),
        alpha_(own(intrinsics, 0)),
        beta_(own(intrinsics, 1)),
        farthest_back_(alpha_ > 0.5 ? (1.0 - alpha_) / alpha_ : alpha_ / (1.0 - alpha_)) {
    measure_finest();
  }

 private:
  static double radius_of_plane(double alpha, double beta) {
    return alpha > 0.5 ? 1.0 / std::sqrt(beta * (2.0 * alpha - 1.0))
                       : std::numeric_limits<double>::infinity();
  }

  double distance(const Vector3d& ray) const {
    return std::sqrt(beta_ * ray.head<2>().squaredNorm() + ray.z() * ray.z());
  }

  std::optional<Vector2d> plane_from_ray(const Vector3d& ray) const override {
    const double d = distance(ray);
    if (!(ray.z() > -farthest_back_ * d)) return std::nullopt;
    return Vector2d(ray.head<2>() / (alpha_ * d + (1.0 - alpha_) * ray.z()));
  }

  Vector3d ray_from_plane(const Vector2d& place) const override {
    const double r2 = place.squaredNorm();
    const double z =
        (1.0 - beta_ * alpha_ * alpha_ * r2) /
        (alpha_ * std::sqrt(std::max(1.0 - (2.0 * alpha_ - 1.0) * beta_ * r2, 0.0)) + 1.0 - alpha_);
    return Vector3d(place.x(), place.y(), z).normalized();
  }

  Eigen::Matrix<double, 2, 3> plane_jacobian(const Vector3d& ray) const override {
    const double d = distance(ray);
    const double below = alpha_ * d + (1.0 - alpha_) * ray.z();
    const Eigen::RowVector3d below_slope(alpha_ * beta_ * ray.x() / d, alpha_ * beta_ * ray.y() / d,
                                         alpha_ * ray.z() / d + 1.0 - alpha_);
    Eigen::Matrix<double, 2, 3> jacobian = -ray.head<2>() / (below * below) * below_slope;
    jacobian.leftCols<2>() += Eigen::Matrix2d::Identity() / below;
    return jacobian;
  }

  double alpha_;
  double beta_;
  double farthest_back_;
};

}  // namespace

CameraModelInfo extended_unified_camera() {
  return {.name = "extended_unified",
          .summary = "Ellipsoid, then plane: fisheyes (EUCM), Khomutenko.",
          .parameters = kParameters,
          .make = [](const CameraIntrinsics& intrinsics) -> std::unique_ptr<CameraModel> {
            return std::make_unique<ExtendedUnifiedCamera>(intrinsics);
          }};
}

}  // namespace terracast::geo
