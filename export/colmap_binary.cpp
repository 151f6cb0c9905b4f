#include <bit>
#include <cstring>

#include "export/colmap_model.h"
#include "export/georeference.h"

namespace terracast::exporters {
namespace {

static_assert(std::endian::native == std::endian::little,
              "numbers are written as memory holds them");

constexpr std::int32_t kCameraType = 0;  // of sensors

class Bytes {
 public:
  template <class Number>
  void add(Number number) {
    const std::size_t at = bytes_.size();
    bytes_.resize(at + sizeof number);
    std::memcpy(bytes_.data() + at, &number, sizeof number);
  }
  void add_count(std::size_t count) { add(static_cast<std::uint64_t>(count)); }
  void add_count32(std::size_t count) { add(static_cast<std::uint32_t>(count)); }
  void add_pose(const geo::Rigid3d& pose) {
    const Eigen::Quaterniond q = canonical(pose.rotation);
    for (const double value : {q.w(), q.x(), q.y(), q.z()}) add(value);
    for (int k = 0; k < 3; ++k) add(pose.translation[k]);
  }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
};

std::vector<std::byte> cameras_binary(const ColmapModel& model) {
  Bytes bytes;
  bytes.add_count(model.cameras.size());
  for (const ColmapCamera& camera : model.cameras) {
    bytes.add(camera.id);
    bytes.add(camera.lens.number);
    bytes.add(static_cast<std::uint64_t>(camera.width_px));
    bytes.add(static_cast<std::uint64_t>(camera.height_px));
    for (const double parameter : camera.lens.parameters) bytes.add(parameter);
  }
  return bytes.take();
}

std::vector<std::byte> rigs_binary(const ColmapModel& model) {
  Bytes bytes;
  bytes.add_count(model.rigs.size());
  for (const ColmapRig& rig : model.rigs) {
    bytes.add(rig.id);
    bytes.add_count32(1 + rig.others.size());
    bytes.add(kCameraType);
    bytes.add(rig.reference_camera_id);
    for (const auto& [camera_id, sensor_from_rig] : rig.others) {
      bytes.add(kCameraType);
      bytes.add(camera_id);
      bytes.add(std::uint8_t{1});
      bytes.add_pose(sensor_from_rig);
    }
  }
  return bytes.take();
}

std::vector<std::byte> frames_binary(const ColmapModel& model) {
  Bytes bytes;
  bytes.add_count(model.frames.size());
  for (const ColmapFrame& frame : model.frames) {
    bytes.add(frame.id);
    bytes.add(frame.rig_id);
    bytes.add_pose(frame.rig_from_world);
    bytes.add_count32(frame.images.size());
    for (const auto& [camera_id, image_id] : frame.images) {
      bytes.add(kCameraType);
      bytes.add(camera_id);
      bytes.add(static_cast<std::uint64_t>(image_id));
    }
  }
  return bytes.take();
}

std::vector<std::byte> images_binary(const ColmapModel& model) {
  Bytes bytes;
  bytes.add_count(model.images.size());
  for (const ColmapImage& image : model.images) {
    bytes.add(image.id);
    bytes.add_pose(image.camera_from_world);
    bytes.add(image.camera_id);
    for (const char c : image.name) bytes.add(c);
    bytes.add('\0');
    bytes.add_count(image.observations.size());
    for (const ColmapObservation& observation : image.observations) {
      bytes.add(observation.pixel.x());
      bytes.add(observation.pixel.y());
      bytes.add(observation.point_id);
    }
  }
  return bytes.take();
}

std::vector<std::byte> points_binary(const ColmapModel& model) {
  Bytes bytes;
  bytes.add_count(model.points.size());
  for (const ColmapPoint& point : model.points) {
    bytes.add(point.id);
    for (int k = 0; k < 3; ++k) bytes.add(point.position[k]);
    for (const std::uint8_t level : point.color) bytes.add(level);
    bytes.add(point.error_px);
    bytes.add_count(point.track.size());
    for (const auto& [image_id, index] : point.track) {
      bytes.add(image_id);
      bytes.add(index);
    }
  }
  return bytes.take();
}

}  // namespace

std::vector<ColmapFile> colmap_binary_files(const ColmapModel& model) {
  return {{"cameras.bin", cameras_binary(model)},
          {"frames.bin", frames_binary(model)},
          {"images.bin", images_binary(model)},
          {"points3D.bin", points_binary(model)},
          {"rigs.bin", rigs_binary(model)}};
}

}  // namespace terracast::exporters
