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
    CameraParameter{"xi", "Distance of the centre of projection from the sphere's.", 1.0, 0.0,
                    100.0},
    CameraParameter{"k1", "Radial distortion of r^2; negative pulls corners in (barrel)."},
    CameraParameter{"k2", "Radial distortion of r^4."},
    CameraParameter{"p1", "Decentring along y."}, CameraParameter{"p2", "Decentring along x."}};

/// Points of the unit sphere are projected from (0, 0, -xi) on a plane, (x, y) / (z + xi |p|), whose
/// points a lens moves.
/// domain   z > -xi |p| for xi <= 1, z > -|p| / xi beyond: the part of the sphere that is seen from
///          there; inside the distortion's disc
/// source   C. Mei, P. Rives, Single view point omnidirectional camera calibration from planar grids,
///          ICRA 2007; cv::omnidir; Kalibr's omni-radtan
class UnifiedCamera final : public PlaneCamera {
 public:
  explicit UnifiedCamera(const CameraIntrinsics& intrinsics)
      : PlaneCamera(intrinsics, PlaneDistortion({.k = {own(intrinsics, 1), own(intrinsics, 2)},
                                                 .p = {own(intrinsics, 3), own(intrinsics, 4)}},
                                                radius_of_plane(own(intrinsics, 0)))),
        xi_(own(intrinsics, 0)) {
    measure_finest();
  }

 private:
  static double radius_of_plane(double xi) {
    return xi > 1.0 ? 1.0 / std::sqrt(xi * xi - 1.0) : std::numeric_limits<double>::infinity();
  }

  std::optional<Vector2d> plane_from_ray(const Vector3d& ray) const override {
    const double length = ray.norm();
    const double least_z = -(xi_ > 1.0 ? 1.0 / xi_ : xi_) * length;
    if (!(ray.z() > least_z)) return std::nullopt;
    return Vector2d(ray.head<2>() / (ray.z() + xi_ * length));
  }

  Vector3d ray_from_plane(const Vector2d& place) const override {
    const double r2 = place.squaredNorm();
    const double share =
        (xi_ + std::sqrt(std::max(1.0 + (1.0 - xi_ * xi_) * r2, 0.0))) / (1.0 + r2);
    return Vector3d(share * place.x(), share * place.y(), share - xi_).normalized();
  }

  Eigen::Matrix<double, 2, 3> plane_jacobian(const Vector3d& ray) const override {
    const double length = ray.norm();
    const double below = ray.z() + xi_ * length;
    const Eigen::RowVector3d below_slope =
        Eigen::RowVector3d::UnitZ() + xi_ / length * ray.transpose();
    Eigen::Matrix<double, 2, 3> jacobian = -ray.head<2>() / (below * below) * below_slope;
    jacobian.leftCols<2>() += Eigen::Matrix2d::Identity() / below;
    return jacobian;
  }

  double xi_;
};

}  // namespace

CameraModelInfo unified_camera() {
  return {.name = "unified",
          .summary = "Sphere, then plane: mirrors and fisheyes (UCM, omni), Mei-Rives.",
          .parameters = kParameters,
          .make = [](const CameraIntrinsics& intrinsics) -> std::unique_ptr<CameraModel> {
            return std::make_unique<UnifiedCamera>(intrinsics);
          }};
}

}  // namespace terracast::geo
