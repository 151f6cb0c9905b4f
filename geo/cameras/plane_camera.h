#pragma once

#include <Eigen/Core>
#include <optional>

#include "geo/camera_model.h"
#include "geo/cameras/plane_distortion.h"

namespace terracast::geo {

/// A model that takes points of the camera frame to a plane of its own, whose points a lens moves, and
/// scales that plane to pixels: u = fx x' + cx, v = fy y' + cy. A model says how points come to the
/// plane.
class PlaneCamera : public CameraModel {
 public:
  Eigen::Vector3d ray_from_pixel(const Eigen::Vector2d& pixel) const final;
  std::optional<Eigen::Vector2d> pixel_from_ray(const Eigen::Vector3d& ray_camera) const final;
  Eigen::Matrix<double, 2, 3> pixel_jacobian(const Eigen::Vector3d& ray_camera) const final;
  double finest_pixels_per_radian() const final { return finest_pixels_per_radian_; }

 protected:
  PlaneCamera(const CameraIntrinsics& intrinsics, const PlaneDistortion& distortion);

  /// Parameters that follow on fx, fy, cx, cy.
  static double own(const CameraIntrinsics& intrinsics, std::size_t index) {
    return intrinsics.parameters[4 + index];
  }

  /// Where a point comes to lie in the plane; nothing beyond the model's domain.
  virtual std::optional<Eigen::Vector2d> plane_from_ray(const Eigen::Vector3d& ray) const = 0;
  /// Direction of the ray that comes to lie there; NaN where there is none.
  virtual Eigen::Vector3d ray_from_plane(const Eigen::Vector2d& place) const = 0;
  /// d plane / d ray.
  virtual Eigen::Matrix<double, 2, 3> plane_jacobian(const Eigen::Vector3d& ray) const = 0;

  Eigen::Vector2d plane_from_pixel(const Eigen::Vector2d& pixel) const {
    return {(pixel.x() - cx_) / fx_, (pixel.y() - cy_) / fy_};
  }

  /// To be called once by each model's constructor: the most pixels that a radian spans anywhere in
  /// the image, found on a grid and refined about its best places.
  void measure_finest();
  void set_finest(double pixels_per_radian) { finest_pixels_per_radian_ = pixels_per_radian; }

 private:
  double pixels_per_radian(const Eigen::Vector2d& pixel) const;

  double fx_, fy_, cx_, cy_;
  PlaneDistortion distortion_;
  double finest_pixels_per_radian_ = 0.0;
};

}  // namespace terracast::geo
