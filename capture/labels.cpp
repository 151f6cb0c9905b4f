#include "capture/labels.h"

#include <cmath>
#include <limits>

namespace terracast::capture {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

std::optional<Vector2d> moved(const CameraView& from, const geo::CameraModel& to,
                              const geo::Rigid3d& to_from_from, const Vector2d& pixel,
                              double range_m) {
  if (std::isnan(range_m)) return std::nullopt;
  const Vector3d ray = from.model.ray_from_pixel(pixel);
  const Vector3d ray_to = std::isinf(range_m)
                              ? Vector3d(to_from_from.rotation * ray)
                              : Vector3d(to_from_from * (ray * (range_m / ray.norm())));
  const std::optional<Vector2d> target = to.pixel_from_ray(ray_to);
  if (!target) return std::nullopt;
  return Vector2d(*target - pixel);
}

}  // namespace

// The two centres are subtracted first: both lie up to 50 km from the world's origin, and what they have in
// common would cost the digits of their difference.
geo::Rigid3d to_from(const CameraView& to, const CameraView& from) {
  const geo::Rigid3d& world_from_to = to.world_from_camera;
  const geo::Rigid3d& world_from_from = from.world_from_camera;
  const Eigen::Quaterniond to_from_world = world_from_to.rotation.conjugate();
  return {(to_from_world * world_from_from.rotation).normalized(),
          to_from_world * (world_from_from.translation - world_from_to.translation)};
}

double depth_from_range(const geo::CameraModel& model, const Vector2d& pixel, double range_m) {
  if (std::isinf(range_m)) return range_m;
  const Vector3d ray = model.ray_from_pixel(pixel);
  return range_m * (ray.z() / ray.norm());
}

Vector3d point_world(const CameraView& view, const Vector2d& pixel, double range_m) {
  const Vector3d ray = view.model.ray_from_pixel(pixel);
  return view.world_from_camera * (ray * (range_m / ray.norm()));
}

std::optional<Vector2d> project(const CameraView& view, const Vector3d& point_world) {
  const geo::Rigid3d& pose = view.world_from_camera;
  return view.model.pixel_from_ray(pose.rotation.conjugate() * (point_world - pose.translation));
}

std::optional<Vector2d> flow(const CameraView& from, const CameraView& to, const Vector2d& pixel,
                             double range_m) {
  return moved(from, to.model, to_from(to, from), pixel, range_m);
}

core::ImageF depth_image(const geo::CameraModel& model, const core::ImageF& range_m) {
  core::ImageF depth_m(range_m.width(), range_m.height());
  for (int y = 0; y < range_m.height(); ++y)
    for (int x = 0; x < range_m.width(); ++x)
      depth_m(x, y) = static_cast<float>(
          depth_from_range(model, pixel_center(x, y), static_cast<double>(range_m(x, y))));
  return depth_m;
}

core::ImageF flow_image(const CameraView& from, const CameraView& to, const core::ImageF& range_m) {
  const geo::Rigid3d to_from_from = to_from(to, from);
  core::ImageF image(range_m.width(), range_m.height(), 2, std::numeric_limits<float>::quiet_NaN());
  for (int y = 0; y < range_m.height(); ++y) {
    for (int x = 0; x < range_m.width(); ++x) {
      const std::optional<Vector2d> motion_px = moved(
          from, to.model, to_from_from, pixel_center(x, y), static_cast<double>(range_m(x, y)));
      if (!motion_px) continue;
      image(x, y, 0) = static_cast<float>(motion_px->x());
      image(x, y, 1) = static_cast<float>(motion_px->y());
    }
  }
  return image;
}

core::ImageF disparity_image(const geo::CameraModel& left, double baseline_m,
                             const core::ImageF& range_m) {
  // A pinhole's first parameter; a rectified pair has no other model.
  TERRACAST_CHECK(left.intrinsics().model == "pinhole", "disparity of a {} camera",
                  left.intrinsics().model);
  const double focal_length_px = left.intrinsics().parameters[0];
  core::ImageF disparity_px(range_m.width(), range_m.height());
  for (int y = 0; y < range_m.height(); ++y) {
    for (int x = 0; x < range_m.width(); ++x) {
      const double depth_m =
          depth_from_range(left, pixel_center(x, y), static_cast<double>(range_m(x, y)));
      disparity_px(x, y) = static_cast<float>(focal_length_px * baseline_m / depth_m);
    }
  }
  return disparity_px;
}

}  // namespace terracast::capture
