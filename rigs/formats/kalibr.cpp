#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

#include "capture/kalibr_text.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "rigs/imported_sensor.h"
#include "rigs/rig_file.h"
#include "rigs/rig_format.h"
#include "rigs/yaml_file.h"

// Kalibr's camchain and camchain-imucam: cam0, cam1, … each with its pose by T_cn_cnm1, from the camera before it, and
// T_cam_imu, from the IMU, which is the rig here; OpenVINS's kalibr_imucam_chain has the inverse, T_imu_cam. Pixels count from
// the first one's centre. Names are those of the topics.
// https://github.com/ethz-asl/kalibr/wiki/yaml-formats, https://docs.openvins.com/gs-calibration.html
namespace terracast::rigs {
namespace {

using capture::CameraCalibration;
using capture::KalibrModel;
using core::ErrorKind;
using core::fail;

constexpr std::size_t kParametersOfUnified = 9;  // fx fy cx cy xi k1 k2 p1 p2

constexpr const char* kScales =
    "scales and misalignments as they are known; here they are drawn, by scale_ppm and "
    "misalignment_mrad";

constexpr std::array kKnown = {
    core::KnownName{"camN", "a camera, N counted from 0"},
    core::KnownName{"camN.camera_model", "pinhole, omni, eucm, ds"},
    core::KnownName{"camN.distortion_model", "radtan, equidistant or equi, fov, none"},
    core::KnownName{"camN.intrinsics", "the model's own, then fu fv pu pv"},
    core::KnownName{"camN.distortion_coeffs", "of the distortion"},
    core::KnownName{"camN.resolution", "width and height in pixels"},
    core::KnownName{"camN.rostopic", "names of rig and camera"},
    core::KnownName{"camN.T_cam_imu", "the camera's axes from the IMU's"},
    core::KnownName{"camN.T_imu_cam", "the IMU's axes from the camera's"},
    core::KnownName{"camN.T_cn_cnm1", "the camera's axes from those of the camera before it"},
    core::KnownName{"camN.timeshift_cam_imu", "0: the clocks agree, as they do in a rig file"},
    core::KnownName{"camN.cam_overlaps", "which cameras see the same follows from their poses",
                    false},
    core::KnownName{"imuN",
                    "an IMU, N counted from 0; also of imu.yaml and kalibr_imu_chain.yaml "
                    "beside the chain"},
    core::KnownName{"imuN.gyroscope_noise_density", "rad/s/sqrt(Hz)"},
    core::KnownName{"imuN.gyroscope_random_walk", "rad/s^2/sqrt(Hz)"},
    core::KnownName{"imuN.accelerometer_noise_density", "m/s^2/sqrt(Hz)"},
    core::KnownName{"imuN.accelerometer_random_walk", "m/s^3/sqrt(Hz)"},
    core::KnownName{"imuN.update_rate", "Hz"},
    core::KnownName{"imuN.T_i_b", "the IMU's axes from those of imu0"},
    core::KnownName{"imuN.time_offset", "0: the clocks agree, as they do in a rig file"},
    core::KnownName{"imuN.rostopic", "IMUs are called imu0, imu1, …", false},
    core::KnownName{"imuN.model", "which of the matrices count", false},
    core::KnownName{"imuN.Tw", kScales, false},
    core::KnownName{"imuN.Ta", kScales, false},
    core::KnownName{"imuN.Tg", kScales, false},
    core::KnownName{"imuN.R_IMUtoGYRO", kScales, false},
    core::KnownName{"imuN.R_IMUtoACC", kScales, false},
    core::KnownName{"imuN.gyroscopes", kScales, false},
    core::KnownName{"imuN.accelerometers", kScales, false},
};

std::string distortion_model_of(const YamlValue& camera) {
  if (!camera.states("distortion_model")) return "none";
  const std::string model = camera.at("distortion_model").text();
  return model == "equi" ? "equidistant" : model;  // as Kalibr's command calls it
}

/// The coefficients of a distortion; of none also zeros in their place.
std::vector<double> read_coefficients(const YamlValue& camera, std::size_t count) {
  if (count > 0) return camera.at("distortion_coeffs").numbers(count);
  if (camera.states("distortion_coeffs"))
    for (const double value : camera.at("distortion_coeffs").numbers())
      if (value != 0.0)
        fail(ErrorKind::Input, "{}: {} beside a distortion_model none; state the model, or zeros",
             camera.at("distortion_coeffs").where(), value);
  return {};
}

geo::CameraIntrinsics read_intrinsics(const YamlValue& camera) {
  const std::string camera_model = camera.at("camera_model").text();
  const std::string distortion_model = distortion_model_of(camera);
  for (const KalibrModel& known : capture::kKalibrModels) {
    if (known.camera_model != camera_model || known.distortion_model != distortion_model) continue;
    const std::vector<double> given = camera.at("intrinsics").numbers(known.num_leading + 4);
    const std::vector<double> coefficients = read_coefficients(camera, known.num_coefficients);
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
    if (known.model == "unified") intrinsics.parameters.resize(kParametersOfUnified, 0.0);
    return intrinsics;
  }
  std::vector<std::string> known;
  for (const KalibrModel& model : capture::kKalibrModels) {
    std::string pair = fmt::format("{} with {}", model.camera_model, model.distortion_model);
    if (std::find(known.begin(), known.end(), pair) == known.end())
      known.push_back(std::move(pair));
  }
  fail(ErrorKind::Input, "{}: camera_model {} with distortion_model {} is not known; known are {}",
       camera.where(), camera_model, distortion_model, fmt::join(known, ", "));
}

struct ChainCamera {
  int number;
  YamlValue value;
  std::optional<geo::Rigid3d> imu_from_camera;
  std::optional<geo::Rigid3d> camera_from_previous;
};

/// The number of "cam3" or "imu3"; other keys are none of the kind.
/// kind   "cam" or "imu"
std::optional<int> number_of(std::string_view key, std::string_view kind) {
  constexpr std::size_t kMostDigits = 4;
  if (!key.starts_with(kind)) return std::nullopt;
  key.remove_prefix(3);
  if (key.empty() || key.size() > kMostDigits ||
      key.find_first_not_of("0123456789") != std::string_view::npos)
    return std::nullopt;
  int number = 0;
  for (const char digit : key) number = 10 * number + (digit - '0');
  return number;
}

/// Whether two transforms differ by more than what prints and rounds them.
bool differ(const geo::Rigid3d& a, const geo::Rigid3d& b) {
  constexpr double kPrinted =
      1e-3;  // as YamlValue::rigid takes rotations; in metres as good as such rigs are known
  return (a.rotation.toRotationMatrix() - b.rotation.toRotationMatrix()).norm() > kPrinted ||
         (a.translation - b.translation).norm() > kPrinted;
}

std::optional<geo::Rigid3d> read_imu_from_camera(const YamlValue& camera) {
  std::optional<geo::Rigid3d> pose;
  if (camera.states("T_cam_imu")) pose = camera.at("T_cam_imu").rigid().inverse();
  if (camera.states("T_imu_cam")) {
    const geo::Rigid3d other = camera.at("T_imu_cam").rigid();
    if (pose && differ(*pose, other))
      fail(ErrorKind::Input,
           "{} is not the inverse of the T_cam_imu beside it; leave out the wrong one",
           camera.at("T_imu_cam").where());
    pose = other;
  }
  return pose;
}

/// The cameras by their numbers; a chain's file has cam10 before cam2.
std::vector<ChainCamera> read_chain(const YamlValue& chain) {
  std::vector<ChainCamera> cameras;
  for (const std::string& key : chain.keys())
    if (const std::optional<int> number = number_of(key, "cam")) {
      const YamlValue camera = chain.at(key);
      ChainCamera& read =
          cameras.emplace_back(ChainCamera{*number, camera, read_imu_from_camera(camera), {}});
      if (camera.states("T_cn_cnm1")) read.camera_from_previous = camera.at("T_cn_cnm1").rigid();
    }
  std::sort(cameras.begin(), cameras.end(),
            [](const ChainCamera& a, const ChainCamera& b) { return a.number < b.number; });
  for (std::size_t i = 0; i < cameras.size(); ++i)
    if (cameras[i].camera_from_previous &&
        (i == 0 || cameras[i - 1].number + 1 != cameras[i].number)) {
      cameras[i].camera_from_previous.reset();
      cameras[i].value.at("T_cn_cnm1").pass_over("the camera numbered one less is not there");
    }
  return cameras;
}

/// Goes along the chain from the cameras whose poses are known to those that have none, both ways; a chain without an
/// IMU stands on its first camera.
void place(std::vector<ChainCamera>& cameras) {
  const auto is_placed = [](const ChainCamera& camera) {
    return camera.imu_from_camera.has_value();
  };
  if (std::none_of(cameras.begin(), cameras.end(), is_placed))
    cameras[0].imu_from_camera = rig_from_rdf();
  for (std::size_t i = 1; i < cameras.size(); ++i) {
    const ChainCamera& before = cameras[i - 1];
    ChainCamera& camera = cameras[i];
    if (!before.imu_from_camera || !camera.camera_from_previous) continue;
    const geo::Rigid3d by_chain = *before.imu_from_camera * camera.camera_from_previous->inverse();
    if (!camera.imu_from_camera)
      camera.imu_from_camera = by_chain;
    else if (differ(by_chain, *camera.imu_from_camera))
      camera.value.at("T_cn_cnm1")
          .misunderstand("another pose than that by the IMU, which is taken");
  }
  for (std::size_t i = cameras.size(); i-- > 1;)
    if (!cameras[i - 1].imu_from_camera && cameras[i].imu_from_camera &&
        cameras[i].camera_from_previous)
      cameras[i - 1].imu_from_camera =
          *cameras[i].imu_from_camera * *cameras[i].camera_from_previous;
  for (const ChainCamera& camera : cameras)
    if (!camera.imu_from_camera)
      fail(ErrorKind::Input,
           "{}: nothing says where it is: give it T_cam_imu, or T_cn_cnm1 from the camera numbered "
           "one less",
           camera.value.where());
}

void read_clock(const YamlValue& camera) {
  if (!camera.states("timeshift_cam_imu")) return;
  const YamlValue shift = camera.at("timeshift_cam_imu");
  if (shift.number() != 0.0)
    shift.pass_over(
        "the camera's stamps plus this are the IMU's time, in s; a rig file holds no camera's "
        "clock offset, only errors.clock_offset_sd_s, from which it is drawn");
}

struct ChainImu {
  int number;
  std::string where;
  geo::Rigid3d imu_from_base;
  ImuNoise noise;
};

ChainImu read_imu(const YamlValue& imu, int number) {
  if (imu.states("time_offset") && imu.at("time_offset").number() != 0.0)
    imu.at("time_offset").pass_over("a rig file holds no IMU's clock offset");
  return {
      .number = number,
      .where = imu.where(),
      .imu_from_base = imu.states("T_i_b") ? imu.at("T_i_b").rigid() : geo::Rigid3d{},
      .noise = {.rate_hz = imu.at("update_rate").number(),
                .gyro_noise_radps_per_sqrt_hz = imu.at("gyroscope_noise_density").number(),
                .gyro_walk_radps_per_s_per_sqrt_hz = imu.at("gyroscope_random_walk").number(),
                .accel_noise_mps2_per_sqrt_hz = imu.at("accelerometer_noise_density").number(),
                .accel_walk_mps2_per_s_per_sqrt_hz = imu.at("accelerometer_random_walk").number()}};
}

/// The IMUs of a file: maps called imu0, imu1, …, or the one whose keys are the file's own.
std::vector<ChainImu> read_imus(const YamlValue& file) {
  std::vector<ChainImu> imus;
  if (file.has("gyroscope_noise_density")) return {read_imu(file, 0)};
  for (const std::string& key : file.keys())
    if (const std::optional<int> number = number_of(key, "imu"))
      imus.push_back(read_imu(file.at(key), *number));
  std::sort(imus.begin(), imus.end(),
            [](const ChainImu& a, const ChainImu& b) { return a.number < b.number; });
  return imus;
}

/// "imuN.update_rate" of a file whose keys are one IMU's, and of one with maps of IMUs.
std::string name_of_imu_key(const KeyRecord::Path& path) {
  const bool is_of_map = !path.empty() && number_of(path.front(), "imu").has_value();
  return is_of_map ? KeyRecord::numbered_name_of(path) : "imuN." + KeyRecord::name_of(path);
}

/// A ledger whose names begin with their file's.
core::Ledger called_after(const core::Ledger& ledger, const std::string& file) {
  core::Ledger called;
  for (const auto& [name, entry] : ledger.entries()) {
    const std::string full = file + ": " + name;
    if (entry.num_used > 0) called.use(full, entry.num_used);
    if (entry.num_ignored > 0) called.ignore(full, entry.why, entry.num_ignored);
    if (entry.num_unknown > 0) called.miss(full, entry.num_unknown);
    for (const auto& [value, times] : entry.not_understood)
      called.misunderstand(full, value, times);
  }
  return called;
}

/// The IMUs of the chain, or of a file beside it, as Kalibr and OpenVINS have them.
std::vector<ChainImu> find_imus(const YamlValue& chain, const std::filesystem::path& path,
                                core::Ledger& ledger) {
  std::vector<ChainImu> imus = read_imus(chain);
  for (const char* name : {"imu.yaml", "kalibr_imu_chain.yaml"}) {
    const std::filesystem::path beside = path.parent_path() / name;
    if (beside == path || !std::filesystem::is_regular_file(beside)) continue;
    if (!imus.empty()) {
      ledger.ignore(name, "the IMUs of another file are taken");
      continue;
    }
    const YamlValue file = YamlValue::read(beside);
    imus = read_imus(file);
    ledger.merge(called_after(file.ledger(kKnown, name_of_imu_key), name));
  }
  return imus;
}

/// On a rig that is imu0: T_i_b of all IMUs are from one base.
void add_imus(const std::vector<ChainImu>& imus, RigOptions& rig) {
  for (const ChainImu& imu : imus)
    rig.sensors.push_back(imu_of_noise(imu.where, fmt::format("imu{}", imu.number), imu.noise,
                                       imus[0].imu_from_base * imu.imu_from_base.inverse()));
}

ImportedRig read_kalibr(const std::filesystem::path& path, const ReadOptions& options) {
  const YamlValue chain = YamlValue::read(path);
  std::vector<ChainCamera> chained = read_chain(chain);
  if (chained.empty())
    fail(ErrorKind::Input, "{}: no camera; a camchain of Kalibr has maps called cam0, cam1, …",
         path.string());
  place(chained);
  std::vector<CameraCalibration> cameras;
  std::vector<std::string> keys;
  std::string rig_name = options.name;
  for (const ChainCamera& camera : chained) {
    const auto [rig, name] =
        names_of_topic(camera.value.states("rostopic") ? camera.value.at("rostopic").text() : "");
    if (rig_name.empty()) rig_name = rig;
    keys.push_back(fmt::format("cam{}", camera.number));
    read_clock(camera.value);
    cameras.push_back({.rig = "",
                       .name = name.empty() ? keys.back() : name,
                       .intrinsics = read_intrinsics(camera.value),
                       .rig_from_camera = *camera.imu_from_camera,
                       .body_from_rig = {}});
  }
  name_apart(cameras, keys);
  ImportedRig read{
      .rig = rig_of_cameras(rig_name.empty() ? safe_name(path.stem().string()) : rig_name, cameras),
      .ledger = {}};
  add_imus(find_imus(chain, path, read.ledger), read.rig);
  read.ledger.merge(chain.ledger(kKnown, KeyRecord::numbered_name_of));
  return read;
}

bool recognises_kalibr(const std::filesystem::path& path, std::string_view) {
  const auto file = yaml_map_of(path);
  if (file == nullptr) return false;
  const std::vector<std::string> keys = file->keys();
  return std::any_of(keys.begin(), keys.end(),
                     [](const std::string& key) { return number_of(key, "cam").has_value(); });
}

void write_kalibr(const rigs::RigOptions& rig, const std::filesystem::path& path) {
  const std::vector<CameraCalibration> cameras = rigs::build_cameras({rig});
  std::string text;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const CameraCalibration& camera = cameras[i];
    text +=
        fmt::format("cam{}:\n{}", i, capture::kalibr_camera(camera.intrinsics, camera.name).text());
    text += fmt::format("  rostopic: /{}/{}/image_raw\n", camera.rig, camera.name);
    text += "  T_cam_imu:\n" + capture::yaml_rows(camera.rig_from_camera.inverse());
    if (i > 0)
      text += "  T_cn_cnm1:\n" +
              capture::yaml_rows(camera.rig_from_camera.inverse() * cameras[i - 1].rig_from_camera);
  }
  core::write_file(path, text);
}

}  // namespace

RigFormatInfo kalibr_rigs() {
  return {.name = "kalibr",
          .summary =
              "A camchain of Kalibr, or of OpenVINS (YAML), with the IMUs of imu.yaml or "
              "kalibr_imu_chain.yaml beside it.",
          .recognises = recognises_kalibr,
          .read = read_kalibr,
          .write = write_kalibr,
          .known = [] {
            return std::vector<core::KnownTable>{{"kalibr", "keys of a camchain", kKnown}};
          }};
}

}  // namespace terracast::rigs
