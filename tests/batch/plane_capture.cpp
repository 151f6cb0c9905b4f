#include "tests/batch/plane_capture.h"

#include <cmath>

#include "capture/frame_writer.h"
#include "geo/units.h"

namespace terracast::batch {

using Eigen::Vector2d;
using Eigen::Vector3d;

double PlaneCapture::range_m(const Vector3d& eye, const Vector3d& direction) const {
  const double t = -eye.dot(ground_normal) / direction.dot(ground_normal);
  return t > 0.0 ? t : std::numeric_limits<double>::infinity();
}

Vector3d PlaneCapture::ground_world(double lat_deg, double lon_deg) const {
  const geo::WorldFrame frame(origin);
  const Vector3d foot = frame.world_from_geodetic({lat_deg, lon_deg, 0.0});
  const Vector3d up = frame.world_from_geodetic({lat_deg, lon_deg, 1.0}) - foot;
  return foot - up * (foot.dot(ground_normal) / up.dot(ground_normal));
}

bool PlaneCapture::project(int frame, const Vector3d& point_world, Vector2d& centres) const {
  const Vector3d at = world_from_camera[static_cast<std::size_t>(frame)].inverse() * point_world;
  if (!(at.z() > 0.0)) return false;
  centres = {focal_length_px * at.x() / at.z() + 0.5 * width_px - 0.5,
             focal_length_px * at.y() / at.z() + 0.5 * height_px - 0.5};
  return true;
}

PlaneCapture::Shown PlaneCapture::shown(int frame, int x, int y) const {
  const geo::Rigid3d& pose = world_from_camera[static_cast<std::size_t>(frame)];
  const Vector3d direction =
      (pose.rotation * Vector3d((x + 0.5 - 0.5 * width_px) / focal_length_px,
                                (y + 0.5 - 0.5 * height_px) / focal_length_px, 1.0))
          .normalized();
  const double range = range_m(pose.translation, direction);
  return {direction, range,
          std::isfinite(range) && !is_outside(pose.translation + range * direction)};
}

capture::SequenceReader PlaneCapture::write(const std::filesystem::path& folder) const {
  capture::SequenceInfo info = test::tiny_sequence();
  info.origin = origin;
  info.num_frames = static_cast<int>(world_from_camera.size());
  info.cameras = {test::tiny_camera("rig", "cam", width_px, height_px, focal_length_px,
                                    Vector3d::Zero(), Vector3d::Zero())};
  const capture::SequenceWriter writer(folder, info, {});
  for (int frame = 0; frame < info.num_frames; ++frame) {
    capture::CameraFrame image;
    image.color = core::Image8(width_px, height_px, 3, 100);
    image.range_m = core::ImageF(width_px, height_px, 1, capture::kSkyRange_m);
    image.normal_world = core::ImageF(width_px, height_px, 3, 0.0F);
    image.semantic_id = core::ImageU32(width_px, height_px);
    image.instance_id = core::ImageU32(width_px, height_px);
    image.primitive_id = core::ImageU32(width_px, height_px, 1, capture::kNoPrimitive);
    image.flags = core::ImageU32(width_px, height_px);
    for (int y = 0; y < height_px; ++y)
      for (int x = 0; x < width_px; ++x) {
        const Shown hit = shown(frame, x, y);
        if (std::isinf(hit.range_m)) continue;
        image.range_m(x, y) = static_cast<float>(hit.range_m);
        image.semantic_id(x, y) = static_cast<std::uint32_t>(
            hit.is_ground ? capture::SemanticClass::Grass : capture::SemanticClass::Outside);
      }
    capture::FrameRecord record;
    record.index = frame;
    record.time_s = frame / info.rate_hz;
    record.world_from_body = world_from_camera[static_cast<std::size_t>(frame)] *
                             info.cameras[0].body_from_camera().inverse();
    record.cameras = {writer.write_camera(frame, 0, image)};
    record.key = std::string(32, '0');  // nothing is taken over from it
    writer.finish_frame(record);
  }
  writer.finish_sequence();
  return capture::SequenceReader::open(folder);
}

geo::Rigid3d looking(const Vector3d& eye, double heading_deg, double down_deg) {
  const double heading = geo::radians_from_degrees(heading_deg);
  const double down = geo::radians_from_degrees(down_deg);
  const Vector3d right(std::cos(heading), -std::sin(heading), 0.0);
  const Vector3d forward(std::sin(heading) * std::cos(down), std::cos(heading) * std::cos(down),
                         -std::sin(down));
  Eigen::Matrix3d axes;
  axes << right, forward.cross(right), forward;
  return {Eigen::Quaterniond(axes), eye};
}

}  // namespace terracast::batch
