#include <fmt/format.h>

#include <array>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <string>

#include "core/error.h"
#include "rigs/imported_sensor.h"
#include "rigs/opencv_lens.h"
#include "rigs/rig_file.h"
#include "rigs/rig_format.h"
#include "rigs/yaml_file.h"

// Settings of ORB-SLAM2 and ORB-SLAM3: one camera, or two of a stereo rig, of which the second is stated by its own keys, by a
// baseline, or by baseline times focal length. Cameras are called Camera before the settings' version 1.0, then Camera1 and
// Camera2. Poses take points of a camera in x right, y down, z forward; of the IMU's, which is the rig's where it is stated.
// Pixels count from the first one's centre. https://github.com/UZ-SLAMLab/ORB_SLAM3
namespace terracast::rigs {
namespace {

using capture::CameraCalibration;
using core::ErrorKind;
using core::fail;
namespace fs = std::filesystem;

constexpr std::array kKnown = {
    core::KnownName{"Camera.type", "PinHole, which it is without, Rectified or KannalaBrandt8"},
    core::KnownName{"Camera.width", "width in pixels"},
    core::KnownName{"Camera.height", "height in pixels"},
    core::KnownName{"Camera.bf", "instead of Stereo.b: baseline times fx, m px"},
    core::KnownName{"Camera.fx", "the first camera's focal length, px, before version 1.0"},
    core::KnownName{"Camera.fy", "the same down the image"},
    core::KnownName{"Camera.cx", "its principal point, px"},
    core::KnownName{"Camera.cy", "the same down the image"},
    core::KnownName{"Camera.k*", "its distortion"},
    core::KnownName{"Camera.p*", "its tangential distortion"},
    core::KnownName{"CameraN.fx", "a camera's focal length, px"},
    core::KnownName{"CameraN.fy", "the same down the image"},
    core::KnownName{"CameraN.cx", "its principal point, px"},
    core::KnownName{"CameraN.cy", "the same down the image"},
    core::KnownName{"CameraN.k*", "its distortion"},
    core::KnownName{"CameraN.p*", "its tangential distortion"},
    core::KnownName{"CameraN.overlapping*", "of the program", false},
    core::KnownName{"Stereo.b", "distance from the first camera to the second along x, m"},
    core::KnownName{"Stereo.T_c1_c2", "the first camera's axes from the second's"},
    core::KnownName{"Stereo.T_c1_c2.*", "the matrix"},
    core::KnownName{"Tlr", "the same, before version 1.0"},
    core::KnownName{"Tlr.*", "the matrix"},
    core::KnownName{"IMU.T_b_c1", "the rig's axes, which are the IMU's, from the first camera's"},
    core::KnownName{"IMU.T_b_c1.*", "the matrix"},
    core::KnownName{"Tbc", "the same, before version 1.0"},
    core::KnownName{"Tbc.*", "the matrix"},
    core::KnownName{"RGBD.DepthMapFactor", "with it the baseline is a depth camera's own"},
    core::KnownName{"DepthMapFactor", "with it the baseline is a depth camera's own"},
    core::KnownName{"Camera.DepthMapFactor", "with it the baseline is a depth camera's own"},
    core::KnownName{"CameraN.lapping*", "of the program", false},
    core::KnownName{"Lapping.*", "of the program", false},
    core::KnownName{"Camera.bFishEye", "Camera.type tells it", false},
    core::KnownName{"File.version", "the names tell it", false},
    core::KnownName{"Camera.fps", "a flight's rate_hz has it", false},
    core::KnownName{"Camera.RGB", "images are red, green, blue", false},
    core::KnownName{"Camera.newWidth", "the program shrinks images by itself", false},
    core::KnownName{"Camera.newHeight", "the program shrinks images by itself", false},
    core::KnownName{"Camera.imageScale", "the program shrinks images by itself", false},
    core::KnownName{"Camera.lappingBegin", "of the program", false},
    core::KnownName{"Camera.lappingEnd", "of the program", false},
    core::KnownName{
        "LEFT.*",
        "of the camera before its images are rectified: what is read are the rectified ones",
        false},
    core::KnownName{
        "RIGHT.*",
        "of the camera before its images are rectified: what is read are the rectified ones",
        false},
    core::KnownName{"IMU.NoiseGyro", "density of the gyroscopes' noise, rad/s/sqrt(Hz)"},
    core::KnownName{"IMU.NoiseAcc", "of the accelerometers', m/s^2/sqrt(Hz)"},
    core::KnownName{"IMU.GyroWalk", "of the walk of the gyroscopes' bias, rad/s^2/sqrt(Hz)"},
    core::KnownName{"IMU.AccWalk", "of the accelerometers', m/s^3/sqrt(Hz)"},
    core::KnownName{"IMU.Frequency", "the IMU's rate, Hz; with it the rig has an IMU"},
    core::KnownName{"IMU.*", "of the program", false},
    core::KnownName{"Stereo.ThDepth", "of the program", false},
    core::KnownName{"ThDepth", "of the program", false},
    core::KnownName{"ORBextractor.*", "of the program", false},
    core::KnownName{"Viewer.*", "of the program", false},
    core::KnownName{"System.*", "of the program", false},
};

/// "CameraN.fx" of ["Camera1.fx"], and any other key as it stands.
std::string name_of(const KeyRecord::Path& path) {
  return !path.empty() && path.front().starts_with("Camera") ? KeyRecord::numbered_name_of(path)
                                                             : KeyRecord::name_of(path);
}

double number_or_0(const YamlValue& file, const std::string& key) {
  return file.states(key) ? file.at(key).number() : 0.0;
}

std::string type_of(const YamlValue& file) {
  if (!file.states("Camera.type")) return "PinHole";
  const YamlValue type = file.at("Camera.type");
  const std::string name = type.text();
  if (name != "PinHole" && name != "Rectified" && name != "KannalaBrandt8")
    fail(ErrorKind::Input, "{}: {} is not known; known are PinHole, Rectified and KannalaBrandt8",
         type.where(), name);
  return name;
}

/// camera   "Camera", "Camera1" or "Camera2"
geo::CameraIntrinsics read_intrinsics(const YamlValue& file, const std::string& camera) {
  for (const char* key : {"Camera.width", "Camera.height"})
    if (!file.states(key))
      fail(ErrorKind::Input,
           "{} has no {}, which older settings leave to the images; add Camera.width and "
           "Camera.height, in pixels",
           file.where(), key);
  const std::string type = type_of(file);
  const auto number = [&](const char* key) { return file.at(camera + "." + key).number(); };
  const auto if_stated = [&](const char* key) { return number_or_0(file, camera + "." + key); };
  OpencvLens lens{.camera_matrix = {number("fx"), 0.0, number("cx"), 0.0, number("fy"),
                                    number("cy"), 0.0, 0.0, 1.0},
                  .coefficients = {},
                  .is_fisheye = type == "KannalaBrandt8",
                  .width_px = file.at("Camera.width").size_px(),
                  .height_px = file.at("Camera.height").size_px()};
  if (lens.is_fisheye)
    lens.coefficients = {number("k1"), number("k2"), number("k3"), number("k4")};
  else if (type == "PinHole")
    lens.coefficients = {if_stated("k1"), if_stated("k2"), if_stated("p1"), if_stated("p2"),
                         if_stated("k3")};
  const std::string where = fmt::format("{}: {}", file.where(), camera);
  return intrinsics_of_opencv(lens, where, where);
}

/// The first camera's axes from the second's, for a pair whose rows are one camera's rows; nothing where there is one camera.
std::optional<geo::Rigid3d> baseline_of(const YamlValue& file, double fx_px) {
  const bool has_b = file.states("Stereo.b");
  if (!has_b && !file.states("Camera.bf")) return std::nullopt;
  const YamlValue value = file.at(has_b ? "Stereo.b" : "Camera.bf");
  for (const char* key : {"RGBD.DepthMapFactor", "DepthMapFactor", "Camera.DepthMapFactor"})
    if (file.states(key)) {
      file.at(key);
      value.pass_over("from a depth camera to its projector: it has one camera");
      return std::nullopt;
    }
  if (value.number() == 0.0) {
    value.pass_over("0: there is one camera");
    return std::nullopt;
  }
  const double baseline_m = has_b ? value.number() : value.number() / fx_px;
  if (!(baseline_m > 0.0 && std::isfinite(baseline_m)))
    fail(ErrorKind::Input,
         "{} = {}; the distance to a second camera is above 0, and left out where there is none",
         value.where(), value.number());
  return geo::Rigid3d{.rotation = Eigen::Quaterniond::Identity(),
                      .translation = {baseline_m, 0.0, 0.0}};
}

std::optional<YamlValue> first_of(const YamlValue& file, std::initializer_list<const char*> keys) {
  for (const char* key : keys)
    if (file.states(key)) return file.at(key);
  return std::nullopt;
}

/// The IMU, where its rate is stated: it is the rig's own frame.
void add_imu(const YamlValue& file, RigOptions& rig) {
  if (!file.states("IMU.Frequency")) {
    for (const char* key : {"IMU.NoiseGyro", "IMU.NoiseAcc", "IMU.GyroWalk", "IMU.AccWalk"})
      if (file.states(key)) file.at(key).pass_over("no IMU.Frequency beside it: no IMU is made");
    return;
  }
  rig.sensors.push_back(
      imu_of_noise(file.where() + ": IMU", "imu0",
                   {.rate_hz = file.at("IMU.Frequency").number(),
                    .gyro_noise_radps_per_sqrt_hz = number_or_0(file, "IMU.NoiseGyro"),
                    .gyro_walk_radps_per_s_per_sqrt_hz = number_or_0(file, "IMU.GyroWalk"),
                    .accel_noise_mps2_per_sqrt_hz = number_or_0(file, "IMU.NoiseAcc"),
                    .accel_walk_mps2_per_s_per_sqrt_hz = number_or_0(file, "IMU.AccWalk")},
                   {}));
}

ImportedRig read_orb_slam(const fs::path& path, const ReadOptions& options) {
  const YamlValue file = YamlValue::read(path);
  const std::string first = file.has("Camera1.fx") ? "Camera1" : "Camera";
  const auto body_from_first = first_of(file, {"IMU.T_b_c1", "Tbc"});
  const geo::Rigid3d rig_from_first = body_from_first ? body_from_first->rigid() : rig_from_rdf();
  std::vector<CameraCalibration> cameras = {{.rig = "",
                                             .name = "cam0",
                                             .intrinsics = read_intrinsics(file, first),
                                             .rig_from_camera = rig_from_first,
                                             .body_from_rig = {}}};
  std::optional<geo::Rigid3d> first_from_second;
  CameraCalibration second = cameras.front();
  if (file.has("Camera2.fx") && type_of(file) != "Rectified") {
    second.intrinsics = read_intrinsics(file, "Camera2");
    const auto pose = first_of(file, {"Stereo.T_c1_c2", "Tlr"});
    if (!pose)
      fail(ErrorKind::Input,
           "{} has a Camera2 and no Stereo.T_c1_c2, its pose in the first camera's axes",
           file.where());
    first_from_second = pose->rigid();
  } else {
    first_from_second = baseline_of(file, cameras.front().intrinsics.parameters[0]);
  }
  if (first_from_second) {
    second.name = "cam1";
    second.rig_from_camera = rig_from_first * *first_from_second;
    cameras.push_back(second);
  }
  const std::string name = options.name.empty() ? safe_name(path.stem().string()) : options.name;
  RigOptions rig = rig_of_cameras(name, cameras);
  add_imu(file, rig);
  return {std::move(rig), file.ledger(kKnown, name_of)};
}

}  // namespace

RigFormatInfo orb_slam_rigs() {
  return {.name = "orb_slam",
          .summary = "Settings of ORB-SLAM2 and ORB-SLAM3 (YAML): one camera or two. Read only.",
          .recognises =
              [](const fs::path& path, std::string_view) {
                const auto file = yaml_map_of(path);
                return file != nullptr && (file->has("Camera.fx") || file->has("Camera1.fx"));
              },
          .read = read_orb_slam,
          .known =
              [] {
                return std::vector<core::KnownTable>{{"orb_slam", "keys of a file", kKnown}};
              }};
}

}  // namespace terracast::rigs
