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
    CameraParameter{"xi", "Distance between the centres of the spheres.", 0.0, -0.999, 10.0},
    CameraParameter{"alpha", "From 0, a pinhole, to 1, projection from the second sphere alone.",
                    0.5, 0.0, 1.0}};

/// (x, y) / (alpha d2 + (1 - alpha) z2) with z2 = xi d1 + z, d1 = |(x, y, z)|, d2 = |(x, y, z2)|.
/// domain   z2 > -w1 d2 with w1 = alpha / (1 - alpha), or its inverse where alpha > 1/2: as far as the
///          second sphere is seen at one place, which is where the inverse ends; with xi > 1 also
///          xi z > -d1, the half of the first sphere that the second centre sees
/// source   V. Usenko, N. Demmel, D. Cremers, The double sphere camera model, 3DV 2018, section 3 (its
///          bound on z / d1 ends earlier than its inverse); Kalibr's ds-none
class DoubleSphereCamera final : public PlaneCamera {
 public:
  explicit DoubleSphereCamera(const CameraIntrinsics& intrinsics)
      : PlaneCamera(intrinsics, PlaneDistortion(radius_of_plane(own(intrinsics, 1)))),
        xi_(own(intrinsics, 0)),
        alpha_(own(intrinsics, 1)) {
    farthest_back_ = alpha_ > 0.5 ? (1.0 - alpha_) / alpha_ : alpha_ / (1.0 - alpha_);
    measure_finest();
  }

 private:
  static double radius_of_plane(double alpha) {
    return alpha > 0.5 ? 1.0 / std::sqrt(2.0 * alpha - 1.0)
                       : std::numeric_limits<double>::infinity();
  }

  std::optional<Vector2d> plane_from_ray(const Vector3d& ray) const override {
    const double d1 = ray.norm();
    const double z2 = xi_ * d1 + ray.z();
    const double d2 = std::sqrt(ray.head<2>().squaredNorm() + z2 * z2);
    if (!(z2 > -farthest_back_ * d2) || !(xi_ * ray.z() > -d1)) return std::nullopt;
    return Vector2d(ray.head<2>() / below(ray, d1));
  }

  Vector3d ray_from_plane(const Vector2d& place) const override {
    const double r2 = place.squaredNorm();
    const double z =
        (1.0 - alpha_ * alpha_ * r2) /
        (alpha_ * std::sqrt(std::max(1.0 - (2.0 * alpha_ - 1.0) * r2, 0.0)) + 1.0 - alpha_);
    const double share = (z * xi_ + std::sqrt(z * z + (1.0 - xi_ * xi_) * r2)) / (z * z + r2);
    return Vector3d(share * place.x(), share * place.y(), share * z - xi_).normalized();
  }

  Eigen::Matrix<double, 2, 3> plane_jacobian(const Vector3d& ray) const override {
    const double d1 = ray.norm();
    const double z2 = xi_ * d1 + ray.z();
    const double d2 = std::sqrt(ray.head<2>().squaredNorm() + z2 * z2);
    const double under = below(ray, d1);
    const Eigen::RowVector3d z2_slope = xi_ / d1 * ray.transpose() + Eigen::RowVector3d::UnitZ();
    const Eigen::RowVector3d d2_slope =
        (Eigen::RowVector3d(ray.x(), ray.y(), 0.0) + z2 * z2_slope) / d2;
    Eigen::Matrix<double, 2, 3> jacobian =
        -ray.head<2>() / (under * under) * (alpha_ * d2_slope + (1.0 - alpha_) * z2_slope);
    jacobian.leftCols<2>() += Eigen::Matrix2d::Identity() / under;
    return jacobian;
  }

  double below(const Vector3d& ray, double d1) const {
    const double z2 = xi_ * d1 + ray.z();
    const double d2 = std::sqrt(ray.head<2>().squaredNorm() + z2 * z2);
    return alpha_ * d2 + (1.0 - alpha_) * z2;
  }

  double xi_;
  double alpha_;
  double farthest_back_ = 0.0;  ///< -z2 / d2 at the rim
};

}  // namespace

CameraModelInfo double_sphere_camera() {
  return {.name = "double_sphere",
          .summary = "Two spheres, then plane: fisheyes beyond 180 deg, Usenko.",
          .parameters = kParameters,
          .make = [](const CameraIntrinsics& intrinsics) -> std::unique_ptr<CameraModel> {
            return std::make_unique<DoubleSphereCamera>(intrinsics);
          }};
}

}  // namespace terracast::geo
