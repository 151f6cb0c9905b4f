#include "capture/labels.h"

#include <cmath>
#include <limits>

#include "capture/frame.h"
#include "core/error.h"
#include "core/instance_id.h"

namespace terracast::capture {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Of a point at a range along the ray of an image point, or of its direction, the image point in another
/// camera.
std::optional<Vector2d> seen_at(const geo::CameraModel& from, const geo::CameraModel& to,
                                const geo::Rigid3d& to_from_from, const Vector2d& pixel,
                                double range_m) {
  if (std::isnan(range_m)) return std::nullopt;
  if (std::isfinite(range_m))
    return to.pixel_from_ray(to_from_from * point_camera(from, pixel, range_m));
  if (!to.is_central()) return std::nullopt;
  return to.pixel_from_ray(to_from_from.rotation * from.ray_from_pixel(pixel));
}

// The two centres are subtracted first: both lie up to 50 km from the world's origin, and what they have in
// common would cost the digits of their difference.
geo::Rigid3d to_from_poses(const geo::Rigid3d& world_from_to, const geo::Rigid3d& world_from_from) {
  const Eigen::Quaterniond to_from_world = world_from_to.rotation.conjugate();
  return {(to_from_world * world_from_from.rotation).normalized(),
          to_from_world * (world_from_from.translation - world_from_to.translation)};
}

/// Where the flow of image points of one view ends in another.
class FlowEnds {
 public:
  FlowEnds(const CameraView& from, const CameraView& to)
      : from_(from), to_(to), to_from_from_(to_from(to, from)) {}

  /// motion   of what the pixel shows; null: it stands still
  std::optional<Vector2d> flow(const Vector2d& pixel, double range_m,
                               const BodyMotion* motion = nullptr) const {
    const std::optional<Vector2d> end =
        motion == nullptr ? end_of(pixel, range_m) : end_of_moving(pixel, range_m, *motion);
    if (!end) return std::nullopt;
    return Vector2d(*end - pixel);
  }

 private:
  std::optional<Vector2d> end_of_moving(const Vector2d& pixel, double range_m,
                                        const BodyMotion& motion) const {
    if (!motion.to || !std::isfinite(range_m)) return std::nullopt;
    const double from_s = from_.offset_of_line_s(pixel);
    const geo::Rigid3d world_from_body = motion.from.pose_after(from_s);
    const Vector3d point_body =
        world_from_body.rotation.conjugate() *
        (capture::point_world(from_, pixel, range_m) - world_from_body.translation);
    return project(to_, *motion.to, point_body);
  }

  std::optional<Vector2d> end_of(const Vector2d& pixel, double range_m) const {
    if (!from_.motion && !to_.motion)
      return seen_at(from_.model, to_.model, to_from_from_, pixel, range_m);
    const geo::Rigid3d world_from_from = from_.pose_of_line(pixel);
    const auto seen_when = [&](const geo::Rigid3d& world_from_to) {
      return seen_at(from_.model, to_.model, to_from_poses(world_from_to, world_from_from), pixel,
                     range_m);
    };
    if (!to_.motion) return seen_when(to_.world_from_camera);
    const auto seen = geo::find_seen(
        to_.motion->shutter, to_.model.width_px(), to_.model.height_px(),
        [&](double offset_s) { return seen_when(to_.motion->world_from_camera(offset_s)); });
    if (!seen) return std::nullopt;
    return seen->pixel;
  }

  const CameraView& from_;
  const CameraView& to_;
  geo::Rigid3d to_from_from_;
};

/// motion_of   (x, y) -> const BodyMotion*: of what a pixel shows
template <class MotionOf>
core::ImageF image_of_flow(const CameraView& from, const CameraView& to,
                           const core::ImageF& range_m, const MotionOf& motion_of) {
  const FlowEnds ends(from, to);
  core::ImageF image(range_m.width(), range_m.height(), 2, std::numeric_limits<float>::quiet_NaN());
  for (int y = 0; y < range_m.height(); ++y) {
    for (int x = 0; x < range_m.width(); ++x) {
      const std::optional<Vector2d> motion_px =
          ends.flow(pixel_center(x, y), static_cast<double>(range_m(x, y)), motion_of(x, y));
      if (!motion_px) continue;
      image(x, y, 0) = static_cast<float>(motion_px->x());
      image(x, y, 1) = static_cast<float>(motion_px->y());
    }
  }
  return image;
}

}  // namespace

