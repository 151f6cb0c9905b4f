#include "export/euroc_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string_view>

#include "capture/kalibr_text.h"
#include "core/error.h"
#include "export/stream_columns.h"
#include "export/utc_stamps.h"

namespace terracast::exporters {

namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Vector3d;

std::int64_t nanoseconds(double time_s) { return std::llround(time_s * 1e9); }

std::string decimals(const Vector3d& values, int count) {
  // Adding 0 turns -0 into 0.
  return fmt::format(",{:.{}f},{:.{}f},{:.{}f}", values.x() + 0.0, count, values.y() + 0.0, count,
                     values.z() + 0.0, count);
}

std::string all_digits(const Vector3d& values) {
  return fmt::format(",{},{},{}", values.x() + 0.0, values.y() + 0.0, values.z() + 0.0);
}

std::string matrix_yaml(const geo::Rigid3d& body_from_sensor) {
  const Eigen::Matrix3d r = body_from_sensor.rotation.toRotationMatrix();
  const Vector3d& t = body_from_sensor.translation;
  std::string rows;
  for (int row = 0; row < 3; ++row)
    rows += capture::yaml_numbers({r(row, 0), r(row, 1), r(row, 2), t(row)}) + ",\n         ";
  return "# Takes points of the sensor into the body.\nT_BS:\n  cols: 4\n  rows: 4\n  data: [" +
         rows + "0.0, 0.0, 0.0, 1.0]\n\n";
}

/// As Kalibr calls them, each behind an indentation.
std::string densities_yaml(const ImuBelief& belief, std::string_view indentation) {
  return fmt::format(
      "{0}gyroscope_noise_density: {1:#}  # rad / s / sqrt(Hz), white noise\n"
      "{0}gyroscope_random_walk: {2:#}  # rad / s^2 / sqrt(Hz), of the bias\n"
      "{0}accelerometer_noise_density: {3:#}  # m / s^2 / sqrt(Hz), white noise\n"
      "{0}accelerometer_random_walk: {4:#}  # m / s^3 / sqrt(Hz), of the bias\n",
      indentation, belief.gyro_noise_radps_per_sqrt_hz, belief.gyro_walk_radps2_per_sqrt_hz,
      belief.accel_noise_mps2_per_sqrt_hz, belief.accel_walk_mps3_per_sqrt_hz);
}

std::vector<ImuSample> samples_of(const capture::StreamInfo& info, const capture::Samples& samples,
                                  const StatedCalibration& stated) {
  const std::vector<double> stamps_s = stated.times_s(info, samples);
  const StreamColumns channels(info);
  const auto gyro = channels.of_axes("gyro_", "xyz", "_radps");
  const auto accel = channels.of_axes("accel_", "xyz", "_mps2");
  const auto place = channels.of_axes("ecef_", "xyz", "_m");
  const auto turn = channels.of_axes("ecef_q", "wxyz", "");
  const auto velocity = channels.of_axes("ecef_v", "xyz", "_mps");
  const auto gyro_bias = channels.of_axes("gyro_bias_", "xyz", "_radps");
  const auto accel_bias = channels.of_axes("accel_bias_", "xyz", "_mps2");
  std::vector<ImuSample> list;
  list.reserve(samples.times_s.size());
  for (std::size_t k = 0; k < samples.times_s.size(); ++k) {
    const double* row = &samples.values[k * info.channels.size()];
    const auto vector = [row](const std::vector<std::size_t>& columns) {
      return Vector3d(row[columns[0]], row[columns[1]], row[columns[2]]);
    };
    list.push_back({.time_s = samples.times_s[k],
                    .stamp_s = stamps_s[k],
                    .gyro_radps = vector(gyro),
                    .accel_mps2 = vector(accel),
                    .ecef_from_imu = {Eigen::Quaterniond(row[turn[0]], row[turn[1]], row[turn[2]],
                                                         row[turn[3]]),
                                      vector(place)},
                    .velocity_ecef_mps = vector(velocity),
                    .gyro_bias_radps = vector(gyro_bias),
                    .accel_bias_mps2 = vector(accel_bias)});
  }
  return list;
}

/// Gives a state between two samples the mean of their biases, by time.
void add_biases(const ImuStream& imu, double time_s, InertialState& state) {
  const std::size_t last = imu.samples.size() - 1;
  const double ticks = std::max(0.0, time_s * imu.info.rate_hz);
  const std::size_t before = std::min(static_cast<std::size_t>(ticks), last);
  const ImuSample& from = imu.samples[before];
  const ImuSample& to = imu.samples[std::min(before + 1, last)];
  const double share = std::min(ticks - static_cast<double>(before), 1.0);
  state.gyro_bias_radps = (1.0 - share) * from.gyro_bias_radps + share * to.gyro_bias_radps;
  state.accel_bias_mps2 = (1.0 - share) * from.accel_bias_mps2 + share * to.accel_bias_mps2;
}

/// What the densities are, and what they leave out.
std::string about(const ImuBelief& belief) {
  std::string text =
      "# Densities as configured, once: programs whose models are simpler want more.\n";
  if (!belief.others.empty())
    text += fmt::format("# Beside them it errs by {}.\n", fmt::join(belief.others, ", "));
  return text;
}

/// What is believed of its clock, for which the files have no key.
std::string about_clock(const capture::StreamInfo& info) {
  if (!info.clock) return {};
  return fmt::format(
      "# Its clock is believed to be ahead by {} s at the start, to gain {:.6g} ppm and to jitter "
      "by "
      "{} s.\n",
      info.clock->believed_offset_s, 1e6 * info.clock->believed_drift, info.clock->jitter_sd_s);
}

}  // namespace

