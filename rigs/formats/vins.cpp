#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "rigs/imported_sensor.h"
#include "rigs/opencv_lens.h"
#include "rigs/rig_file.h"
#include "rigs/rig_format.h"
#include "rigs/yaml_file.h"

// The cameras of VINS-Mono and VINS-Fusion: camodocal's YAML of one camera, model_type with its parameters, and the
// estimator's, which has the camera in it (VINS-Mono: extrinsicRotation, extrinsicTranslation) or names a file of each camera
// (VINS-Fusion: camN_calib, body_T_camN). Both poses take points of the camera to the IMU, which is the rig here. Pixels count from the
// first one's centre. https://github.com/HKUST-Aerial-Robotics/VINS-Fusion, https://github.com/hengli/camodocal
namespace terracast::rigs {
namespace {

using capture::CameraCalibration;
using core::ErrorKind;
using core::fail;
namespace fs = std::filesystem;

/// A map of a camera's file and a key in it.
struct Key {
  std::string_view map;
  std::string_view key;
};

/// A model of camodocal's: the keys of focal lengths and principal point, then of our model's own parameters in their order.
struct CamodocalModel {
  std::string_view name;
  std::string_view model;
  std::vector<Key> keys;
};

const std::vector<CamodocalModel>& models() {
  constexpr std::string_view kProjection = "projection_parameters";
  constexpr std::string_view kDistortion = "distortion_parameters";
  static const std::vector<CamodocalModel> table = {
      {"PINHOLE",
       "opencv",
       {{kProjection, "fx"},
        {kProjection, "fy"},
        {kProjection, "cx"},
        {kProjection, "cy"},
        {kDistortion, "k1"},
        {kDistortion, "k2"},
        {kDistortion, "p1"},
        {kDistortion, "p2"}}},
      {"KANNALA_BRANDT",
       "opencv_fisheye",
       {{kProjection, "mu"},
        {kProjection, "mv"},
        {kProjection, "u0"},
        {kProjection, "v0"},
        {kProjection, "k2"},
        {kProjection, "k3"},
        {kProjection, "k4"},
        {kProjection, "k5"}}},
      {"MEI",
       "unified",
       {{kProjection, "gamma1"},
        {kProjection, "gamma2"},
        {kProjection, "u0"},
        {kProjection, "v0"},
        {"mirror_parameters", "xi"},
        {kDistortion, "k1"},
        {kDistortion, "k2"},
        {kDistortion, "p1"},
        {kDistortion, "p2"}}},
  };
  return table;
}

constexpr const char* kNoise =
    "noise of an IMU's sample, whose rate the file does not state; rig import --imu-rate-hz states "
    "it";

constexpr std::array kKnown = {
    core::KnownName{"model_type", "PINHOLE, KANNALA_BRANDT, MEI"},
    core::KnownName{"camera_name", "the camera's name, where no topic has one"},
    core::KnownName{"image_width", "width in pixels"},
    core::KnownName{"image_height", "height in pixels"},
    core::KnownName{"projection_parameters", "the model's"},
    core::KnownName{"projection_parameters.fx", "of PINHOLE"},
    core::KnownName{"projection_parameters.fy", "of PINHOLE"},
    core::KnownName{"projection_parameters.cx", "of PINHOLE"},
    core::KnownName{"projection_parameters.cy", "of PINHOLE"},
    core::KnownName{"projection_parameters.mu", "focal length of KANNALA_BRANDT"},
    core::KnownName{"projection_parameters.mv", "focal length of KANNALA_BRANDT"},
    core::KnownName{"projection_parameters.u0", "of KANNALA_BRANDT and MEI"},
    core::KnownName{"projection_parameters.v0", "of KANNALA_BRANDT and MEI"},
    core::KnownName{"projection_parameters.k2", "of the angle to the third, KANNALA_BRANDT"},
    core::KnownName{"projection_parameters.k3", "to the fifth"},
    core::KnownName{"projection_parameters.k4", "to the seventh"},
    core::KnownName{"projection_parameters.k5", "to the ninth"},
    core::KnownName{"projection_parameters.gamma1", "focal length of MEI"},
    core::KnownName{"projection_parameters.gamma2", "focal length of MEI"},
    core::KnownName{"distortion_parameters", "the model's"},
    core::KnownName{"distortion_parameters.k1", "of PINHOLE and MEI"},
    core::KnownName{"distortion_parameters.k2",
                    "of PINHOLE and MEI; where it stands, of "
                    "KANNALA_BRANDT"},
    core::KnownName{"distortion_parameters.k3", "where it stands, of KANNALA_BRANDT"},
    core::KnownName{"distortion_parameters.k4", "where it stands, of KANNALA_BRANDT"},
    core::KnownName{"distortion_parameters.k5", "where it stands, of KANNALA_BRANDT"},
    core::KnownName{"distortion_parameters.p1", "of PINHOLE and MEI"},
    core::KnownName{"distortion_parameters.p2", "of PINHOLE and MEI"},
    core::KnownName{"mirror_parameters", "the model's"},
    core::KnownName{"mirror_parameters.xi", "of MEI"},
    core::KnownName{"num_of_cam", "how many of the cameras are used"},
    core::KnownName{"camN_calib", "a camera's file, beside this one"},
    core::KnownName{"body_T_camN", "the IMU's axes from the camera's"},
    core::KnownName{"body_T_camN.rows", "4"},
    core::KnownName{"body_T_camN.cols", "4"},
    core::KnownName{"body_T_camN.dt", "type of the numbers"},
    core::KnownName{"body_T_camN.type_id", "that it is a matrix"},
    core::KnownName{"body_T_camN.data", "row by row"},
    core::KnownName{"imageN_topic", "names of rig and camera"},
    core::KnownName{"image_topic", "names of rig and camera"},
    core::KnownName{"extrinsicRotation", "the IMU's axes from the camera's"},
    core::KnownName{"extrinsicRotation.rows", "3"},
    core::KnownName{"extrinsicRotation.cols", "3"},
    core::KnownName{"extrinsicRotation.dt", "type of the numbers"},
    core::KnownName{"extrinsicRotation.type_id", "that it is a matrix"},
    core::KnownName{"extrinsicRotation.data", "row by row"},
    core::KnownName{"extrinsicTranslation", "the camera's place in the IMU's axes, m"},
    core::KnownName{"extrinsicTranslation.rows", "3"},
    core::KnownName{"extrinsicTranslation.cols", "1"},
    core::KnownName{"extrinsicTranslation.dt", "type of the numbers"},
    core::KnownName{"extrinsicTranslation.type_id", "that it is a matrix"},
    core::KnownName{"extrinsicTranslation.data", "x y z"},
    core::KnownName{"td", "0: the clocks agree, as they do in a rig file"},
    core::KnownName{"rolling_shutter", "whether rolling_shutter_tr counts"},
    core::KnownName{"rolling_shutter_tr", "from the first line to the last, s: line_time_us"},
    core::KnownName{"imu", "of the estimator", false},
    core::KnownName{"imu_topic", "of the estimator", false},
    core::KnownName{"output_path", "of the estimator", false},
    core::KnownName{"estimate_*", "of the estimator", false},
    core::KnownName{"ex_calib_result_path", "of the estimator", false},
    core::KnownName{"multiple_thread", "of the estimator", false},
    core::KnownName{"use_gpu*", "of the estimator", false},
    core::KnownName{"max_cnt", "of the estimator", false},
    core::KnownName{"min_dist", "of the estimator", false},
    core::KnownName{"freq", "of the estimator", false},
    core::KnownName{"F_threshold", "of the estimator", false},
    core::KnownName{"show_track", "of the estimator", false},
    core::KnownName{"flow_back", "of the estimator", false},
    core::KnownName{"equalize", "of the estimator", false},
    core::KnownName{"fisheye", "whether the estimator masks the image's corners", false},
    core::KnownName{"fisheye_mask", "whether the estimator masks the image's corners", false},
    core::KnownName{"max_solver_time", "of the estimator", false},
    core::KnownName{"max_num_iterations", "of the estimator", false},
    core::KnownName{"keyframe_parallax", "of the estimator", false},
    core::KnownName{"acc_n", "m/s^2 of a sample; divided by the root of the stated rate"},
    core::KnownName{"gyr_n", "rad/s of a sample; divided by the root of the stated rate"},
    core::KnownName{"acc_w",
                    "m/s^3, by which a step's bias changes times its length; so divided too"},
    core::KnownName{"gyr_w",
                    "rad/s^2, by which a step's bias changes times its length; so divided too"},
    core::KnownName{"g_norm", "of the estimator", false},
    core::KnownName{"loop_closure", "of the estimator", false},
    core::KnownName{"load_previous_pose_graph", "of the estimator", false},
    core::KnownName{"fast_relocalization", "of the estimator", false},
    core::KnownName{"pose_graph_save_path", "of the estimator", false},
    core::KnownName{"save_image", "of the estimator", false},
    core::KnownName{"visualize_*", "of the estimator", false},
};

/// Where a parameter stands: some files have k2 to k5 of KANNALA_BRANDT among the distortion's.
YamlValue parameter(const YamlValue& camera, const Key& key) {
  constexpr std::string_view kDistortion = "distortion_parameters";
  const bool is_elsewhere = key.map != kDistortion && !camera.at(key.map).has(key.key) &&
                            camera.has(kDistortion) && camera.at(kDistortion).has(key.key);
  return camera.at(is_elsewhere ? kDistortion : key.map).at(key.key);
}

geo::CameraIntrinsics read_intrinsics(const YamlValue& camera) {
  const YamlValue type = camera.at("model_type");
  for (const CamodocalModel& known : models()) {
    if (known.name != type.text()) continue;
    geo::CameraIntrinsics intrinsics{.model = std::string(known.model),
                                     .width_px = camera.at("image_width").size_px(),
                                     .height_px = camera.at("image_height").size_px(),
                                     .parameters = {}};
    for (const Key& key : known.keys)
      intrinsics.parameters.push_back(parameter(camera, key).number());
    std::vector<double>& p = intrinsics.parameters;
    p[2] += kCentreOfFirstPixel_px;
    p[3] += kCentreOfFirstPixel_px;
    constexpr std::ptrdiff_t kOwn = 4;
    if (known.model == "opencv" &&
        std::all_of(p.begin() + kOwn, p.end(), [](double value) { return value == 0.0; })) {
      intrinsics.model = "pinhole";
      p.resize(kOwn);
    }
    return intrinsics;
  }
  std::vector<std::string_view> names;
  for (const CamodocalModel& known : models()) names.push_back(known.name);
  fail(ErrorKind::Input, "{}: model_type {} is not known; known are {}", type.where(), type.text(),
       fmt::join(names, ", "));
}

void read_clock(const YamlValue& estimator) {
  if (!estimator.states("td")) return;
  const YamlValue offset = estimator.at("td");
  if (offset.number() != 0.0)
    offset.pass_over(
        "the camera's stamps plus this are the IMU's time, in s; a rig file holds no camera's "
        "clock offset, only errors.clock_offset_sd_s, from which it is drawn");
}

/// Time from a line to the next, us.
double read_line_time(const YamlValue& estimator, std::int64_t height_px) {
  if (!estimator.states("rolling_shutter") || estimator.at("rolling_shutter").number() == 0.0 ||
      !estimator.states("rolling_shutter_tr"))
    return 0.0;
  const double readout_s = estimator.at("rolling_shutter_tr").number();
  if (!(readout_s >= 0.0 && readout_s < 1.0))
    fail(ErrorKind::Input, "{} = {}; an image is read out in 0 to 1 s",
         estimator.at("rolling_shutter_tr").where(), readout_s);
  return 1e6 * readout_s / static_cast<double>(height_px);
}

/// The IMU, at the rig's origin. The estimator adds the variance acc_n^2 times the step's length squared to a step's velocity, which is
/// that of a density of acc_n divided by the root of the rate; acc_w likewise.
void read_imu(const YamlValue& estimator, const ReadOptions& options, rigs::RigOptions& rig) {
  constexpr std::array kKeys = {"acc_n", "gyr_n", "acc_w", "gyr_w"};
  std::array<double, kKeys.size()> densities = {};
  bool is_stated = false;
  for (std::size_t i = 0; i < kKeys.size(); ++i) {
    if (!estimator.states(kKeys[i])) continue;
    const YamlValue value = estimator.at(kKeys[i]);
    if (options.imu_rate_hz == 0.0) {
      value.pass_over(kNoise);
      continue;
    }
    is_stated = true;
    densities[i] = value.number() / std::sqrt(options.imu_rate_hz);
  }
  if (is_stated)
    rig.sensors.push_back(imu_of_noise(estimator.where(), "imu",
                                       {.rate_hz = options.imu_rate_hz,
                                        .gyro_noise_radps_per_sqrt_hz = densities[1],
                                        .gyro_walk_radps_per_s_per_sqrt_hz = densities[3],
                                        .accel_noise_mps2_per_sqrt_hz = densities[0],
                                        .accel_walk_mps2_per_s_per_sqrt_hz = densities[2]},
                                       {}));
}

std::string text_or_nothing(const YamlValue& file, const std::string& key) {
  return file.states(key) ? file.at(key).text() : std::string();
}

/// A file of a camera, or VINS-Mono's of camera and estimator.
ImportedRig read_single(const YamlValue& file, const fs::path& path, const ReadOptions& options) {
  CameraCalibration camera;
  const auto [rig, name] = names_of_topic(text_or_nothing(file, "image_topic"));
  camera.name = name.empty() ? safe_name(path.stem().string()) : name;
  if (const std::string stated = text_or_nothing(file, "camera_name");
      name.empty() && !stated.empty())
    camera.name = safe_name(stated);
  camera.intrinsics = read_intrinsics(file);
  camera.rig_from_camera = rig_from_rdf();
  if (file.states("extrinsicRotation") || file.states("extrinsicTranslation"))
    camera.rig_from_camera = file.at("extrinsicRotation")
                                 .rigid(file.at("extrinsicRotation").matrix(9),
                                        file.at("extrinsicTranslation").matrix(3));
  read_clock(file);
  std::string rig_name = options.name.empty() ? rig : options.name;
  if (rig_name.empty()) rig_name = safe_name(path.stem().string());
  ImportedRig read{rig_of_cameras(rig_name, {camera}), {}};
  read.rig.cameras[0].line_time_us = read_line_time(file, camera.intrinsics.height_px);
  read_imu(file, options, read.rig);
  read.ledger = file.ledger(kKnown, KeyRecord::numbered_name_of);
  return read;
}

/// A camera's file, which lies beside the estimator's or below it.
fs::path file_of(const YamlValue& name, const fs::path& estimator) {
  const fs::path file(name.text());
  if (file.empty() || file.is_absolute() || std::find(file.begin(), file.end(), "..") != file.end())
    fail(ErrorKind::Input,
         "{}: \"{}\" lies outside of the file's folder, and is not read from there; put it beside "
         "the file, and write its name alone",
         name.where(), name.text());
  return estimator.parent_path() / file;
}

/// The size that the estimator states is that of each camera.
void check_size(const YamlValue& estimator, const geo::CameraIntrinsics& intrinsics) {
  for (const auto& [key, size] : {std::pair{"image_width", intrinsics.width_px},
                                  std::pair{"image_height", intrinsics.height_px}})
    if (estimator.states(key) && estimator.at(key).number() != size)
      estimator.at(key).misunderstand(fmt::format("{}, and {} in a camera's file, which counts",
                                                  estimator.at(key).text(), size));
}

/// How many cameras the estimator takes; where it does not say, as many as there are.
int read_num_cameras(const YamlValue& file) {
  constexpr double kMostCameras = 100.0;
  if (!file.states("num_of_cam")) return static_cast<int>(kMostCameras);
  const double number = file.at("num_of_cam").number();
  if (!(number >= 1.0 && number <= kMostCameras && number == std::floor(number)))
    fail(ErrorKind::Input, "{} = {}; a rig is made of 1 to {} cameras",
         file.at("num_of_cam").where(), number, kMostCameras);
  return static_cast<int>(number);
}

ImportedRig read_estimator(const YamlValue& file, const fs::path& path,
                           const ReadOptions& options) {
  const int num_stated = read_num_cameras(file);
  std::vector<CameraCalibration> cameras;
  std::vector<std::string> keys;
  std::string rig_name = options.name;
  core::Ledger ledger;
  for (int i = 0; i < num_stated; ++i) {
    const std::string calib = fmt::format("cam{}_calib", i);
    if (!file.states(calib) && file.states("num_of_cam"))
      fail(ErrorKind::Input, "{} has no {}, but num_of_cam is {}", file.where(), calib, num_stated);
    if (!file.states(calib)) break;
    const YamlValue camera = YamlValue::read(file_of(file.at(calib), path));
    const auto [rig, name] = names_of_topic(text_or_nothing(file, fmt::format("image{}_topic", i)));
    if (rig_name.empty()) rig_name = rig;
    const std::string stated = text_or_nothing(camera, "camera_name");
    keys.push_back(fmt::format("cam{}", i));
    const geo::CameraIntrinsics intrinsics = read_intrinsics(camera);
    check_size(file, intrinsics);
    cameras.push_back(
        {.rig = "",
         .name = !name.empty() ? name : safe_name(stated.empty() ? keys.back() : stated),
         .intrinsics = intrinsics,
         .rig_from_camera = file.at(fmt::format("body_T_cam{}", i)).rigid(),
         .body_from_rig = {}});
    ledger.merge(camera.ledger(kKnown, KeyRecord::numbered_name_of));
  }
  if (cameras.empty())
    fail(ErrorKind::Input, "{} has no cam0_calib, the file of its first camera", file.where());
  name_apart(cameras, keys);
  read_clock(file);
  if (rig_name.empty()) rig_name = safe_name(path.stem().string());
  ImportedRig read{rig_of_cameras(rig_name, cameras), std::move(ledger)};
  for (rigs::CameraOptions& camera : read.rig.cameras)
    camera.line_time_us = read_line_time(file, camera.height_px);
  read_imu(file, options, read.rig);
  read.ledger.merge(file.ledger(kKnown, KeyRecord::numbered_name_of));
  return read;
}

ImportedRig read_vins(const fs::path& path, const ReadOptions& options) {
  const YamlValue file = YamlValue::read(path);
  return file.has("model_type") ? read_single(file, path, options)
                                : read_estimator(file, path, options);
}

}  // namespace

RigFormatInfo vins_rigs() {
  return {.name = "vins",
          .summary =
              "VINS-Fusion's or VINS-Mono's estimator with its cameras, or a camera of "
              "camodocal (YAML). Read only.",
          .recognises =
              [](const fs::path& path, std::string_view) {
                const auto file = yaml_map_of(path);
                return file != nullptr && (file->has("model_type") || file->has("cam0_calib") ||
                                           file->has("body_T_cam0"));
              },
          .read = read_vins,
          .known =
              [] {
                return std::vector<core::KnownTable>{
                    {"vins", "keys of an estimator and of a camera", kKnown}};
              }};
}

}  // namespace terracast::rigs