double CameraView::offset_of_line_s(const Vector2d& pixel) const {
  if (!motion) return 0.0;
  return motion->shutter.offset_s(pixel, model.width_px(), model.height_px());
}

geo::Rigid3d CameraView::pose_of_line(const Vector2d& pixel) const {
  if (!motion) return world_from_camera;
  return motion->world_from_camera(offset_of_line_s(pixel));
}

CameraView view_of(const geo::CameraModel& model, const CameraCalibration& camera,
                   const geo::BodyState& state) {
  CameraView view{.model = model,
                  .world_from_camera = state.world_from_body * camera.body_from_camera()};
  if (camera.shutter.is_rolling())
    view.motion = geo::CameraMotion{
        .state = state, .body_from_camera = camera.body_from_camera(), .shutter = camera.shutter};
  return view;
}

geo::Rigid3d to_from(const CameraView& to, const CameraView& from) {
  return to_from_poses(to.world_from_camera, from.world_from_camera);
}

double depth_from_range(const geo::CameraModel& model, const Vector2d& pixel, double range_m) {
  if (std::isinf(range_m)) return range_m;
  const Vector3d ray = model.ray_from_pixel(pixel);
  return range_m * (ray.z() / ray.norm());
}

Vector3d point_camera(const geo::CameraModel& model, const Vector2d& pixel, double range_m) {
  const Vector3d ray = model.ray_from_pixel(pixel);
  const Vector3d way = ray * (range_m / ray.norm());
  if (model.is_central()) return way;
  return model.origin_from_pixel(pixel) + way;
}

Vector3d point_world(const CameraView& view, const Vector2d& pixel, double range_m) {
  return view.pose_of_line(pixel) * point_camera(view.model, pixel, range_m);
}

std::optional<Vector2d> project(const CameraView& view, const Vector3d& point_world) {
  const auto seen_from = [&](const geo::Rigid3d& pose) {
    return view.model.pixel_from_ray(pose.rotation.conjugate() * (point_world - pose.translation));
  };
  if (!view.motion) return seen_from(view.world_from_camera);
  const auto seen = geo::find_seen(
      view.motion->shutter, view.model.width_px(), view.model.height_px(),
      [&](double offset_s) { return seen_from(view.motion->world_from_camera(offset_s)); });
  if (!seen) return std::nullopt;
  return seen->pixel;
}

std::optional<Vector2d> project(const CameraView& view, const geo::BodyState& body,
                                const Vector3d& point_body) {
  const auto seen_when = [&](const geo::Rigid3d& world_from_camera, double offset_s) {
    return view.model.pixel_from_ray(
        world_from_camera.rotation.conjugate() *
        (body.pose_after(offset_s) * point_body - world_from_camera.translation));
  };
  if (!view.motion) return seen_when(view.world_from_camera, 0.0);
  const auto seen = geo::find_seen(
      view.motion->shutter, view.model.width_px(), view.model.height_px(), [&](double offset_s) {
        return seen_when(view.motion->world_from_camera(offset_s), offset_s);
      });
  if (!seen) return std::nullopt;
  return seen->pixel;
}

std::optional<Vector2d> flow(const CameraView& from, const CameraView& to, const Vector2d& pixel,
                             double range_m) {
  return FlowEnds(from, to).flow(pixel, range_m);
}

std::optional<Vector2d> flow(const CameraView& from, const CameraView& to, const BodyMotion& motion,
                             const Vector2d& pixel, double range_m) {
  return FlowEnds(from, to).flow(pixel, range_m, &motion);
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
  return image_of_flow(from, to, range_m, [](int, int) { return nullptr; });
}

core::ImageF flow_image(const CameraView& from, const CameraView& to, const BodyMotions& motions,
                        const CameraFrame& facts) {
  return image_of_flow(from, to, facts.range_m, [&](int x, int y) {
    const std::uint32_t id = facts.instance_id(x, y);
    const BodyMotion* motion = motions.find(id, facts.primitive_id(x, y));
    if (motion == nullptr && core::is_moving_id(id))
      core::fail(core::ErrorKind::Input,
                 "pixel ({}, {}) shows instance {}, which moves and is not there", x, y, id);
    return motion;
  });
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
