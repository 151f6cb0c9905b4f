#include "export/georeference.h"

#include <fmt/format.h>

#include <cmath>

#include "capture/sequence_json.h"
#include "export/calibration.h"
#include "export/motion_record.h"
#include "export/moving_record.h"

namespace terracast::exporters {

using core::Json;

namespace {

constexpr int kGeometryVersion = 1;

}  // namespace

LocalFrame local_frame(const capture::SequenceReader& sequence) {
  const geo::WorldFrame world(sequence.info().origin);
  const geo::Geodetic start =
      world.geodetic_from_world(sequence.frames().front().world_from_body.translation);
  LocalFrame local;
  local.origin = {.lat_deg = std::round(start.lat_deg * 1e6) / 1e6,
                  .lon_deg = std::round(start.lon_deg * 1e6) / 1e6,
                  .height_m = std::round(start.height_m)};
  const geo::WorldFrame enu(local.origin);
  local.local_from_world.rotation =
      (enu.ecef_from_world().rotation.conjugate() * world.ecef_from_world().rotation).normalized();
  local.local_from_world.translation = enu.world_from_geodetic(world.origin());
  return local;
}

geo::Rigid3d local_from_camera(const LocalFrame& local, const capture::SequenceReader& sequence,
                               int frame_index, int camera_index) {
  return local.local_from_world * sequence.world_from_camera(frame_index, camera_index);
}

geo::Rigid3d local_from_camera(const LocalFrame& local, const capture::SequenceReader& sequence,
                               int frame_index, const capture::CameraCalibration& camera) {
  return local.local_from_world *
         (sequence.frames()[static_cast<std::size_t>(frame_index)].world_from_body *
          camera.body_from_camera());
}

Eigen::Quaterniond canonical(const Eigen::Quaterniond& rotation) {
  Eigen::Quaterniond unit = rotation.normalized();
  if (unit.w() < 0.0) unit.coeffs() = -unit.coeffs();
  return unit;
}

std::string georeference_csv(const capture::SequenceReader& sequence,
                             const std::vector<ExportedCamera>& cameras) {
  const geo::WorldFrame world(sequence.info().origin);
  std::string text = "frame,camera,time_s,lat_deg,lon_deg,height_m,qw,qx,qy,qz\n";
  for (const capture::FrameRecord& record : sequence.frames()) {
    for (const ExportedCamera& camera : cameras) {
      const geo::Rigid3d pose = sequence.world_from_camera(record.index, camera.camera_index);
      const geo::Geodetic place = world.geodetic_from_world(pose.translation);
      const Eigen::Quaterniond enu_from_world(world.world_from_enu(pose.translation).transpose());
      const Eigen::Quaterniond q = canonical(enu_from_world * pose.rotation);
      text += fmt::format("{},{},{:.9f},{:.13f},{:.13f},{:.6f},{:.17g},{:.17g},{:.17g},{:.17g}\n",
                          record.index, camera.name, record.time_s, place.lat_deg, place.lon_deg,
                          place.height_m, q.w(), q.x(), q.y(), q.z());
    }
  }
  return text;
}

std::string geometry_text(const capture::SequenceReader& sequence) {
  Json json = Json::object();
  json.set("format", "terracast-geometry").set("version", kGeometryVersion);
  const Json geometry = capture::json_from_geometry(sequence.info().geometry);
  for (const auto& [name, value] : geometry.members()) json.set(name, value);
  return json.text() + "\n";
}

Json describe_sequence(const capture::SequenceReader& sequence, const LocalFrame& local,
                       const std::string& name, const std::string& path,
                       const std::vector<ExportedCamera>& cameras,
                       const StatedCalibration& stated) {
  Json list = Json::array();
  for (const ExportedCamera& exported : cameras) {
    const capture::CameraCalibration& camera =
        sequence.info().cameras[static_cast<std::size_t>(exported.camera_index)];
    list.push(describe_camera(exported.name, camera));
  }
  Json entry = Json::object();
  entry.set("name", name)
      .set("path", path)
      .set("capture_sequence", sequence.info().name)
      .set("num_frames", sequence.info().num_frames)
      .set("rate_hz", sequence.info().rate_hz)
      .set("utc_start", sequence.info().utc_start)
      .set("origin", Json::object()
                         .set("lat_deg", local.origin.lat_deg)
                         .set("lon_deg", local.origin.lon_deg)
                         .set("height_m", local.origin.height_m))
      .set("georeference", path + "/" + kGeoreferenceFile)
      .set("bounds", path + "/" + kBoundsFile)
      .set("geometry", path + "/" + kGeometryFile)
      .set("cameras", std::move(list));
  if (sequence.info().has_rolling_shutter()) entry.set("motion", path + "/" + kMotionFile);
  if (!sequence.info().moving.empty()) entry.set("moving", describe_moving(sequence.info(), path));
  describe_errors(sequence, stated, path, entry);
  return entry;
}

}  // namespace terracast::exporters
