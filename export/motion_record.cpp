#include "export/motion_record.h"

#include <fmt/format.h>

namespace terracast::exporters {

using core::Json;

std::string motion_csv(const capture::SequenceReader& sequence) {
  std::string text = fmt::format(
      "frame,vx_mps,vy_mps,vz_mps,ax_mps2,ay_mps2,az_mps2,wx_radps,wy_radps,wz_radps,{}\n",
      kTermColumns);
  const auto add = [&text](const Eigen::Vector3d& vector) {
    for (const double value : vector) text += fmt::format(",{:.17g}", value);
  };
  for (const capture::FrameRecord& record : sequence.frames()) {
    const Eigen::Quaterniond body_from_world = record.world_from_body.rotation.conjugate();
    text += fmt::format("{}", record.index);
    add(body_from_world * record.velocity_world_mps);
    add(body_from_world * record.acceleration_world_mps2);
    add(record.angular_velocity_body_radps);
    text += terms_csv(record.state());
    text += '\n';
  }
  return text;
}

std::string terms_csv(const geo::BodyState& state) {
  std::string text;
  const auto add = [&text](const Eigen::Vector3d& vector) {
    for (const double value : vector) text += fmt::format(",{:.17g}", value);
  };
  const Eigen::Quaterniond body_from_world = state.world_from_body.rotation.conjugate();
  for (const Eigen::Vector3d& term : state.terms.position_world) add(body_from_world * term);
  for (const Eigen::Vector3d& term : state.terms.turning_body) add(term);
  add(state.terms.spin_body_radps);
  return text + fmt::format(",{:.17g}", state.terms.reach_s);
}

Json describe_shutter(const geo::Shutter& shutter) {
  return Json::object()
      .set("exposure_s", shutter.exposure_s)
      .set("line_time_s", shutter.line_time_s)
      .set("readout", geo::kReadoutNames[static_cast<std::size_t>(shutter.readout)]);
}

std::string shutter_convention() {
  return "A camera with `shutter` exposes its lines one after the other, and its pose is that of "
         "the frame's "
         "time, when the middle of its image is exposed. The line through the image point (u, v), "
         "counted from "
         "the image's corner, is exposed dt = line_time_s (v - height_px / 2) later; with readout "
         "up so much "
         "earlier, with right and left by u and width_px. The body is then where motion.csv takes "
         "it: from the "
         "axes of the body at the frame's time v dt + a dt^2 / 2 + p3 dt^3 + p4 dt^4 + p5 dt^5, "
         "turned "
         "by exp((w - s) dt + r2 dt^2 + r3 dt^3 + r4 dt^4 + r5 dt^5) exp(s dt); the camera "
         "goes with it by "
         "body_from_camera. Colour, depth and classes of a line are those at its own time; flow "
         "ends where the "
         "line that sees the point shows it, and so do masks.";
}

}  // namespace terracast::exporters
