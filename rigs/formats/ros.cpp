#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <optional>

#include "core/error.h"
#include "rigs/opencv_lens.h"
#include "rigs/opencv_yaml.h"
#include "rigs/rig_file.h"
#include "rigs/rig_format.h"
#include "rigs/yaml_file.h"

// ROS's camera_info: YAML as camera_calibration writes it and camera_info_manager reads it, or as `rostopic echo` prints a
// message, K, D, R, P (ROS 2: k, d, r, p). K and D are of the image as taken. R takes directions of the camera to a frame that the
// cameras of a stereo pair share, "rectified"; there P says where the camera stands: its fourth column is -fx' times its place along x,
// and 0 for the left one. That frame, x right, y down, z forward, is the rig's. Pixels count from the first one's centre.
// https://docs.ros.org/en/api/sensor_msgs/html/msg/CameraInfo.html, http://wiki.ros.org/camera_calibration_parsers
namespace terracast::rigs {
namespace {

using capture::CameraCalibration;
using core::ErrorKind;
using core::fail;
namespace fs = std::filesystem;

constexpr std::array kKnown = {
    core::KnownName{"camera_name", "names of rig and camera"},
    core::KnownName{"image_width", "width in pixels"},
    core::KnownName{"image_height", "height in pixels"},
    core::KnownName{"width", "width in pixels"},
    core::KnownName{"height", "height in pixels"},
    core::KnownName{"distortion_model",
                    "plumb_bob, rational_polynomial, equidistant, fisheye, none"},
    core::KnownName{"camera_model", "an older name of distortion_model"},
    core::KnownName{"camera_matrix", "K: focal lengths and principal point of the image as taken"},
    core::KnownName{"camera_matrix.rows", "3"},
    core::KnownName{"camera_matrix.cols", "3"},
    core::KnownName{"camera_matrix.dt", "type of the numbers"},
    core::KnownName{"camera_matrix.type_id", "that it is a matrix"},
    core::KnownName{"camera_matrix.data", "row by row"},
    core::KnownName{"K", "as camera_matrix"},
    core::KnownName{"k", "as camera_matrix"},
    core::KnownName{"distortion_coefficients", "D: of the lens"},
    core::KnownName{"distortion_coefficients.rows", "1"},
    core::KnownName{"distortion_coefficients.cols", "their number"},
    core::KnownName{"distortion_coefficients.dt", "type of the numbers"},
    core::KnownName{"distortion_coefficients.type_id", "that it is a matrix"},
    core::KnownName{"distortion_coefficients.data", "the numbers"},
    core::KnownName{"D", "as distortion_coefficients"},
    core::KnownName{"d", "as distortion_coefficients"},
    core::KnownName{"rectification_matrix", "R: how the camera is turned in the rig"},
    core::KnownName{"rectification_matrix.rows", "3"},
    core::KnownName{"rectification_matrix.cols", "3"},
    core::KnownName{"rectification_matrix.dt", "type of the numbers"},
    core::KnownName{"rectification_matrix.type_id", "that it is a matrix"},
    core::KnownName{"rectification_matrix.data", "row by row"},
    core::KnownName{"R", "as rectification_matrix"},
    core::KnownName{"r", "as rectification_matrix"},
    core::KnownName{"projection_matrix",
                    "P: where the camera of a pair stands, by its fourth column"},
    core::KnownName{"projection_matrix.rows", "3"},
    core::KnownName{"projection_matrix.cols", "4"},
    core::KnownName{"projection_matrix.dt", "type of the numbers"},
    core::KnownName{"projection_matrix.type_id", "that it is a matrix"},
    core::KnownName{"projection_matrix.data", "row by row"},
    core::KnownName{"P", "as projection_matrix"},
    core::KnownName{"p", "as projection_matrix"},
    core::KnownName{"header", "when and in which frame a message was sent", false},
    core::KnownName{"binning_x", "K is of the image before pixels are put together", false},
    core::KnownName{"binning_y", "K is of the image before pixels are put together", false},
    core::KnownName{"roi", "K is of the whole image, not of the part that is sent", false},
};

/// A value that has one of several names.
std::optional<YamlValue> find(const YamlValue& file, std::initializer_list<std::string_view> keys) {
  for (const std::string_view key : keys)
    if (file.states(key)) return file.at(key);
  return std::nullopt;
}

YamlValue get(const YamlValue& file, std::initializer_list<std::string_view> keys) {
  if (const std::optional<YamlValue> value = find(file, keys)) return *value;
  fail(ErrorKind::Input, "{} has no {}", file.where(), *keys.begin());
}

/// Where a file says nothing of the model, it is ROS's first one, plumb_bob.
bool read_is_fisheye(const YamlValue& file, const std::vector<double>& coefficients) {
  const std::optional<YamlValue> model = find(file, {"distortion_model", "camera_model"});
  return model && is_fisheye_model(model->text(), coefficients, model->where());
}

geo::CameraIntrinsics read_intrinsics(const YamlValue& file) {
  return read_opencv_lens(
      file,
      {.camera_matrix = get(file, {"camera_matrix", "K", "k"}),
       .coefficients = find(file, {"distortion_coefficients", "D", "d"}),
       .width = get(file, {"image_width", "width"}),
       .height = get(file, {"image_height", "height"})},
      [&](const std::vector<double>& coefficients) { return read_is_fisheye(file, coefficients); });
}

bool are_zero(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return value == 0.0; });
}

