#include "export/tartanair_sensors.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include "core/npy.h"
#include "core/parallel.h"
#include "export/imu_states.h"
#include "export/tartanair_files.h"
#include "export/velodyne.h"
#include "geo/geodesy.h"
#include "geo/gravity.h"

namespace terracast::exporters {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

static_assert(std::endian::native == std::endian::little);

constexpr double kTartanAirGravity_mps2 = 9.8;
constexpr int kSamplesPerFrame = 10;
/// What the format's reader in C++ has room for: 16 lasers by 3600 columns.
constexpr std::int64_t kMostOfReader = 57600;

/// x right, y forward, z up from x right, y down, z forward.
Matrix3d native_from_rdf() { return (Matrix3d() << 1, 0, 0, 0, 0, 1, 0, -1, 0).finished(); }

std::vector<std::byte> ply_of(const std::vector<Vector3d>& places) {
  const std::string header = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment x right, y forward, z up of lcam_front, m\n"
      "element vertex {}\nproperty float x\nproperty float y\nproperty float z\nend_header\n",
      places.size());
  std::vector<std::byte> bytes(header.size() + 3 * sizeof(float) * places.size());
  std::memcpy(bytes.data(), header.data(), header.size());
  std::byte* at = bytes.data() + header.size();
  for (const Vector3d& place : places)
    for (int axis = 0; axis < 3; ++axis, at += sizeof(float)) {
      const auto number = static_cast<float>(place[axis]);
      std::memcpy(at, &number, sizeof(float));
    }
  return bytes;
}

/// Rows of a few numbers each.
struct Table {
  const char* name;
  int width;
  std::vector<double> values = {};

  void add(const Vector3d& row) { values.insert(values.end(), row.begin(), row.end()); }
  int num_rows() const { return static_cast<int>(values.size()) / width; }
  std::vector<int> shape() const {
    return width == 1 ? std::vector<int>{num_rows()} : std::vector<int>{num_rows(), width};
  }
  /// As numpy.savetxt writes it.
  std::string text() const {
    std::string text;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const bool is_last = (i + 1) % static_cast<std::size_t>(width) == 0;
      text += fmt::format("{:.18e}{}", values[i], is_last ? '\n' : ' ');
    }
    return text;
  }
};

/// Turns about x, then about the turned y and z.
Vector3d euler_xyz(const Matrix3d& r) {
  return {std::atan2(-r(1, 2), r(2, 2)), std::asin(std::clamp(r(0, 2), -1.0, 1.0)),
          std::atan2(-r(0, 1), r(0, 0))};
}

/// Why an IMU's truth cannot be the format's; empty: it can.
std::string why_not(const capture::StreamInfo& imu, const capture::CameraCalibration& left,
                    double frame_rate_hz) {
  const double samples = imu.rate_hz / (kSamplesPerFrame * frame_rate_hz);
  constexpr double kRounding = 1e-9;
  if (!(std::round(samples) >= 1.0 &&
        std::abs(samples - std::round(samples)) <= kRounding * samples))
    return fmt::format(
        "it samples at {} Hz, and the format has ten samples a frame: rate_hz = {} or a whole "
        "multiple is right",
        imu.rate_hz, kSamplesPerFrame * frame_rate_hz);
  if (!samples_instants(imu))
    return "it shows means since the sample before: sampling = \"instant\" is right";
  const double apart_m =
      (imu.rig_from_sensor.translation - left.rig_from_camera.translation).norm();
  if (!(apart_m <= kRounding))
    return fmt::format(
        "it stands {:.4g} m from {}, where the format's IMU is: the camera's offset_mm is right",
        apart_m, left.name);
  return {};
}

}  // namespace

core::Json write_tartanair_scans(const FrameScans& scans, int left, const std::string& path,
                                 DatasetWriter& writer, const core::Context& context) {
  const capture::SequenceInfo& info = scans.sequence().info();
  const geo::Rigid3d camera_from_sensor =
      info.cameras[static_cast<std::size_t>(left)].body_from_camera().inverse() *
      scans.stream().body_from_sensor();
  std::atomic<std::int64_t> num_points = 0, most_of_frame = 0;
  core::parallel_for(info.num_frames, [&](std::int64_t i) {
    const auto frame = static_cast<int>(i);
    const std::vector<CloudPoint> points = scans.points(frame);
    const auto count = static_cast<std::int64_t>(points.size());
    num_points += count;
    std::int64_t most = most_of_frame;
    while (most < count && !most_of_frame.compare_exchange_weak(most, count)) {
    }
    writer.write_kept(fmt::format("{}/lidar/{:06}_lcam_front_lidar.ply", path, frame), [&] {
      std::vector<Vector3d> places = deskewed_places(scans, frame, points);
      for (Vector3d& place : places) place = native_from_rdf() * (camera_from_sensor * place);
      return ply_of(places);
    });
  });
  if (most_of_frame > kMostOfReader)
    context.log.warn("tartanair: a scan of {} has {} points; TartanAir's own have {} at most",
                     scans.name(), most_of_frame.load(), kMostOfReader);
  return describe_lidar(scans, num_points);
}

