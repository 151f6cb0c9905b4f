#include <fmt/format.h>

#include "core/json.h"
#include "export/colmap_model.h"
#include "export/georeference.h"

namespace terracast::exporters {

using core::Json;

std::string colmap_rig_config(const ColmapModel& model) {
  const auto camera_entry = [&](std::uint32_t id) {
    const ColmapCamera& camera = model.cameras[id - 1];
    return Json::object()
        .set("image_prefix", camera.folder + "/")
        .set("camera_model_name", camera.lens.model)
        .set("camera_params", Json::array_of(camera.lens.parameters));
  };
  Json rigs = Json::array();
  for (const ColmapRig& rig : model.rigs) {
    Json cameras = Json::array();
    cameras.push(camera_entry(rig.reference_camera_id).set("ref_sensor", true));
    for (const auto& [camera_id, sensor_from_rig] : rig.others) {
      const Eigen::Quaterniond q = canonical(sensor_from_rig.rotation);
      const Eigen::Vector3d& t = sensor_from_rig.translation;
      cameras.push(camera_entry(camera_id)
                       .set("cam_from_rig_rotation", Json::array_of({q.w(), q.x(), q.y(), q.z()}))
                       .set("cam_from_rig_translation", Json::array_of({t.x(), t.y(), t.z()})));
    }
    rigs.push(Json::object().set("cameras", std::move(cameras)));
  }
  return rigs.text() + "\n";
}

std::string colmap_georegistration(const ColmapModel& model) {
  std::string text;
  for (const ColmapImage& image : model.images)
    text += fmt::format("{} {:.13f} {:.13f} {:.6f}\n", image.name, image.place.lat_deg,
                        image.place.lon_deg, image.place.height_m);
  return text;
}

}  // namespace terracast::exporters
