#include <fmt/format.h>

#include <cstring>
#include <iterator>

#include "export/colmap_model.h"
#include "export/georeference.h"

namespace terracast::exporters {
namespace {

template <class... Args>
void append(std::string& text, fmt::format_string<Args...> format, Args&&... args) {
  fmt::format_to(std::back_inserter(text), format, std::forward<Args>(args)...);
}

void append_pose(std::string& text, const geo::Rigid3d& pose) {
  const Eigen::Quaterniond q = canonical(pose.rotation);
  const Eigen::Vector3d& t = pose.translation;
  append(text, " {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g}", q.w(), q.x(), q.y(),
         q.z(), t.x(), t.y(), t.z());
}

std::string cameras_text(const ColmapModel& model) {
  std::string text = "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n";
  for (const ColmapCamera& camera : model.cameras) {
    append(text, "{} {} {} {}", camera.id, camera.lens.model, camera.width_px, camera.height_px);
    for (const double parameter : camera.lens.parameters) append(text, " {:.17g}", parameter);
    text += '\n';
  }
  return text;
}

std::string rigs_text(const ColmapModel& model) {
  std::string text =
      "# RIG_ID NUM_SENSORS REF_SENSOR_TYPE REF_SENSOR_ID "
      "SENSORS[](TYPE ID HAS_POSE [QW QX QY QZ TX TY TZ])\n";
  for (const ColmapRig& rig : model.rigs) {
    append(text, "{} {} CAMERA {}", rig.id, 1 + rig.others.size(), rig.reference_camera_id);
    for (const auto& [camera_id, sensor_from_rig] : rig.others) {
      append(text, " CAMERA {} 1", camera_id);
      append_pose(text, sensor_from_rig);
    }
    text += '\n';
  }
  return text;
}

std::string frames_text(const ColmapModel& model) {
  std::string text =
      "# FRAME_ID RIG_ID QW QX QY QZ TX TY TZ (rig from world) NUM_DATA "
      "DATA[](SENSOR_TYPE SENSOR_ID DATA_ID)\n";
  for (const ColmapFrame& frame : model.frames) {
    append(text, "{} {}", frame.id, frame.rig_id);
    append_pose(text, frame.rig_from_world);
    append(text, " {}", frame.images.size());
    for (const auto& [camera_id, image_id] : frame.images)
      append(text, " CAMERA {} {}", camera_id, image_id);
    text += '\n';
  }
  return text;
}

std::string images_text(const ColmapModel& model) {
  std::string text =
      "# IMAGE_ID QW QX QY QZ TX TY TZ (camera from world) CAMERA_ID NAME\n"
      "# POINTS2D[](X Y POINT3D_ID)\n";
  for (const ColmapImage& image : model.images) {
    append(text, "{}", image.id);
    append_pose(text, image.camera_from_world);
    append(text, " {} {}\n", image.camera_id, image.name);
    const char* blank = "";
    for (const ColmapObservation& observation : image.observations) {
      append(text, "{}{:.17g} {:.17g} {}", blank, observation.pixel.x(), observation.pixel.y(),
             observation.point_id);
      blank = " ";
    }
    text += '\n';
  }
  return text;
}

std::string points_text(const ColmapModel& model) {
  std::string text = "# POINT3D_ID X Y Z R G B ERROR TRACK[](IMAGE_ID POINT2D_IDX)\n";
  for (const ColmapPoint& point : model.points) {
    append(text, "{} {:.17g} {:.17g} {:.17g} {} {} {} {:.17g}", point.id, point.position.x(),
           point.position.y(), point.position.z(), point.color[0], point.color[1], point.color[2],
           point.error_px);
    for (const auto& [image_id, index] : point.track) append(text, " {} {}", image_id, index);
    text += '\n';
  }
  return text;
}

}  // namespace

std::vector<ColmapFile> colmap_text_files(const ColmapModel& model) {
  std::vector<ColmapFile> files;
  const auto add = [&](const char* name, const std::string& text) {
    std::vector<std::byte> bytes(text.size());
    std::memcpy(bytes.data(), text.data(), text.size());
    files.push_back({name, std::move(bytes)});
  };
  add("cameras.txt", cameras_text(model));
  add("frames.txt", frames_text(model));
  add("images.txt", images_text(model));
  add("points3D.txt", points_text(model));
  add("rigs.txt", rigs_text(model));
  return files;
}

}  // namespace terracast::exporters
