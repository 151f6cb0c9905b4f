#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "validate/camera_plane.h"
#include "validate/lens.h"

/// The validator's own frames and projection. It shares no code with the rest of the program, so
/// that an error of sign there cannot hide here.
namespace terracast::validate {

constexpr double kPi = 3.14159265358979323846;
constexpr double degrees_from_radians(double angle_rad) { return angle_rad * (180.0 / kPi); }
constexpr double radians_from_degrees(double angle_deg) { return angle_deg * (kPi / 180.0); }

/// A pinhole camera, with the lens of one of COLMAP's models or none; or a camera of any model. Camera frame: x right,
/// y down, z forward; the centre of the top-left pixel is (0.5, 0.5).
///
/// Distances are what the images hold: along the optical axis (depth), and of a camera with a `plane` along each
/// pixel's own ray from where that starts (range).
struct Intrinsics {
  int width_px = 0;
  int height_px = 0;
  double fx_px = 0.0;
  double fy_px = 0.0;
  double cx_px = 0.0;
  double cy_px = 0.0;
  Lens lens = {};
  std::shared_ptr<const CameraPlane> plane = nullptr;
  /// Places before the lens that are farther from the axis are in no pixel: a lens that folds the plane brings some of
  /// them back into the image, by its formula alone.
  double reach = std::numeric_limits<double>::infinity();

  /// The point of the ray through `pixel` at distance 1 from its origin; NaN where no ray comes in.
  Eigen::Vector3d ray_from_pixel(const Eigen::Vector2d& pixel) const {
    if (plane) return plane->ray_from_place(place_from_pixel(pixel));
    if (lens.kind != Lens::Kind::None)
      return lens.undistorted(place_from_pixel(pixel)).homogeneous();
    return place_from_pixel(pixel).homogeneous();
  }
  /// Where that ray starts.
  Eigen::Vector3d origin_from_pixel(const Eigen::Vector2d& pixel) const {
    return plane ? plane->origin_from_place(place_from_pixel(pixel)) : Eigen::Vector3d::Zero();
  }
  /// The point that stands at a distance on the ray through `pixel`.
  Eigen::Vector3d point_from_pixel(const Eigen::Vector2d& pixel, double distance_m) const {
    const Eigen::Vector3d along = ray_from_pixel(pixel) * distance_m;
    if (!plane || plane->is_central()) return along;
    return origin_from_pixel(pixel) + along;
  }
  /// Where a point that the camera sees stands in the image; of one that it does not see NaN, or anything.
  Eigen::Vector2d pixel_from_point(const Eigen::Vector3d& point_camera) const {
    if (plane) {
      const std::optional<Eigen::Vector2d> place = plane->place_from_point(point_camera);
      return place ? pixel_from_place(*place)
                   : Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
    }
    if (lens.kind != Lens::Kind::None) {
      const Eigen::Vector2d place = point_camera.hnormalized();
      if (place.norm() > reach)
        return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
      return pixel_from_place(lens.distorted(place));
    }
    return {fx_px * point_camera.x() / point_camera.z() + cx_px,
            fy_px * point_camera.y() / point_camera.z() + cy_px};
  }
  /// How far a point is, as the images measure it; not above 0 where the camera does not see it.
  /// pixel   where pixel_from_point has it
  double distance_m(const Eigen::Vector3d& point_camera, const Eigen::Vector2d& pixel) const {
    if (!plane && lens.kind == Lens::Kind::None) return point_camera.z();
    if (!pixel.allFinite()) return 0.0;
    return plane ? plane->distance_m(point_camera) : point_camera.z();
  }
  double distance_m(const Eigen::Vector3d& point_camera) const {
    return plane ? distance_m(point_camera, pixel_from_point(point_camera)) : point_camera.z();
  }
  /// What the distance of a point that is seen changes by.
  Eigen::RowVector3d distance_gradient(const Eigen::Vector3d& point_camera) const {
    if (plane) return plane->distance_gradient(point_camera).transpose();
    return Eigen::RowVector3d::UnitZ();
  }
  /// Sets `reach`, of a lens of which the whole border of the image shows something.
  void find_reach();
  /// The way from one image point to another; of images that join at their ends the shorter one.
  Eigen::Vector2d way_px(const Eigen::Vector2d& from, const Eigen::Vector2d& to) const {
    Eigen::Vector2d way = to - from;
    const double turn_px = plane ? plane->turn() * fx_px : 0.0;
    if (turn_px > 0.0) way.x() = std::remainder(way.x(), turn_px);
    return way;
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
  bool operator==(const Intrinsics& other) const {
    return width_px == other.width_px && height_px == other.height_px && fx_px == other.fx_px &&
           fy_px == other.fy_px && cx_px == other.cx_px && cy_px == other.cy_px &&
           lens == other.lens &&
           (plane == other.plane || (plane && other.plane && *plane == *other.plane));
  }

 private:
  Eigen::Vector2d place_from_pixel(const Eigen::Vector2d& pixel) const {
    return {(pixel.x() - cx_px) / fx_px, (pixel.y() - cy_px) / fy_px};
  }
  Eigen::Vector2d pixel_from_place(const Eigen::Vector2d& place) const {
    return {fx_px * place.x() + cx_px, fy_px * place.y() + cy_px};
  }
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
/// The attitude in the middle between two, along the shorter turn.
Eigen::Matrix3d halfway(const Eigen::Matrix3d& from, const Eigen::Matrix3d& to);

}  // namespace terracast::validate
