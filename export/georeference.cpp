#include "export/georeference.h"

#include <fmt/format.h>

#include <cmath>

#include "capture/sequence_json.h"

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
                       const std::vector<ExportedCamera>& cameras) {
  Json list = Json::array();
  for (const ExportedCamera& exported : cameras) {
    const capture::CameraCalibration& camera =
        sequence.info().cameras[static_cast<std::size_t>(exported.camera_index)];
    const std::vector<double>& p = camera.intrinsics.parameters;
    const geo::Rigid3d pose = camera.body_from_camera();
    const Eigen::Quaterniond q = canonical(pose.rotation);
    const Eigen::Vector3d& t = pose.translation;
    Json entry = Json::object()
                     .set("name", exported.name)
                     .set("rig", camera.rig)
                     .set("camera", camera.name)
                     .set("width_px", camera.intrinsics.width_px)
                     .set("height_px", camera.intrinsics.height_px)
                     .set("fx_px", p[0])
                     .set("fy_px", p[1])
                     .set("cx_px", p[2])
                     .set("cy_px", p[3])
                     .set("body_from_camera",
                          Json::object()
                              .set("rotation_wxyz", Json::array_of({q.w(), q.x(), q.y(), q.z()}))
                              .set("translation_m", Json::array_of({t.x(), t.y(), t.z()})));
    if (camera.intrinsics.model != "pinhole")
      entry.set("model", camera.intrinsics.model).set("parameters", Json::array_of(p));
    list.push(std::move(entry));
  }
  return Json::object()
      .set("name", name)
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
}

}  // namespace terracast::exporters