/// The camera's place in the rectified frame, by P.
Eigen::Vector3d read_place(const YamlValue& p, const std::vector<double>& k) {
  const std::vector<double> m = p.matrix(12);
  if (are_zero(m)) return Eigen::Vector3d::Zero();  // it was not set
  if (m[0] == 0.0 || m[5] == 0.0 || m[4] != 0.0 || m[8] != 0.0 || m[9] != 0.0 || m[10] != 1.0 ||
      m[11] != 0.0)
    fail(ErrorKind::Input,
         "{}: {} is no projection matrix fx 0 cx Tx / 0 fy cy Ty / 0 0 1 0, row by row", p.where(),
         fmt::join(m, " "));
  if (m[0] != k[0] || m[1] != k[1] || m[2] != k[2] || m[5] != k[4] || m[6] != k[5])
    p.leave_out("columns 1 to 3",
                "they are of the rectified image; a rig's camera takes the image that K is of");
  return {-m[3] / m[0], -m[7] / m[5], 0.0};
}

geo::Rigid3d read_pose(const YamlValue& file) {
  geo::Rigid3d rectified_from_camera;
  if (const auto p = find(file, {"projection_matrix", "P", "p"}))
    rectified_from_camera.translation =
        read_place(*p, get(file, {"camera_matrix", "K", "k"}).matrix(9));
  if (const auto r = find(file, {"rectification_matrix", "R", "r"}))
    if (const std::vector<double> turn = r->matrix(9); !are_zero(turn))
      rectified_from_camera.rotation = r->rigid(turn, {0.0, 0.0, 0.0}).rotation;
  return rig_from_rdf() * rectified_from_camera;
}

/// The file; of a folder those of a stereo pair.
std::vector<fs::path> files_of(const fs::path& path) {
  if (!fs::is_directory(path)) return {path};
  std::vector<fs::path> files;
  for (const char* side : {"left", "right"})
    for (const char* ending : {".yaml", ".yml"})
      if (fs::path file = path / (std::string(side) + ending); fs::is_regular_file(file))
        files.push_back(std::move(file));
  if (files.size() != 2)
    fail(ErrorKind::Input,
         "{}: of a stereo pair's left.yaml and right.yaml {} are there; name one file, or a folder "
         "that has both",
         path.string(), files.size());
  return files;
}

ImportedRig read_ros(const fs::path& path, const ReadOptions& options) {
  std::vector<CameraCalibration> cameras;
  std::vector<std::string> stems;
  std::string rig_name = options.name;
  core::Ledger ledger;
  for (const fs::path& file : files_of(path)) {
    const YamlValue camera = YamlValue::read(file);
    stems.push_back(file.stem().string());
    const auto [rig, name] = names_of_topic(
        camera.states("camera_name") ? camera.at("camera_name").text() : std::string());
    if (rig_name.empty()) rig_name = rig;
    cameras.push_back({.rig = "",
                       .name = name,
                       .intrinsics = read_intrinsics(camera),
                       .rig_from_camera = read_pose(camera),
                       .body_from_rig = {}});
    ledger.merge(camera.ledger(kKnown));
  }
  name_apart(cameras, stems);
  fs::path named = fs::absolute(path).lexically_normal();
  if (!named.has_filename()) named = named.parent_path();  // a folder with a slash behind it
  if (rig_name.empty()) rig_name = safe_name(named.stem().string());
  return {rig_of_cameras(rig_name, cameras), std::move(ledger)};
}

bool recognises_ros(const fs::path& path, std::string_view) {
  if (fs::is_directory(path))
    return (fs::exists(path / "left.yaml") || fs::exists(path / "left.yml")) &&
           (fs::exists(path / "right.yaml") || fs::exists(path / "right.yml"));
  const auto file = yaml_map_of(path);
  if (file == nullptr) return false;
  const auto has_any = [&](std::initializer_list<std::string_view> keys) {
    return std::any_of(keys.begin(), keys.end(),
                       [&](std::string_view key) { return file->has(key); });
  };
  return (file->has("camera_matrix") && has_ros_keys(*file)) ||
         (has_any({"K", "k"}) && has_any({"P", "p"}) && file->has("distortion_model"));
}

}  // namespace

RigFormatInfo ros_rigs() {
  return {.name = "ros",
          .summary =
              "ROS's camera_info (YAML); of a stereo pair the folder of left.yaml and "
              "right.yaml. Read only.",
          .recognises = recognises_ros,
          .read = read_ros,
          .known = [] {
            return std::vector<core::KnownTable>{{"ros", "keys of a camera_info", kKnown}};
          }};
}

}  // namespace terracast::rigs
