#include "export/moving_record.h"

#include <fmt/format.h>

#include "capture/channel.h"
#include "core/image_io.h"
#include "core/parallel.h"
#include "export/motion_record.h"

namespace terracast::exporters {

using core::Json;

std::string moving_csv(const capture::SequenceReader& sequence, const LocalFrame& local) {
  std::string text = fmt::format(
      "frame,body,x_m,y_m,z_m,qw,qx,qy,qz,vx_mps,vy_mps,vz_mps,ax_mps2,ay_mps2,az_mps2,wx_radps,"
      "wy_radps,wz_radps,{}\n",
      kTermColumns);
  const auto add = [&text](const Eigen::Vector3d& vector) {
    for (const double value : vector) text += fmt::format(",{:.17g}", value);
  };
  for (const capture::FrameRecord& record : sequence.frames())
    for (std::size_t i = 0; i < record.moving.size(); ++i) {
      if (!record.moving[i]) continue;
      const geo::BodyState& state = *record.moving[i];
      const geo::Rigid3d local_from_body = local.local_from_world * state.world_from_body;
      const Eigen::Quaterniond q = canonical(local_from_body.rotation);
      const Eigen::Quaterniond body_from_world = state.world_from_body.rotation.conjugate();
      text += fmt::format("{},{}", record.index, i + 1);
      add(local_from_body.translation);
      text += fmt::format(",{:.17g},{:.17g},{:.17g},{:.17g}", q.w(), q.x(), q.y(), q.z());
      add(body_from_world * state.velocity_world_mps);
      add(body_from_world * state.acceleration_world_mps2);
      add(state.angular_velocity_body_radps);
      text += terms_csv(state);
      text += '\n';
    }
  return text;
}

core::Image16 moving_mask(const capture::SequenceInfo& info, const capture::CameraFrame& facts) {
  core::Image16 mask(facts.instance_id.width(), facts.instance_id.height(), 1, 0);
  for (std::size_t pixel = 0; pixel < mask.data().size(); ++pixel) {
    const capture::MovingBody* body = capture::body_shown(
        info.moving, facts.instance_id.data()[pixel], facts.primitive_id.data()[pixel]);
    if (body != nullptr)
      mask.data()[pixel] = static_cast<std::uint16_t>(body - info.moving.data() + 1);
  }
  return mask;
}

void write_moving(DatasetWriter& writer, const std::string& folder,
                  const capture::SequenceReader& sequence,
                  const std::vector<ExportedCamera>& cameras) {
  if (sequence.info().moving.empty()) return;
  writer.write(folder + "/" + kMovingFile, moving_csv(sequence, local_frame(sequence)));
  const auto num_cameras = static_cast<std::int64_t>(cameras.size());
  core::parallel_for(sequence.info().num_frames * num_cameras, [&](std::int64_t i) {
    const auto frame = static_cast<int>(i / num_cameras);
    const ExportedCamera& camera = cameras[static_cast<std::size_t>(i % num_cameras)];
    writer.write_kept(
        fmt::format("{}/{}/{}/{:06}.png", folder, kMovingFolder, camera.name, frame), [&] {
          return core::encode_png(moving_mask(
              sequence.info(),
              sequence.read_camera(frame, camera.camera_index, capture::SequenceReader::kFacts)));
        });
  });
}

Json describe_moving(const capture::SequenceInfo& info, const std::string& path) {
  Json bodies = Json::array();
  std::string thing_name;
  for (const capture::MovingBody& body : info.moving) {
    if (!body.is_part()) thing_name = body.name;
    Json entry = Json::object()
                     .set("name", body.name)
                     .set("thing", body.thing)
                     .set("class", capture::semantic_class_names()[body.semantic_id])
                     .set("instance_id", static_cast<std::int64_t>(body.instance_id));
    if (body.is_part()) entry.set("part_of", thing_name);
    const auto numbers = [](const Eigen::Vector3d& v) {
      return Json::array_of(std::vector<double>{v.x(), v.y(), v.z()});
    };
    bodies.push(std::move(entry.set("lowest_m", numbers(body.box_m.min()))
                              .set("highest_m", numbers(body.box_m.max()))));
  }
  return Json::object()
      .set("states", path + "/" + kMovingFile)
      .set("masks", path + "/" + kMovingFolder)
      .set("bodies", std::move(bodies));
}

}  // namespace terracast::exporters
