#include "core/atomic_file.h"
#include "core/error.h"
#include "validate/readers/colmap_model.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;

std::string at(const std::string& name, const TextLine& line) {
  return name + ":" + std::to_string(line.number);
}

bool is_comment(std::string_view text) { return text.empty() || text.front() == '#'; }

/// Words of a line, taken one by one.
class Words {
 public:
  Words(std::string_view text, std::string where)
      : words_(split_blanks(text)), where_(std::move(where)) {}

  std::string_view word() {
    if (next_ >= words_.size())
      fail(ErrorKind::Input, "{}: the line ends after {} words", where_, words_.size());
    return words_[next_++];
  }
  double number() { return parse_number(word(), where_); }
  std::int64_t integer() { return parse_integer(word(), where_); }
  ColmapPose pose() {
    ColmapPose pose;
    for (double& value : pose.rotation_wxyz) value = number();
    for (double& value : pose.translation) value = number();
    return pose;
  }
  std::int64_t sensor_type() {
    const std::string_view type = word();
    if (type == "CAMERA") return 0;
    if (type == "IMU") return 1;
    fail(ErrorKind::Input, "{}: unknown sensor type", where_);
  }
  std::size_t left() const { return words_.size() - next_; }
  void end() const {
    if (left() != 0) fail(ErrorKind::Input, "{}: {} words too many", where_, left());
  }
  const std::string& where() const { return where_; }

 private:
  std::vector<std::string_view> words_;
  std::size_t next_ = 0;
  std::string where_;
};

template <class Table, class Value>
void insert_new(Table& table, std::int64_t id, Value value, const std::string& where) {
  if (!table.emplace(id, std::move(value)).second)
    fail(ErrorKind::Input, "{}: id {} stands twice", where, id);
}

void read_cameras(const std::string& text, const std::string& name, ColmapModel& model) {
  for (const TextLine& line : split_lines(text)) {
    if (is_comment(line.text)) continue;
    Words words(line.text, at(name, line));
    const std::int64_t id = words.integer();
    ColmapCamera camera;
    camera.model = words.word();
    camera.width_px = words.integer();
    camera.height_px = words.integer();
    while (words.left() > 0) camera.parameters.push_back(words.number());
    insert_new(model.cameras, id, std::move(camera), words.where());
  }
}

void read_images(const std::string& text, const std::string& name, ColmapModel& model) {
  const std::vector<TextLine> lines = split_lines(text);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (is_comment(lines[i].text)) continue;
    Words words(lines[i].text, at(name, lines[i]));
    const std::int64_t id = words.integer();
    ColmapImage image;
    image.camera_from_world = words.pose();
    image.camera_id = words.integer();
    image.name = words.word();
    words.end();
    // The second line of an image may be empty, but it must be there.
    if (++i >= lines.size())
      fail(ErrorKind::Input, "{}: the image has no line of points", words.where());
    Words points(lines[i].text, at(name, lines[i]));
    image.observations.reserve(points.left() / 3);
    while (points.left() > 0) {
      ColmapObservation observation;
      observation.x_px = points.number();
      observation.y_px = points.number();
      observation.point_id = points.integer();
      image.observations.push_back(observation);
    }
    insert_new(model.images, id, std::move(image), words.where());
  }
}

void read_points(const std::string& text, const std::string& name, ColmapModel& model) {
  for (const TextLine& line : split_lines(text)) {
    if (is_comment(line.text)) continue;
    Words words(line.text, at(name, line));
    const std::int64_t id = words.integer();
    ColmapPoint point;
    for (double& value : point.position) value = words.number();
    for (int& value : point.color) {
      const std::int64_t level = words.integer();
      if (level < 0 || level > 255)
        fail(ErrorKind::Input, "{}: colour {} is outside 0 to 255", words.where(), level);
      value = static_cast<int>(level);
    }
    point.error_px = words.number();
    while (words.left() > 0) {
      const std::int64_t image_id = words.integer();
      point.track.emplace_back(image_id, words.integer());
    }
    insert_new(model.points, id, std::move(point), words.where());
  }
}

void read_rigs(const std::string& text, const std::string& name, ColmapModel& model) {
  for (const TextLine& line : split_lines(text)) {
    if (is_comment(line.text)) continue;
    Words words(line.text, at(name, line));
    const std::int64_t id = words.integer();
    const std::int64_t num_sensors = words.integer();
    ColmapRig rig;
    for (std::int64_t i = 0; i < num_sensors; ++i) {
      ColmapSensor sensor;
      sensor.type = words.sensor_type();
      sensor.id = words.integer();
      if (i > 0) sensor.has_pose = words.integer() != 0;
      if (sensor.has_pose) sensor.sensor_from_rig = words.pose();
      rig.sensors.push_back(sensor);
    }
    words.end();
    insert_new(model.rigs, id, std::move(rig), words.where());
  }
}

void read_frames(const std::string& text, const std::string& name, ColmapModel& model) {
  for (const TextLine& line : split_lines(text)) {
    if (is_comment(line.text)) continue;
    Words words(line.text, at(name, line));
    const std::int64_t id = words.integer();
    ColmapFrame frame;
    frame.rig_id = words.integer();
    frame.rig_from_world = words.pose();
    const std::int64_t num_data = words.integer();
    for (std::int64_t i = 0; i < num_data; ++i) {
      ColmapData data;
      data.type = words.sensor_type();
      data.sensor_id = words.integer();
      data.image_id = words.integer();
      frame.data.push_back(data);
    }
    words.end();
    insert_new(model.frames, id, std::move(frame), words.where());
  }
}

}  // namespace

ColmapModel read_colmap_text(const std::filesystem::path& folder, const std::string& name,
                             Findings& findings) {
  ColmapModel model;
  const auto read = [&](const char* file,
                        void (*parse)(const std::string&, const std::string&, ColmapModel&)) {
    const std::string file_name = name + "/" + file;
    findings.attempt(file_name,
                     [&] { parse(core::read_text_file(folder / file), file_name, model); });
  };
  read("cameras.txt", read_cameras);
  read("images.txt", read_images);
  read("points3D.txt", read_points);
  read("rigs.txt", read_rigs);
  read("frames.txt", read_frames);
  return model;
}

std::map<std::int64_t, ColmapImage> read_colmap_images_text(const std::filesystem::path& file) {
  ColmapModel model;
  read_images(core::read_text_file(file), file.string(), model);
  return std::move(model.images);
}

}  // namespace terracast::validate