void check_opencv_model(const capture::CameraCalibration& camera, const char* format) {
  constexpr std::array kModels = {"pinhole", "simple_radial", "radial", "opencv", "opencv_fisheye"};
  const std::string& model = camera.intrinsics.model;
  if (std::find(kModels.begin(), kModels.end(), model) != kModels.end()) return;
  fail(ErrorKind::Config,
       "{}: camera {}/{} is of the model {}; the format holds {} (radial-tangential and "
       "equidistant); name other rigs, or export it as terracast, which holds every model, and its "
       "rig by `terracast rig export` for Kalibr, which knows some more",
       format, camera.rig, camera.name, model, fmt::join(kModels, ", "));
}

ImuBelief imu_belief(const std::string& settings_toml) {
  ImuBelief belief;
  std::string section;
  for (std::size_t at = 0; at < settings_toml.size();) {
    const std::size_t end = std::min(settings_toml.find('\n', at), settings_toml.size());
    const std::string line = settings_toml.substr(at, end - at);
    at = end + 1;
    const std::size_t equals = line.find(" = ");
    if (line.starts_with("[")) section = line.substr(1, line.find(']') - 1);
    if (equals == std::string::npos || section.empty()) continue;
    const std::string key = line.substr(0, equals);
    const double value = std::strtod(line.c_str() + equals + 3, nullptr);
    const bool is_gyro = section == "gyroscope";
    if (key.starts_with("noise_"))
      (is_gyro ? belief.gyro_noise_radps_per_sqrt_hz : belief.accel_noise_mps2_per_sqrt_hz) = value;
    else if (key.starts_with("walk_"))
      (is_gyro ? belief.gyro_walk_radps2_per_sqrt_hz : belief.accel_walk_mps3_per_sqrt_hz) = value;
    else if (key != "markov_s" && value != 0.0)
      belief.others.push_back(section + "." + line);
  }
  return belief;
}

std::vector<ImuStream> read_imus(const capture::SequenceReader& sequence,
                                 const std::vector<ExportedCamera>& cameras,
                                 const StatedCalibration& stated) {
  const capture::SequenceInfo& info = sequence.info();
  std::vector<ImuStream> imus;
  for (std::size_t i = 0; i < info.streams.size(); ++i) {
    const capture::StreamInfo& stream = info.streams[i];
    const bool is_taken =
        std::any_of(cameras.begin(), cameras.end(), [&](const ExportedCamera& camera) {
          return info.cameras[static_cast<std::size_t>(camera.camera_index)].rig == stream.rig;
        });
    if (stream.kind != "imu" || !is_taken) continue;
    imus.push_back(
        {stream, samples_of(stream, sequence.read_samples(static_cast<int>(i)), stated)});
  }
  return imus;
}

