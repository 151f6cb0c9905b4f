#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "core/atomic_file.h"
#include "core/error.h"
#include "geo/frames.h"
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

/// Our model for so many distortion coefficients: k1 k2 p1 p2 [k3 [k4 k5 k6]], of a fisheye k1 k2 k3 k4.
struct OpencvModel {
  std::string_view model;
  std::size_t num_coefficients;
  bool is_fisheye;
};
constexpr std::array kModels = {
    OpencvModel{"pinhole", 0, false},
    OpencvModel{"opencv", 4, false},
    OpencvModel{"full_opencv", 8, false},
    OpencvModel{"opencv_fisheye", 4, true},
};

/// The numbers of a matrix of OpenCV's, row by row.
std::vector<double> matrix_of(const YamlValue& value, std::size_t count) {
  return value.at("data").numbers(count);
}

geo::CameraIntrinsics read_intrinsics(const YamlValue& camera) {
  const std::vector<double> k = matrix_of(camera.at("camera_matrix"), 9);
  if (k[1] != 0.0 || k[3] != 0.0 || k[6] != 0.0 || k[7] != 0.0 || k[8] != 1.0)
    fail(ErrorKind::Input,
         "{}: {} {} {} / {} {} {} / {} {} {} is no camera matrix fx 0 cx / 0 fy cy / 0 0 1",
         camera.at("camera_matrix").where(), k[0], k[1], k[2], k[3], k[4], k[5], k[6], k[7], k[8]);
  std::vector<double> coefficients;
  if (camera.has("distortion_coefficients"))
    coefficients = matrix_of(camera.at("distortion_coefficients"), 0);
  const bool is_fisheye = camera.has("fisheye_model") && camera.at("fisheye_model").number() != 0.0;
  if (!is_fisheye) {
    if (coefficients.size() == 5) coefficients.resize(8, 0.0);
    if (std::all_of(coefficients.begin(), coefficients.end(), [](double c) { return c == 0.0; }))
      coefficients.clear();
    if (coefficients.size() == 8 && std::all_of(coefficients.begin() + 4, coefficients.end(),
                                                [](double c) { return c == 0.0; }))
      coefficients.resize(4);
  }
  for (const OpencvModel& known : kModels) {
    if (known.num_coefficients != coefficients.size() || known.is_fisheye != is_fisheye) continue;
    geo::CameraIntrinsics intrinsics{
        .model = std::string(known.model),
        .width_px = camera.at("image_width").size_px(),
        .height_px = camera.at("image_height").size_px(),
        .parameters = {k[0], k[4], k[2] + kCentreOfFirstPixel_px, k[5] + kCentreOfFirstPixel_px}};
    intrinsics.parameters.insert(intrinsics.parameters.end(), coefficients.begin(),
                                 coefficients.end());
    return intrinsics;
  }
  fail(ErrorKind::Input,
       "{}: {} distortion coefficients; OpenCV has 4, 5 or 8, of a fisheye 4 (more are not known "
       "here)",
       camera.at("distortion_coefficients").where(), coefficients.size());
}

CameraCalibration read_camera(const YamlValue& camera, const std::string& name) {
  geo::Rigid3d camera_from_rdf;
  if (camera.has("R") || camera.has("T"))
    camera_from_rdf =
        camera.at("R").rigid(matrix_of(camera.at("R"), 9), matrix_of(camera.at("T"), 3));
  const geo::Rigid3d rig_from_rdf{.rotation = Eigen::Quaterniond(geo::rig_from_rdf()).normalized(),
                                  .translation = Eigen::Vector3d::Zero()};
  return {.rig = "",
          .name = name,
          .intrinsics = read_intrinsics(camera),
          .rig_from_camera = rig_from_rdf * camera_from_rdf.inverse(),
          .body_from_rig = {}};
}

rigs::RigOptions read_opencv(const std::filesystem::path& path, const ReadOptions& options) {
  const YamlValue file = YamlValue::read(path);
  std::string rig_name = options.name;
  if (rig_name.empty() && file.has("rig")) rig_name = safe_name(file.at("rig").text());
  if (rig_name.empty()) rig_name = safe_name(path.stem().string());
  std::vector<CameraCalibration> cameras;
  if (!file.has("cameras")) {
    if (!file.has("camera_matrix"))
      fail(ErrorKind::Input, "{}: neither a list cameras nor a camera_matrix", path.string());
    cameras.push_back(read_camera(file, "cam0"));
    return rig_of_cameras(rig_name, cameras);
  }
  for (const YamlValue& camera : file.at("cameras").items())
    cameras.push_back(read_camera(camera, camera.has("name")
                                              ? safe_name(camera.at("name").text())
                                              : fmt::format("cam{}", cameras.size())));
  return rig_of_cameras(rig_name, cameras);
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
  const auto known = std::find_if(kModels.begin(), kModels.end(), [&](const OpencvModel& model) {
    return model.model == intrinsics.model;
  });
  if (known == kModels.end()) {
    std::vector<std::string_view> models;
    for (const OpencvModel& model : kModels) models.push_back(model.model);
    fail(ErrorKind::Config, "camera {}: OpenCV has no model {}; it holds {}", camera.name,
         intrinsics.model, fmt::join(models, ", "));
  }
  const std::vector<double>& p = intrinsics.parameters;
  std::vector<double> coefficients(p.begin() + 4, p.end());
  if (coefficients.empty()) coefficients.resize(4, 0.0);
  const geo::Rigid3d rdf_from_rig{
      .rotation = Eigen::Quaterniond(geo::rig_from_rdf()).normalized().conjugate(),
      .translation = Eigen::Vector3d::Zero()};
  const geo::Rigid3d camera_from_rdf = (rdf_from_rig * camera.rig_from_camera).inverse();
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
              [](const std::filesystem::path& path, std::string_view first_bytes) {
                return (path.extension() == ".yaml" || path.extension() == ".yml") &&
                       first_bytes.starts_with("%YAML:");
              },
          .read = read_opencv,
          .write = write_opencv};
}

}  // namespace terracast::rigs
