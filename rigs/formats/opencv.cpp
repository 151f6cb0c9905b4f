#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

#include "core/atomic_file.h"
#include "core/error.h"
#include "rigs/opencv_lens.h"
#include "rigs/opencv_yaml.h"
#include "rigs/rig_file.h"
#include "rigs/rig_format.h"
#include "rigs/yaml_file.h"

// YAML of OpenCV's FileStorage, with the names of its calibration samples: image_width, image_height, camera_matrix and
// distortion_coefficients, at the top for one camera, or as items of a list `cameras`; R and T take points of the rig, in x right, y down,
// z forward, to the camera's. Pixels count from the first one's centre.
namespace terracast::rigs {
namespace {

using capture::CameraCalibration;
using core::ErrorKind;
using core::fail;

constexpr std::array kKnown = {
    core::KnownName{"rig", "the rig's name"},
    core::KnownName{"cameras", "the cameras, where a file has several"},
    core::KnownName{"cameras[].name", "the camera's name"},
    core::KnownName{"cameras[].image_width", "width in pixels"},
    core::KnownName{"cameras[].image_height", "height in pixels"},
    core::KnownName{"cameras[].fisheye_model", "whether the coefficients are a fisheye's"},
    core::KnownName{"cameras[].distortion_model",
                    "instead: plumb_bob, rational_polynomial, equidistant, fisheye, none"},
    core::KnownName{"cameras[].camera_matrix", "focal lengths and principal point"},
    core::KnownName{"cameras[].camera_matrix.rows", "3"},
    core::KnownName{"cameras[].camera_matrix.cols", "3"},
    core::KnownName{"cameras[].camera_matrix.dt", "type of the numbers"},
    core::KnownName{"cameras[].camera_matrix.type_id", "that it is a matrix"},
    core::KnownName{"cameras[].camera_matrix.data", "row by row"},
    core::KnownName{"cameras[].distortion_coefficients", "k1 k2 p1 p2 and on"},
    core::KnownName{"cameras[].distortion_coefficients.rows", "their number, or 1"},
    core::KnownName{"cameras[].distortion_coefficients.cols", "1, or their number"},
    core::KnownName{"cameras[].distortion_coefficients.dt", "type of the numbers"},
    core::KnownName{"cameras[].distortion_coefficients.type_id", "that it is a matrix"},
    core::KnownName{"cameras[].distortion_coefficients.data", "the numbers"},
    core::KnownName{"cameras[].R", "rotation of the rig's axes to the camera's"},
    core::KnownName{"cameras[].R.rows", "3"},
    core::KnownName{"cameras[].R.cols", "3"},
    core::KnownName{"cameras[].R.dt", "type of the numbers"},
    core::KnownName{"cameras[].R.type_id", "that it is a matrix"},
    core::KnownName{"cameras[].R.data", "row by row"},
    core::KnownName{"cameras[].T", "the rig's origin in the camera's axes"},
    core::KnownName{"cameras[].T.rows", "3, or 1"},
    core::KnownName{"cameras[].T.cols", "1, or 3"},
    core::KnownName{"cameras[].T.dt", "type of the numbers"},
    core::KnownName{"cameras[].T.type_id", "that it is a matrix"},
    core::KnownName{"cameras[].T.data", "the numbers"},
    // What OpenCV's samples write beside, of one camera at the top.
    core::KnownName{"calibration_time", "when the images were looked at", false},
    core::KnownName{"nframes", "of how many images it was calibrated", false},
    core::KnownName{"nr_of_frames", "of how many images it was calibrated", false},
    core::KnownName{"board_width", "of the calibration's target", false},
    core::KnownName{"board_height", "of the calibration's target", false},
    core::KnownName{"square_size", "of the calibration's target", false},
    core::KnownName{"marker_size", "of the calibration's target", false},
    core::KnownName{"aspectRatio", "the camera matrix has it", false},
    core::KnownName{"fix_aspect_ratio", "how it was calibrated", false},
    core::KnownName{"flags", "how it was calibrated", false},
    core::KnownName{"fisheye_flags", "how it was calibrated", false},
    core::KnownName{"avg_reprojection_error", "how good the calibration was", false},
    core::KnownName{"per_view_reprojection_errors", "how good the calibration was", false},
    core::KnownName{"extrinsic_parameters", "where the camera stood for the calibration", false},
    core::KnownName{"image_points", "what the calibration saw", false},
    core::KnownName{"grid_points", "of the calibration's target", false},
};

/// A camera's keys have one name, whether it stands at the top or in the list.
std::string name_of(const KeyRecord::Path& path) {
  const std::string name = KeyRecord::name_of(path);
  const std::string as_item = "cameras[]." + name;
  return core::find_known(kKnown, as_item) != nullptr ? as_item : name;
}

/// OpenCV's samples have a flag, others a name.
bool read_is_fisheye(const YamlValue& camera, const std::vector<double>& coefficients) {
  const bool has_flag = camera.has("fisheye_model"), has_name = camera.states("distortion_model");
  const bool by_flag = has_flag && camera.at("fisheye_model").number() != 0.0;
  if (!has_name) return by_flag;
  const YamlValue name = camera.at("distortion_model");
  const bool by_name = is_fisheye_model(name.text(), coefficients, name.where());
  if (has_flag && by_flag != by_name)
    fail(ErrorKind::Input, "{}: {}, but fisheye_model says otherwise; leave out the wrong one",
         name.where(), name.text());
  return by_name;
}

geo::CameraIntrinsics read_intrinsics(const YamlValue& camera) {
  constexpr std::string_view kCoefficients = "distortion_coefficients";
  return read_opencv_lens(
      camera,
      {.camera_matrix = camera.at("camera_matrix"),
       .coefficients =
           camera.has(kCoefficients) ? std::optional(camera.at(kCoefficients)) : std::nullopt,
       .width = camera.at("image_width"),
       .height = camera.at("image_height")},
      [&](const std::vector<double>& coefficients) {
        return read_is_fisheye(camera, coefficients);
      });
}

CameraCalibration read_camera(const YamlValue& camera, const std::string& name) {
  geo::Rigid3d camera_from_rdf;
  if (camera.has("R") || camera.has("T"))
    camera_from_rdf = camera.at("R").rigid(camera.at("R").matrix(9), camera.at("T").matrix(3));
  return {.rig = "",
          .name = name,
          .intrinsics = read_intrinsics(camera),
          .rig_from_camera = rig_from_rdf() * camera_from_rdf.inverse(),
          .body_from_rig = {}};
}

ImportedRig read_opencv(const std::filesystem::path& path, const ReadOptions& options) {
  const YamlValue file = YamlValue::read(path);
  std::string rig_name = options.name;
  if (file.has("rig")) {
    const std::string name = safe_name(file.at("rig").text());
    if (rig_name.empty()) rig_name = name;
  }
  if (rig_name.empty()) rig_name = safe_name(path.stem().string());
  std::vector<CameraCalibration> cameras;
  if (file.has("cameras")) {
    for (const YamlValue& camera : file.at("cameras").items())
      cameras.push_back(read_camera(camera, camera.has("name")
                                                ? safe_name(camera.at("name").text())
                                                : fmt::format("cam{}", cameras.size())));
  } else if (file.has("camera_matrix")) {
    cameras.push_back(read_camera(file, "cam0"));
  } else {
    fail(ErrorKind::Input, "{}: neither a list cameras nor a camera_matrix", path.string());
  }
  return {rig_of_cameras(rig_name, cameras), file.ledger(kKnown, name_of)};
}

std::string matrix_text(const std::string& key, int num_rows, int num_columns,
                        const std::vector<double>& values) {
  return fmt::format(
      "      {}: !!opencv-matrix\n         rows: {}\n         cols: {}\n         dt: d\n         "
      "data: [ {} ]\n",
      key, num_rows, num_columns, fmt::join(values, ", "));
}

std::string camera_text(const CameraCalibration& camera) {
  const geo::CameraIntrinsics intrinsics = as_opencv(camera.intrinsics);
  const auto known =
      std::find_if(kOpencvModels.begin(), kOpencvModels.end(),
                   [&](const OpencvModel& model) { return model.model == intrinsics.model; });
  if (known == kOpencvModels.end()) {
    std::vector<std::string_view> models;
    for (const OpencvModel& model : kOpencvModels) models.push_back(model.model);
    fail(ErrorKind::Config, "camera {}: OpenCV has no model {}; it holds {}", camera.name,
         intrinsics.model, fmt::join(models, ", "));
  }
  const std::vector<double>& p = intrinsics.parameters;
  std::vector<double> coefficients(p.begin() + 4, p.end());
  if (coefficients.empty()) coefficients.resize(4, 0.0);
  const geo::Rigid3d camera_from_rdf =
      (rig_from_rdf().inverse() * camera.rig_from_camera).inverse();
  const Eigen::Matrix3d r = camera_from_rdf.rotation.toRotationMatrix();
  const Eigen::Vector3d& t = camera_from_rdf.translation;
  return fmt::format(
             "   -\n      name: {}\n      image_width: {}\n      image_height: {}\n      "
             "fisheye_model: {}\n",
             camera.name, intrinsics.width_px, intrinsics.height_px, known->is_fisheye ? 1 : 0) +
         matrix_text("camera_matrix", 3, 3,
                     {p[0], 0.0, p[2] - kCentreOfFirstPixel_px, 0.0, p[1],
                      p[3] - kCentreOfFirstPixel_px, 0.0, 0.0, 1.0}) +
         matrix_text("distortion_coefficients", static_cast<int>(coefficients.size()), 1,
                     coefficients) +
         matrix_text(
             "R", 3, 3,
             {r(0, 0), r(0, 1), r(0, 2), r(1, 0), r(1, 1), r(1, 2), r(2, 0), r(2, 1), r(2, 2)}) +
         matrix_text("T", 3, 1, {t.x(), t.y(), t.z()});
}

void write_opencv(const rigs::RigOptions& rig, const std::filesystem::path& path) {
  std::string text = fmt::format("%YAML:1.0\n---\nrig: {}\ncameras:\n", rig.name);
  for (const CameraCalibration& camera : rigs::build_cameras({rig})) text += camera_text(camera);
  core::write_file(path, text);
}

}  // namespace

RigFormatInfo opencv_rigs() {
  return {.name = "opencv",
          .summary = "YAML of OpenCV's FileStorage, with the names of its calibration samples.",
          .recognises =
              [](const std::filesystem::path& path, std::string_view) {
                const auto file = yaml_map_of(path);
                if (file == nullptr) return false;
                return (file->has("camera_matrix") && !has_ros_keys(*file)) || file->has("cameras");
              },
          .read = read_opencv,
          .write = write_opencv,
          .known =
              [] {
                return std::vector<core::KnownTable>{{"opencv", "keys of a file", kKnown}};
              }};
}

}  // namespace terracast::rigs
