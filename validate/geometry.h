#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

#include "validate/lens.h"

/// The validator's own frames and projection. It shares no code with the rest of the program, so
/// that an error of sign there cannot hide here.
namespace terracast::validate {

constexpr double kPi = 3.14159265358979323846;
constexpr double degrees_from_radians(double angle_rad) { return angle_rad * (180.0 / kPi); }
constexpr double radians_from_degrees(double angle_deg) { return angle_deg * (kPi / 180.0); }

/// A pinhole camera, with the lens of one of COLMAP's models or none. Camera frame: x right, y down, z
/// forward; the centre of the top-left pixel is (0.5, 0.5).
struct Intrinsics {
  int width_px = 0;
  int height_px = 0;
  double fx_px = 0.0;
  double fy_px = 0.0;
  double cx_px = 0.0;
  double cy_px = 0.0;
  Lens lens = {};

  /// The point of the ray through `pixel` at depth 1; NaN where a lens lets none in.
  Eigen::Vector3d ray_from_pixel(const Eigen::Vector2d& pixel) const {
    if (lens.kind != Lens::Kind::None)
      return lens.undistorted({(pixel.x() - cx_px) / fx_px, (pixel.y() - cy_px) / fy_px})
          .homogeneous();
    return {(pixel.x() - cx_px) / fx_px, (pixel.y() - cy_px) / fy_px, 1.0};
  }
  /// Where a point before the camera (z > 0) stands in the image.
  Eigen::Vector2d pixel_from_point(const Eigen::Vector3d& point_camera) const {
    if (lens.kind != Lens::Kind::None) {
      const Eigen::Vector2d place = lens.distorted(point_camera.hnormalized());
      return {fx_px * place.x() + cx_px, fy_px * place.y() + cy_px};
    }
    return {fx_px * point_camera.x() / point_camera.z() + cx_px,
            fy_px * point_camera.y() / point_camera.z() + cy_px};
  }
  bool contains(const Eigen::Vector2d& pixel, double margin_px = 0.0) const {
    return pixel.x() >= margin_px && pixel.y() >= margin_px && pixel.x() < width_px - margin_px &&
           pixel.y() < height_px - margin_px;
  }
  /// Whether it can be computed with: a size and focal lengths above 0, all finite.
  bool is_sound() const {
    return width_px > 0 && height_px > 0 && std::isfinite(fx_px) && std::isfinite(fy_px) &&
           std::isfinite(cx_px) && std::isfinite(cy_px) && fx_px > 0.0 && fy_px > 0.0;
  }
  bool operator==(const Intrinsics&) const = default;
};

/// A rigid motion target_from_source: v_target = rotation * v_source + translation.
struct Pose {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const;
  Pose operator*(const Pose& other) const;
  Pose inverse() const;
};

/// Angle of a rotation, rad; exact also where it is tiny (arccos of the trace would lose it below
/// 1e-8).
double rotation_angle_rad(const Eigen::Matrix3d& rotation);

/// The rotation vector (axis times angle, rad) of a rotation by less than pi.
Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& rotation);

}  // namespace terracast::validate
