#include <fmt/format.h>

#include <array>

#include "core/atomic_file.h"
#include "core/error.h"
#include "geo/frames.h"
#include "rigs/rig_file.h"
#include "rigs/rig_format.h"
#include "rigs/yaml_file.h"

// Kalibr's camchain: cam0, cam1, … each with its pose by T_cn_cnm1, from the camera before it, and T_cam_imu, from the IMU,
// which is the rig here. Its pixels count from the first one's centre. Names are those of the topics.
// https://github.com/ethz-asl/kalibr/wiki/yaml-formats
namespace terracast::rigs {
namespace {

using capture::CameraCalibration;
using core::ErrorKind;
using core::fail;

/// A model with a distortion, its parameters before the focal lengths and its coefficients, and our model, whose own
/// parameters are those, in this order.
struct KalibrModel {
  std::string_view camera_model;
  std::string_view distortion_model;
  std::size_t num_leading;  ///< of intrinsics, before fu, fv, pu, pv
  std::size_t num_coefficients;
  std::string_view model;
};
constexpr std::array kModels = {
    KalibrModel{"pinhole", "none", 0, 0, "pinhole"},
    KalibrModel{"pinhole", "radtan", 0, 4, "opencv"},
    KalibrModel{"pinhole", "equidistant", 0, 4, "opencv_fisheye"},
    KalibrModel{"pinhole", "fov", 0, 1, "fov"},
    KalibrModel{"omni", "radtan", 1, 4, "unified"},
    KalibrModel{"eucm", "none", 2, 0, "extended_unified"},
    KalibrModel{"ds", "none", 2, 0, "double_sphere"},
};

geo::CameraIntrinsics read_intrinsics(const YamlValue& camera) {
  const std::string camera_model = camera.at("camera_model").text();
  const std::string distortion_model =
      camera.has("distortion_model") ? camera.at("distortion_model").text() : "none";
  for (const KalibrModel& known : kModels) {
    if (known.camera_model != camera_model || known.distortion_model != distortion_model) continue;
    const std::vector<double> given = camera.at("intrinsics").numbers(known.num_leading + 4);
    const std::vector<double> coefficients =
        known.num_coefficients == 0
            ? std::vector<double>{}
            : camera.at("distortion_coeffs").numbers(known.num_coefficients);
    const std::vector<YamlValue> resolution = camera.at("resolution").items();
    if (resolution.size() != 2)
      fail(ErrorKind::Input, "{} has {} numbers; it takes 2", camera.at("resolution").where(),
           resolution.size());
    geo::CameraIntrinsics intrinsics{.model = std::string(known.model),
                                     .width_px = resolution[0].size_px(),
                                     .height_px = resolution[1].size_px(),
                                     .parameters = {}};
    const auto focal = given.begin() + static_cast<std::ptrdiff_t>(known.num_leading);
    intrinsics.parameters = {focal[0], focal[1], focal[2] + kCentreOfFirstPixel_px,
                             focal[3] + kCentreOfFirstPixel_px};
    intrinsics.parameters.insert(intrinsics.parameters.end(), given.begin(), focal);
    intrinsics.parameters.insert(intrinsics.parameters.end(), coefficients.begin(),
                                 coefficients.end());
    return intrinsics;
  }
  std::vector<std::string> known;
  for (const KalibrModel& model : kModels)
    known.push_back(fmt::format("{} with {}", model.camera_model, model.distortion_model));
  fail(ErrorKind::Input, "{}: camera_model {} with distortion_model {} is not known; known are {}",
       camera.where(), camera_model, distortion_model, fmt::join(known, ", "));
}

/// "/rig/name/image_raw" holds a rig's and a camera's name; other topics their own.
std::pair<std::string, std::string> names_of(const YamlValue& camera, const std::string& key) {
  if (!camera.has("rostopic")) return {"", key};
  std::string topic = camera.at("rostopic").text();
  for (const std::string_view ending : {"/image_raw", "/image_rect", "/image_mono", "/image_color"})
    if (topic.ends_with(ending)) topic.resize(topic.size() - ending.size());
  if (topic.starts_with('/')) topic.erase(0, 1);
  const std::size_t slash = topic.rfind('/');
  if (topic.empty()) return {"", key};
  if (slash == std::string::npos) return {"", safe_name(topic)};
  return {safe_name(topic.substr(0, slash)), safe_name(topic.substr(slash + 1))};
}

rigs::RigOptions read_kalibr(const std::filesystem::path& path, const ReadOptions& options) {
  const YamlValue chain = YamlValue::read(path);
  std::vector<CameraCalibration> cameras;
  std::string rig_name = options.name;
  for (const std::string& key : chain.keys()) {
    if (!key.starts_with("cam")) continue;
    const YamlValue camera = chain.at(key);
    const auto [rig, name] = names_of(camera, key);
    if (rig_name.empty()) rig_name = rig;
    geo::Rigid3d rig_from_camera;
    if (camera.has("T_cam_imu")) {
      rig_from_camera = camera.at("T_cam_imu").rigid().inverse();
    } else if (cameras.empty()) {
      // Nothing says where it is: it looks forward from the rig's origin.
      rig_from_camera.rotation = Eigen::Quaterniond(geo::rig_from_forward_camera());
    } else {
      rig_from_camera = cameras.back().rig_from_camera * camera.at("T_cn_cnm1").rigid().inverse();
    }
    cameras.push_back({.rig = "",
                       .name = name,
                       .intrinsics = read_intrinsics(camera),
                       .rig_from_camera = rig_from_camera,
                       .body_from_rig = {}});
  }
  if (cameras.empty())
    fail(ErrorKind::Input, "{}: no camera; a camchain of Kalibr has maps called cam0, cam1, …",
         path.string());
  return rig_of_cameras(rig_name.empty() ? safe_name(path.stem().string()) : rig_name, cameras);
}

std::string rows_text(const geo::Rigid3d& transform) {
  const Eigen::Matrix3d r = transform.rotation.toRotationMatrix();
  const Eigen::Vector3d& t = transform.translation;
  std::string text;
  for (int row = 0; row < 3; ++row)
    text += fmt::format("  - [{}, {}, {}, {}]\n", r(row, 0), r(row, 1), r(row, 2), t(row));
  return text + "  - [0.0, 0.0, 0.0, 1.0]\n";
}

std::string intrinsics_text(const CameraCalibration& camera) {
  const geo::CameraIntrinsics intrinsics = as_opencv(camera.intrinsics);
  for (const KalibrModel& known : kModels) {
    if (known.model != intrinsics.model) continue;
    const std::vector<double>& p = intrinsics.parameters;
    const auto own = p.begin() + 4;
    std::vector<double> given(own, own + static_cast<std::ptrdiff_t>(known.num_leading));
    given.insert(given.end(),
                 {p[0], p[1], p[2] - kCentreOfFirstPixel_px, p[3] - kCentreOfFirstPixel_px});
    const std::vector<double> coefficients(own + static_cast<std::ptrdiff_t>(known.num_leading),
                                           p.end());
    return fmt::format(
        "  camera_model: {}\n  intrinsics: [{}]\n  distortion_model: {}\n  distortion_coeffs: "
        "[{}]\n"
        "  resolution: [{}, {}]\n",
        known.camera_model, fmt::join(given, ", "), known.distortion_model,
        fmt::join(coefficients, ", "), intrinsics.width_px, intrinsics.height_px);
  }
  std::vector<std::string_view> known;
  for (const KalibrModel& model : kModels) known.push_back(model.model);
  fail(ErrorKind::Config, "camera {}: Kalibr has no model {}; it holds {}", camera.name,
       intrinsics.model, fmt::join(known, ", "));
}

void write_kalibr(const rigs::RigOptions& rig, const std::filesystem::path& path) {
  const std::vector<CameraCalibration> cameras = rigs::build_cameras({rig});
  std::string text;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const CameraCalibration& camera = cameras[i];
    text += fmt::format("cam{}:\n{}", i, intrinsics_text(camera));
    text += fmt::format("  rostopic: /{}/{}/image_raw\n", camera.rig, camera.name);
    text += "  T_cam_imu:\n" + rows_text(camera.rig_from_camera.inverse());
    if (i > 0)
      text += "  T_cn_cnm1:\n" +
              rows_text(camera.rig_from_camera.inverse() * cameras[i - 1].rig_from_camera);
  }
  core::write_file(path, text);
}

}  // namespace

RigFormatInfo kalibr_rigs() {
  return {.name = "kalibr",
          .summary = "A camchain of Kalibr (YAML).",
          .recognises =
              [](const std::filesystem::path& path, std::string_view first_bytes) {
                return (path.extension() == ".yaml" || path.extension() == ".yml") &&
                       !first_bytes.starts_with("%YAML:");
              },
          .read = read_kalibr,
          .write = write_kalibr};
}

}  // namespace terracast::rigs
