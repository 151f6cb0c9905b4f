#include <cmath>
#include <cstring>
#include <limits>
#include <span>

#include "core/atomic_file.h"
#include "core/error.h"
#include "validate/readers/colmap_camera_kinds.h"
#include "validate/readers/colmap_model.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;

/// Little-endian values, taken one by one; never beyond the end.
class Bytes {
 public:
  Bytes(std::span<const std::byte> bytes, std::string name)
      : bytes_(bytes), name_(std::move(name)) {}

  template <class Value>
  Value take() {
    if (bytes_.size() - at_ < sizeof(Value))
      fail(ErrorKind::Input, "{}: truncated: it ends at byte {}", name_, bytes_.size());
    Value value;
    std::memcpy(&value, bytes_.data() + at_, sizeof(Value));
    at_ += sizeof(Value);
    return value;
  }
  double number() {
    const double value = take<double>();
    if (!std::isfinite(value))
      fail(ErrorKind::Input, "{}: the number at byte {} is not finite", name_, at_ - 8);
    return value;
  }
  /// A count of items of at least `item_bytes` each, which must fit into what is left.
  std::uint64_t count(std::uint64_t number_of_items, std::size_t item_bytes) const {
    if (number_of_items > (bytes_.size() - at_) / item_bytes)
      fail(ErrorKind::Input, "{}: {} items announced at byte {}, more than the file can hold",
           name_, number_of_items, at_);
    return number_of_items;
  }
  std::int64_t id64() {
    const auto id = take<std::uint64_t>();
    if (id > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()))
      fail(ErrorKind::Input, "{}: id {} at byte {} is too large", name_, id, at_ - 8);
    return static_cast<std::int64_t>(id);
  }
  ColmapPose pose() {
    ColmapPose pose;
    for (double& value : pose.rotation_wxyz) value = number();
    for (double& value : pose.translation) value = number();
    return pose;
  }
  std::string text() {
    std::string result;
    while (const char c = take<char>()) result += c;
    return result;
  }
  void end() const {
    if (at_ != bytes_.size())
      fail(ErrorKind::Input, "{}: {} bytes too many", name_, bytes_.size() - at_);
  }
  const std::string& name() const { return name_; }

 private:
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  std::string name_;
};

template <class Table, class Value>
void insert_new(Table& table, std::int64_t id, Value value, const std::string& name) {
  if (!table.emplace(id, std::move(value)).second)
    fail(ErrorKind::Input, "{}: id {} stands twice", name, id);
}

void read_cameras(Bytes& bytes, ColmapModel& model) {
  const std::uint64_t num_cameras = bytes.count(bytes.take<std::uint64_t>(), 24);
  for (std::uint64_t i = 0; i < num_cameras; ++i) {
    const std::int64_t id = bytes.take<std::uint32_t>();
    const auto kind = bytes.take<std::int32_t>();
    if (kind < 0 || kind >= static_cast<std::int32_t>(kColmapCameraKinds.size()))
      fail(ErrorKind::Input, "{}: unknown camera model {}", bytes.name(), kind);
    const ColmapCameraKind& known = kColmapCameraKinds[static_cast<std::size_t>(kind)];
    ColmapCamera camera;
    camera.model = known.name;
    camera.width_px = bytes.id64();
    camera.height_px = bytes.id64();
    for (int k = 0; k < known.num_parameters; ++k) camera.parameters.push_back(bytes.number());
    insert_new(model.cameras, id, std::move(camera), bytes.name());
  }
}

void read_images(Bytes& bytes, ColmapModel& model) {
  const std::uint64_t num_images = bytes.count(bytes.take<std::uint64_t>(), 73);
  for (std::uint64_t i = 0; i < num_images; ++i) {
    const std::int64_t id = bytes.take<std::uint32_t>();
    ColmapImage image;
    image.camera_from_world = bytes.pose();
    image.camera_id = bytes.take<std::uint32_t>();
    image.name = bytes.text();
    const std::uint64_t num_observations = bytes.count(bytes.take<std::uint64_t>(), 24);
    image.observations.reserve(num_observations);
    for (std::uint64_t k = 0; k < num_observations; ++k) {
      ColmapObservation observation;
      observation.x_px = bytes.number();
      observation.y_px = bytes.number();
      const auto point_id = bytes.take<std::uint64_t>();
      if (point_id != std::numeric_limits<std::uint64_t>::max()) {
        if (point_id > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()))
          fail(ErrorKind::Input, "{}: point id {} is too large", bytes.name(), point_id);
        observation.point_id = static_cast<std::int64_t>(point_id);
      }
      image.observations.push_back(observation);
    }
    insert_new(model.images, id, std::move(image), bytes.name());
  }
}

