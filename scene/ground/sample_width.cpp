#include "scene/ground/sample_width.h"

namespace terracast::scene {
namespace {

/// The angle that a pixel spans.
double pixel_angle(const geo::CameraModel& model, const Eigen::Vector2d& center) {
  const Eigen::Vector3d here = model.ray_from_pixel(center).normalized();
  const Eigen::Vector3d right =
      model.ray_from_pixel(center + Eigen::Vector2d(1.0, 0.0)).normalized();
  const Eigen::Vector3d below =
      model.ray_from_pixel(center + Eigen::Vector2d(0.0, 1.0)).normalized();
  const double pixel = std::sqrt((right - here).norm() * (below - here).norm());
  return std::isfinite(pixel) ? pixel : 1.0 / model.finest_pixels_per_radian();
}

}  // namespace

SampleWidth sample_width(const geo::CameraModel& model, const Eigen::Vector2d& here, double share) {
  if (model.is_central()) return {.angle_rad = pixel_angle(model, here) * share};
  SampleWidth width;
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d beside = here + Eigen::Vector2d::Unit(axis);
    width.start_m[axis] =
        share * (model.origin_from_pixel(beside) - model.origin_from_pixel(here)).norm();
    width.growth[axis] = share * (model.ray_from_pixel(beside).normalized() -
                                  model.ray_from_pixel(here).normalized())
                                     .norm();
  }
  return width;
}

}  // namespace terracast::scene