core::Json write_tartanair_imu(const capture::SequenceReader& sequence, const std::string& rig,
                               int left, const std::string& path, DatasetWriter& writer,
                               const core::Context& context) {
  const capture::SequenceInfo& info = sequence.info();
  const capture::CameraCalibration& camera = info.cameras[static_cast<std::size_t>(left)];
  const int index = find_imu(info, rig, [&](const capture::StreamInfo& imu) {
    const std::string why = why_not(imu, camera, info.rate_hz);
    if (!why.empty())
      context.log.warn("tartanair: {}: imu/ is not of {}/{}: {}", info.name, imu.rig, imu.name,
                       why);
    return why.empty();
  });
  if (index < 0) return {};
  const capture::StreamInfo& imu = info.streams[static_cast<std::size_t>(index)];
  const std::vector<ImuState> states = imu_states(sequence, index);
  const auto step =
      static_cast<std::size_t>(std::llround(imu.rate_hz / (kSamplesPerFrame * info.rate_hz)));
  const geo::WorldFrame local(local_frame(sequence).origin);
  const geo::Rigid3d enu_from_ecef = local.ecef_from_world().inverse();
  const Matrix3d ned_from_enu = (Matrix3d() << 0, 1, 0, 1, 0, 0, 0, 0, -1).finished();
  const Matrix3d ned_from_ecef = ned_from_enu * enu_from_ecef.rotation.toRotationMatrix();
  const Matrix3d sensor_from_body =
      (imu.rig_from_sensor.inverse() * camera.rig_from_camera).rotation.toRotationMatrix() *
      rdf_from_frd();
  const Vector3d earth_radps = geo::kEarthRate_radps * Vector3d::UnitZ();
  const Vector3d gravity_ned_mps2(0.0, 0.0, kTartanAirGravity_mps2);

  Table imu_time{"imu_time", 1}, acc{"acc", 3}, gyro{"gyro", 3}, pos{"pos_global", 3},
      vel{"vel_global", 3}, ori{"ori_global", 3}, vel_body{"vel_body", 3},
      acc_nograv{"acc_nograv", 3}, acc_nograv_body{"acc_nograv_body", 3};
  const int num_rows = (info.num_frames - 1) * kSamplesPerFrame;
  for (int k = 0; k < num_rows; ++k) {
    const ImuState& state = states.at(static_cast<std::size_t>(k) * step);
    const Matrix3d ecef_from_sensor = state.ecef_from_sensor.rotation.toRotationMatrix();
    const Matrix3d ned_from_body = ned_from_ecef * ecef_from_sensor * sensor_from_body;
    const Vector3d place_enu = enu_from_ecef * state.ecef_from_sensor.translation;
    const Vector3d gravity_ecef =
        enu_from_ecef.rotation.conjugate() * geo::gravity_world_mps2(local, place_enu);
    // The sensor shows acceleration and Coriolis' force less gravity.
    const Vector3d acceleration_ned =
        ned_from_ecef * (ecef_from_sensor * state.true_accel_mps2 + gravity_ecef -
                         2.0 * earth_radps.cross(state.velocity_ecef_mps));
    const Vector3d velocity_ned = ned_from_ecef * state.velocity_ecef_mps;
    imu_time.values.push_back(k / (kSamplesPerFrame * info.rate_hz));
    acc.add(ned_from_body.transpose() * (acceleration_ned - gravity_ned_mps2));
    gyro.add(sensor_from_body.transpose() * state.rate_on_earth_radps());
    pos.add(ned_from_enu * place_enu);
    vel.add(velocity_ned);
    ori.add(euler_xyz(ned_from_body));
    vel_body.add(ned_from_body.transpose() * velocity_ned);
    acc_nograv.add(acceleration_ned);
    acc_nograv_body.add(ned_from_body.transpose() * acceleration_ned);
  }
  for (const Table* table :
       {&imu_time, &acc, &gyro, &pos, &vel, &ori, &vel_body, &acc_nograv, &acc_nograv_body}) {
    writer.write(fmt::format("{}/imu/{}.npy", path, table->name),
                 core::npy_bytes(table->values, table->shape()));
    writer.write(fmt::format("{}/imu/{}.txt", path, table->name), table->text());
  }
  std::vector<float> camera_times;
  Table cam_time{"cam_time", 1};
  for (const capture::FrameRecord& record : sequence.frames()) {
    cam_time.values.push_back(record.time_s);
    camera_times.push_back(static_cast<float>(record.time_s));
  }
  writer.write(path + "/imu/cam_time.npy", core::npy_bytes(camera_times, cam_time.shape()));
  writer.write(path + "/imu/cam_time.txt", cam_time.text());
  writer.write(path + "/imu/parameter.yaml", fmt::format("img_fps: {}\nimu_fps: {}\n", info.rate_hz,
                                                         kSamplesPerFrame * info.rate_hz));
  return core::Json::object()
      .set("rig", imu.rig)
      .set("name", imu.name)
      .set("num_samples", num_rows);
}

}  // namespace terracast::exporters