void read_points(Bytes& bytes, ColmapModel& model) {
  const std::uint64_t num_points = bytes.count(bytes.take<std::uint64_t>(), 51);
  for (std::uint64_t i = 0; i < num_points; ++i) {
    const std::int64_t id = bytes.id64();
    ColmapPoint point;
    for (double& value : point.position) value = bytes.number();
    for (int& value : point.color) value = bytes.take<std::uint8_t>();
    point.error_px = bytes.number();
    const std::uint64_t length = bytes.count(bytes.take<std::uint64_t>(), 8);
    point.track.reserve(length);
    for (std::uint64_t k = 0; k < length; ++k) {
      const std::int64_t image_id = bytes.take<std::uint32_t>();
      point.track.emplace_back(image_id, bytes.take<std::uint32_t>());
    }
    insert_new(model.points, id, std::move(point), bytes.name());
  }
}

void read_rigs(Bytes& bytes, ColmapModel& model) {
  const std::uint64_t num_rigs = bytes.count(bytes.take<std::uint64_t>(), 8);
  for (std::uint64_t i = 0; i < num_rigs; ++i) {
    const std::int64_t id = bytes.take<std::uint32_t>();
    const std::uint64_t num_sensors = bytes.count(bytes.take<std::uint32_t>(), 8);
    ColmapRig rig;
    for (std::uint64_t k = 0; k < num_sensors; ++k) {
      ColmapSensor sensor;
      sensor.type = bytes.take<std::int32_t>();
      sensor.id = bytes.take<std::uint32_t>();
      if (k > 0) {
        const auto has_pose = bytes.take<std::uint8_t>();
        if (has_pose > 1)
          fail(ErrorKind::Input, "{}: has_pose = {} of rig {}; 0 or 1 are right", bytes.name(),
               has_pose, id);
        sensor.has_pose = has_pose == 1;
      }
      if (sensor.has_pose) sensor.sensor_from_rig = bytes.pose();
      rig.sensors.push_back(sensor);
    }
    insert_new(model.rigs, id, std::move(rig), bytes.name());
  }
}

void read_frames(Bytes& bytes, ColmapModel& model) {
  const std::uint64_t num_frames = bytes.count(bytes.take<std::uint64_t>(), 68);
  for (std::uint64_t i = 0; i < num_frames; ++i) {
    const std::int64_t id = bytes.take<std::uint32_t>();
    ColmapFrame frame;
    frame.rig_id = bytes.take<std::uint32_t>();
    frame.rig_from_world = bytes.pose();
    const std::uint64_t num_data = bytes.count(bytes.take<std::uint32_t>(), 16);
    for (std::uint64_t k = 0; k < num_data; ++k) {
      ColmapData data;
      data.type = bytes.take<std::int32_t>();
      data.sensor_id = bytes.take<std::uint32_t>();
      data.image_id = bytes.id64();
      frame.data.push_back(data);
    }
    insert_new(model.frames, id, std::move(frame), bytes.name());
  }
}

}  // namespace

Pose ColmapPose::pose() const {
  const Eigen::Quaterniond rotation(rotation_wxyz[0], rotation_wxyz[1], rotation_wxyz[2],
                                    rotation_wxyz[3]);
  return {rotation.toRotationMatrix(), {translation[0], translation[1], translation[2]}};
}

ColmapModel read_colmap_binary(const std::filesystem::path& folder, const std::string& name,
                               Findings& findings, ColmapFiles files) {
  ColmapModel model;
  const auto read = [&](const char* file, void (*parse)(Bytes&, ColmapModel&)) {
    const std::string file_name = name + "/" + file;
    findings.attempt(file_name, [&] {
      const std::vector<std::byte> content = core::read_file(folder / file);
      Bytes bytes(content, file_name);
      parse(bytes, model);
      bytes.end();
    });
  };
  read("cameras.bin", read_cameras);
  read("images.bin", read_images);
  read("points3D.bin", read_points);
  if (files == ColmapFiles::WithoutRigs) return model;
  read("rigs.bin", read_rigs);
  read("frames.bin", read_frames);
  return model;
}

std::map<std::int64_t, ColmapImage> read_colmap_images_binary(const std::filesystem::path& file) {
  const std::vector<std::byte> content = core::read_file(file);
  Bytes bytes(content, file.string());
  ColmapModel model;
  read_images(bytes, model);
  bytes.end();
  return std::move(model.images);
}

}  // namespace terracast::validate