std::map<std::int64_t, InertialState> inertial_states(const capture::SequenceReader& sequence,
                                                      const LocalFrame& local,
                                                      const ImuStream* imu) {
  const std::int64_t start_ns = unix_nanoseconds(sequence.info().utc_start, 0.0);
  const geo::Rigid3d local_from_ecef = geo::WorldFrame(local.origin).ecef_from_world().inverse();
  std::map<std::int64_t, InertialState> states;
  if (imu != nullptr)
    for (const ImuSample& sample : imu->samples)
      states[start_ns + nanoseconds(sample.time_s)] = {
          .local_from_body = local_from_ecef * sample.ecef_from_imu,
          .velocity_local_mps = local_from_ecef.rotation * sample.velocity_ecef_mps,
          .gyro_bias_radps = sample.gyro_bias_radps,
          .accel_bias_mps2 = sample.accel_bias_mps2};
  const geo::Rigid3d vehicle_from_body =
      imu != nullptr ? imu->info.body_from_sensor() : geo::Rigid3d{};
  for (const capture::FrameRecord& record : sequence.frames()) {
    // The frame's own record counts where both tell of one time: images go by it.
    const auto [found, is_new] =
        states.emplace(start_ns + nanoseconds(record.time_s), InertialState{});
    InertialState& state = found->second;
    const geo::Rigid3d local_from_vehicle = local.local_from_world * record.world_from_body;
    state.local_from_body = local_from_vehicle * vehicle_from_body;
    state.velocity_local_mps =
        local.local_from_world.rotation * record.velocity_world_mps +
        local_from_vehicle.rotation *
            record.angular_velocity_body_radps.cross(vehicle_from_body.translation);
    if (is_new && imu != nullptr) add_biases(*imu, record.time_s, state);
  }
  return states;
}

std::string states_csv(const std::map<std::int64_t, InertialState>& states) {
  std::string text =
      "#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],"
      "q_RS_z [],v_RS_R_x [m s^-1],v_RS_R_y [m s^-1],v_RS_R_z [m s^-1],b_w_RS_S_x [rad s^-1],"
      "b_w_RS_S_y [rad s^-1],b_w_RS_S_z [rad s^-1],b_a_RS_S_x [m s^-2],b_a_RS_S_y [m s^-2],"
      "b_a_RS_S_z [m s^-2]\n";
  for (const auto& [stamp_ns, state] : states) {
    const Eigen::Quaterniond q = canonical(state.local_from_body.rotation);
    text += fmt::format("{}", stamp_ns) + decimals(state.local_from_body.translation, 9) +
            fmt::format(",{:.15f}", q.w()) + decimals(q.vec(), 15) +
            decimals(state.velocity_local_mps, 9) + all_digits(state.gyro_bias_radps) +
            all_digits(state.accel_bias_mps2) + "\n";
  }
  return text;
}

std::string imu_csv(const ImuStream& imu, std::int64_t start_ns) {
  std::string text =
      "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
      "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";
  std::int64_t last_ns = std::numeric_limits<std::int64_t>::min();
  for (const ImuSample& sample : imu.samples) {
    const std::int64_t stamp_ns = start_ns + nanoseconds(sample.stamp_s);
    if (stamp_ns <= last_ns)
      fail(ErrorKind::Config,
           "euroc: by its clock IMU {}/{} shows {} ns no later than the sample before it; "
           "calibration = \"true\" or less clock.jitter_sd_s would do",
           imu.info.rig, imu.info.name, stamp_ns);
    last_ns = stamp_ns;
    text += fmt::format("{}", stamp_ns) + all_digits(sample.gyro_radps) +
            all_digits(sample.accel_mps2) + "\n";
  }
  return text;
}

std::string images_csv(const std::vector<std::int64_t>& stamps_ns) {
  std::string text = "#timestamp [ns],filename\n";
  for (const std::int64_t stamp_ns : stamps_ns) text += fmt::format("{0},{0}.png\n", stamp_ns);
  return text;
}

std::string states_yaml(bool has_imu) {
  return fmt::format(
      "# Truth: the body's pose, velocity and the IMU's biases at each sample and each image.\n"
      "sensor_type: visual-inertial\ncomment: {}\n\n{}",
      has_imu ? "exact; between two samples the biases are their mean, by time"
              : "exact; there is no IMU, and biases are 0",
      matrix_yaml({}));
}

