#include "export/tartanair_files.h"

#include <fmt/format.h>

#include <cmath>

#include "capture/channel.h"
#include "core/error.h"
#include "core/json.h"
#include "export/cameras.h"

namespace terracast::exporters {

namespace {

using core::ErrorKind;
using core::fail;

Eigen::Matrix3d ned_from_enu() {
  return (Eigen::Matrix3d() << 0, 1, 0, 1, 0, 0, 0, 0, -1).finished();
}

std::string pose_line(const geo::Rigid3d& enu_from_camera) {
  const Eigen::Vector3d t = ned_from_enu() * enu_from_camera.translation;
  const Eigen::Quaterniond q = canonical(Eigen::Quaterniond(Eigen::Matrix3d(
      ned_from_enu() * enu_from_camera.rotation.toRotationMatrix() * rdf_from_frd())));
  return fmt::format("{:.9f} {:.9f} {:.9f} {:.15f} {:.15f} {:.15f} {:.15f}\n", t.x(), t.y(), t.z(),
                     q.x(), q.y(), q.z(), q.w());
}

MaskedFlow flow_between(const capture::SequenceReader& sequence, int from, int to, int camera_index,
                        std::uint32_t visible_flag) {
  const auto model =
      geo::make_camera(sequence.info().cameras[static_cast<std::size_t>(camera_index)].intrinsics);
  const auto record = [&](int frame) -> const capture::FrameRecord& {
    return sequence.frames()[static_cast<std::size_t>(frame)];
  };
  return masked_flow(
      sequence.view(*model, from, camera_index), sequence.view(*model, to, camera_index),
      {sequence.info(), record(from), record(to)},
      sequence.read_camera(from, camera_index, capture::SequenceReader::kFacts), visible_flag);
}

}  // namespace

Eigen::Matrix3d rdf_from_frd() {
  return (Eigen::Matrix3d() << 0, 1, 0, 0, 0, 1, 1, 0, 0).finished();
}

void check_tartanair_camera(const capture::CameraCalibration& camera, int width_px, int height_px,
                            const char* format) {
  check_pinhole(camera, format);
  const geo::CameraIntrinsics& k = camera.intrinsics;
  const double cx_px = 0.5 * width_px, cy_px = 0.5 * height_px;
  if (k.width_px == width_px && k.height_px == height_px &&
      k.parameters == std::vector<double>{320.0, 320.0, cx_px, cy_px})
    return;
  fail(ErrorKind::Config,
       "{}: camera {}/{} is {} x {} px with fx {}, fy {}, cx {}, cy {} px; the format holds {} x "
       "{} px with f = 320 px and c = ({}, {}) px alone",
       format, camera.rig, camera.name, k.width_px, k.height_px, k.parameters[0], k.parameters[1],
       k.parameters[2], k.parameters[3], width_px, height_px, cx_px, cy_px);
}

void check_tartanair_pair(const capture::CameraCalibration& left,
                          const capture::CameraCalibration& right, const char* format) {
  const double baseline_m = rectified_baseline_m(left, right, format);
  if (!(std::abs(baseline_m - kTartanAirBaseline_m) <= 1e-9))
    fail(ErrorKind::Config,
         "{}: cameras {} and {} of {} are {} m apart; the format's baseline is {} m", format,
         left.name, right.name, left.rig, baseline_m, kTartanAirBaseline_m);
  check_shutters_of_pair(left, right, format);
}

void check_environment(const std::string& environment, const char* format) {
  if (environment != folder_word(environment))
    fail(ErrorKind::Config, "{}: environment = \"{}\": letters, digits, _ and - are right", format,
         environment);
}

std::string environment_of(const std::string& environment,
                           const std::vector<capture::SequenceReader>& sequences) {
  return environment.empty() ? folder_word(sequences.front().info().world_name) : environment;
}

std::string ned_poses(const capture::SequenceReader& sequence, const LocalFrame& local,
                      int camera_index) {
  std::string text;
  for (const capture::FrameRecord& record : sequence.frames())
    text += pose_line(local_from_camera(local, sequence, record.index, camera_index));
  return text;
}

std::string seg_label_map() {
  core::Json labels = core::Json::object();
  for (std::size_t i = 0; i < capture::semantic_class_names().size(); ++i)
    labels.set(capture::semantic_class_names()[i], static_cast<int>(i));
  return core::Json::object().set("name_map", std::move(labels)).text() + "\n";
}

core::Image8 segmentation(const core::ImageU32& semantic_id) {
  core::Image8 classes(semantic_id.width(), semantic_id.height());
  for (std::size_t i = 0; i < classes.data().size(); ++i)
    classes.data()[i] = static_cast<std::uint8_t>(semantic_id.data()[i]);
  return classes;
}

core::ImageF depth_before_sky(core::ImageF depth_m, double sky_depth_m, const std::string& where) {
  const auto sky_m = static_cast<float>(sky_depth_m);
  for (int y = 0; y < depth_m.height(); ++y) {
    for (int x = 0; x < depth_m.width(); ++x) {
      float& value_m = depth_m(x, y);
      if (std::isinf(value_m)) {
        value_m = sky_m;
      } else if (!(value_m < sky_m)) {
        fail(ErrorKind::Input,
             "{}, pixel ({}, {}): a depth of {} m cannot be told from the sky's {} m; a greater "
             "sky_depth_m in this export would do",
             where, x, y, value_m, sky_m);
      }
    }
  }
  return depth_m;
}

MaskedFlow masked_flow(const capture::CameraView& from, const capture::CameraView& to,
                       const capture::BodyMotions& motions, const capture::CameraFrame& facts,
                       std::uint32_t visible_flag) {
  MaskedFlow flow;
  flow.motion_px = capture::flow_image(from, to, motions, facts);
  const int width = facts.range_m.width(), height = facts.range_m.height();
  flow.is_in_view = core::Image8(width, height);
  flow.is_covisible = core::Image8(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      float& u = flow.motion_px(x, y, 0);
      float& v = flow.motion_px(x, y, 1);
      if (!std::isfinite(u) || !std::isfinite(v)) {
        u = v = 0.0F;
        continue;
      }
      const Eigen::Vector2d target =
          capture::pixel_center(x, y) +
          Eigen::Vector2d(static_cast<double>(u), static_cast<double>(v));
      const bool is_seen =
          (facts.flags(x, y) & visible_flag) != 0 && !std::isinf(facts.range_m(x, y));
      flow.is_covisible(x, y) = is_seen ? 1 : 0;
      // A point that is seen is in view, even where a float's rounding puts it on the border.
      flow.is_in_view(x, y) = is_seen || to.model.contains(target) ? 1 : 0;
    }
  }
  return flow;
}

MaskedFlow forward_flow(const capture::SequenceReader& sequence, int frame, int camera_index) {
  return flow_between(sequence, frame, frame + 1, camera_index, capture::kVisibleNext);
}

MaskedFlow backward_flow(const capture::SequenceReader& sequence, int frame, int camera_index) {
  return flow_between(sequence, frame + 1, frame, camera_index, capture::kVisiblePrevious);
}

}  // namespace terracast::exporters