std::string imu_yaml(const ImuStream& imu, const geo::Rigid3d& body_from_sensor) {
  const ImuBelief belief = imu_belief(imu.info.settings_toml);
  return fmt::format("sensor_type: imu\ncomment: {}/{}\n\n", imu.info.rig, imu.info.name) +
         about_clock(imu.info) + matrix_yaml(body_from_sensor) +
         fmt::format("rate_hz: {:#}\n\n", imu.info.rate_hz) + about(belief) +
         densities_yaml(belief, "");
}

std::string camera_yaml(const std::string& name, const geo::CameraIntrinsics& intrinsics,
                        double rate_hz, const geo::Rigid3d& body_from_sensor) {
  const capture::KalibrCamera camera = capture::kalibr_camera(intrinsics, name);
  return fmt::format("sensor_type: camera\ncomment: {}\n\n", name) + matrix_yaml(body_from_sensor) +
         fmt::format(
             "rate_hz: {:#}\nresolution: [{}, {}]\ncamera_model: {}\n"
             "# fu, fv, cu, cv; the centre of the first pixel is (0, 0).\n"
             "intrinsics: [{}]\ndistortion_model: {}\ndistortion_coefficients: [{}]\n",
             rate_hz, camera.width_px, camera.height_px, camera.camera_model,
             capture::yaml_numbers(camera.intrinsics),
             camera.distortion_model == "radtan" ? "radial-tangential" : camera.distortion_model,
             capture::yaml_numbers(camera.coefficients));
}

std::string kalibr_imu(const ImuStream& imu, std::size_t number) {
  const ImuBelief belief = imu_belief(imu.info.settings_toml);
  return about_clock(imu.info) + about(belief) + densities_yaml(belief, "") +
         fmt::format("rostopic: /imu{}\nupdate_rate: {:#}\n", number, imu.info.rate_hz);
}

std::string openvins_imu(const ImuStream& imu) {
  const ImuBelief belief = imu_belief(imu.info.settings_toml);
  const auto square = [](const char* key, double diagonal) {
    std::string text = fmt::format("  {}:\n", key);
    for (int row = 0; row < 3; ++row)
      text += fmt::format("    - [{}]\n", capture::yaml_numbers({row == 0 ? diagonal : 0.0,
                                                                 row == 1 ? diagonal : 0.0,
                                                                 row == 2 ? diagonal : 0.0}));
    return text;
  };
  std::string text = "%YAML:1.0\n\n" + about(belief) + "imu0:\n  T_i_b:\n" +
                     capture::yaml_rows({}) + densities_yaml(belief, "  ") +
                     fmt::format(
                         "  rostopic: /imu0\n  time_offset: 0.0\n  update_rate: {:#}\n"
                         "  model: \"kalibr\"\n",
                         imu.info.rate_hz);
  for (const char* key : {"Tw", "R_IMUtoGYRO", "Ta", "R_IMUtoACC"}) text += square(key, 1.0);
  return text + square("Tg", 0.0);
}

std::string kalibr_chain(const std::vector<ChainedCamera>& cameras,
                         std::optional<double> timeshift_cam_imu_s) {
  std::string text;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const ChainedCamera& camera = cameras[i];
    text += fmt::format("cam{}:\n{}  rostopic: /cam{}/image_raw\n", i,
                        capture::kalibr_camera(camera.intrinsics, camera.name).text(), i);
    if (timeshift_cam_imu_s)
      text += "  T_cam_imu:\n" + capture::yaml_rows(camera.imu_from_camera.inverse()) +
              fmt::format("  timeshift_cam_imu: {:#}\n", *timeshift_cam_imu_s);
    if (i > 0)
      text += "  T_cn_cnm1:\n" +
              capture::yaml_rows(camera.imu_from_camera.inverse() * cameras[i - 1].imu_from_camera);
  }
  return text;
}

std::string openvins_chain(const std::vector<ChainedCamera>& cameras, double timeshift_cam_imu_s) {
  std::string text = "%YAML:1.0\n\n";
  for (std::size_t i = 0; i < cameras.size(); ++i)
    text += fmt::format("cam{}:\n{}  rostopic: /cam{}/image_raw\n  timeshift_cam_imu: {:#}\n", i,
                        capture::kalibr_camera(cameras[i].intrinsics, cameras[i].name).text(), i,
                        timeshift_cam_imu_s) +
            "  T_imu_cam:\n" + capture::yaml_rows(cameras[i].imu_from_camera);
  return text;
}

}  // namespace terracast::exporters
