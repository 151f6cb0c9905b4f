#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/error.h"
#include "validate/checks/checker.h"
#include "validate/checks/contradictions.h"
#include "validate/inertial.h"
#include "validate/npy.h"
#include "validate/readers/oxts.h"
#include "validate/readers/sensors.h"
#include "validate/readers/tartanair_files.h"
#include "validate/text.h"

/// An IMU in the format's own files: TartanAir's imu/, the packets of KITTI raw's unsynchronised drive; each row against the
/// sensor's own sample.
namespace terracast::validate {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Places of a sensor's channels.
enum Reading : std::size_t { kGyro = 0, kAccel = 3, kTrueGyro = 6, kTrueAccel = 9 };

Vector3d three_of(const SensorRecord& imu, std::size_t sample, Reading first) {
  const double* row = imu.row(sample) + static_cast<std::size_t>(first);
  return {row[0], row[1], row[2]};
}

/// Rows of a few numbers: an npy, and the same as text beside it.
struct Rows {
  std::size_t num_rows = 0, width = 1;
  std::vector<double> values;

  double at(std::size_t row, std::size_t column = 0) const { return values[row * width + column]; }
  Vector3d three(std::size_t row) const { return {at(row, 0), at(row, 1), at(row, 2)}; }
};

Rows parse_rows(const NpyArray& array, std::size_t item_size, const std::string& name) {
  if (array.kind != 'f' || array.item_size != item_size || array.shape.empty() ||
      array.shape.size() > 2)
    core::fail(core::ErrorKind::Input, "{}: not an array of float{} of one or two dimensions", name,
               8 * item_size);
  Rows rows{.num_rows = array.shape[0],
            .width = array.shape.size() == 2 ? array.shape[1] : 1,
            .values = {}};
  for (std::size_t i = 0; i < array.num_values(); ++i) {
    double value = 0.0;
    if (item_size == sizeof(double)) {
      std::memcpy(&value, array.bytes.data() + i * item_size, item_size);
    } else {
      float number = 0.0F;
      std::memcpy(&number, array.bytes.data() + i * item_size, item_size);
      value = static_cast<double>(number);
    }
    if (!std::isfinite(value))
      core::fail(core::ErrorKind::Input, "{}: number {} is not finite", name, i);
    rows.values.push_back(value);
  }
  return rows;
}

class ImuFilesChecker : public Checker {
 public:
  explicit ImuFilesChecker(const ValidateOptions& options) : is_trial_(options.is_trial) {}

  std::vector<CheckResult> finish(const Dataset& dataset, const Sequence& sequence) override {
    constexpr const char* kName = "imu_files";
    const std::string extract = extract_folder(dataset, sequence);
    const bool is_tartanair =
        dataset.format == "tartanair" && dataset.files.contains(sequence.path + "/imu/acc.npy");
    if (is_trial_ || (extract.empty() && !is_tartanair))
      return {skipped_result(kName, "the format's own files hold no IMU")};
    try {
      const std::vector<SensorRecord> sensors = read_sensors(dataset, sequence);
      if (is_tartanair)
        compare_tartanair(dataset, sequence, sensors);
      else
        compare_packets(dataset, sequence, sensors, extract);
    } catch (const core::Error& error) {
      if (error.kind() != core::ErrorKind::Input && error.kind() != core::ErrorKind::Io) throw;
      files_.expect(false, "{}", error.message());
    }
    CheckResult result = files_.result(kName);
    result.summary = fmt::format(
        "{} samples of an IMU in the format's files: times, places, "
        "attitudes, velocities, forces and turn rates against its own.",
        num_samples_);
    result.reason = "They follow from the same samples, to rounding.";
    result.detects = "another gravity, axes or sign, a row too many, samples of another time";
    if (!result.ok) result.mistake = mistake_;
    return {result};
  }

 private:
  static std::string extract_folder(const Dataset& dataset, const Sequence& sequence) {
    constexpr std::string_view kSync = "_sync";
    if (dataset.format != "kitti_raw" || !sequence.path.ends_with(kSync)) return {};
    const std::string folder =
        sequence.path.substr(0, sequence.path.size() - kSync.size()) + "_extract/oxts";
    return dataset.files.contains(folder + "/timestamps.txt") ? folder : std::string();
  }

  /// sensors.json has those of all rigs, and the format's files those of the cameras' rig.
  static bool is_of_rig(const Sequence& sequence, const SensorRecord& sensor) {
    return sequence.cameras.empty() || sequence.cameras[0].rig.empty() ||
           sequence.cameras[0].rig == sensor.rig;
  }

  void off(double off, double allowed, const char* what, const std::string& where) {
    files_.expect(off <= allowed,
                  [&] { return fmt::format("{}: {} is off by {:.3g}", where, what, off); });
  }

  /// Packets of the body's reference point, with what the IMU shows along the body's axes.
  void compare_packets(const Dataset& dataset, const Sequence& sequence,
                       const std::vector<SensorRecord>& sensors, const std::string& folder) {
    const auto imu = std::find_if(sensors.begin(), sensors.end(), [&](const SensorRecord& one) {
      return one.kind == "imu" && is_of_rig(sequence, one) && std::abs(one.rate_hz - 100.0) < 1e-6;
    });
    if (imu == sensors.end())
      core::fail(core::ErrorKind::Input, "{}: no IMU of 100 Hz is in sensors.json", folder);
    const std::string times_file = folder + "/timestamps.txt";
    const std::string text = core::read_text_file(dataset.root / times_file);
    const std::vector<TextLine> lines = split_lines(text);
    num_samples_ = static_cast<std::int64_t>(imu->times_s.size());
    files_.expect(lines.size() == imu->times_s.size() && text.ends_with('\n'),
                  "{}: {} lines for {} samples", times_file, lines.size(), imu->times_s.size());
    const std::int64_t start_ns = parse_utc_ns(sequence.utc_start, "dataset.json: utc_start");
    for (std::size_t i = 0; i < std::min(lines.size(), imu->times_s.size()); ++i) {
      constexpr std::size_t kLength = 29;  // of "2011-09-26 13:02:25.964389445"
      const std::string where = fmt::format("{}:{}", times_file, i + 1);
      files_.expect(lines[i].text.size() == kLength, "{}: not nine decimals", where);
      const double time_s =
          1e-9 * static_cast<double>(parse_utc_ns(lines[i].text, where) - start_ns);
      constexpr double kHalf_s = 0.6e-9;
      off(std::abs(time_s - imu->times_s[i]), kHalf_s + 1e-15 * time_s, "its time", where);
    }
    for (std::size_t i = 0; i < imu->times_s.size(); ++i)
      compare_packet(dataset, *imu, i, fmt::format("{}/data/{:010}.txt", folder, i));
    files_.expect(
        !dataset.files.contains(fmt::format("{}/data/{:010}.txt", folder, imu->times_s.size())),
        "{}: more packets than samples", folder);
  }

  void compare_packet(const Dataset& dataset, const SensorRecord& imu, std::size_t sample,
                      const std::string& path) {
    const std::optional<ImuState> state = imu.imu_state(sample);
    if (!dataset.files.contains(path) || !state) {
      files_.expect(false, "{}: missing, or of an earlier version", path);
      return;
    }
    const OxtsPacket packet = parse_oxts(core::read_text_file(dataset.root / path), path);
    const Pose body_from_imu = imu.body_from_sensor;
    const Pose ecef_from_body = state->ecef_from_sensor * body_from_imu.inverse();
    const Matrix3d ecef_from_enu = enu_from_ecef(packet.place).transpose();
    const Vector3d earth = kEarthRate_radps * Vector3d::UnitZ();
    // A sensor off the body's middle goes round it.
    const Vector3d rate_body =
        body_from_imu.rotation *
        (three_of(imu, sample, kTrueGyro) - state->ecef_from_sensor.rotation.transpose() * earth);
    const Vector3d velocity_ecef =
        state->velocity_ecef_mps -
        ecef_from_body.rotation * rate_body.cross(body_from_imu.translation);
    off((packet.ecef_from_imu().translation - ecef_from_body.translation).norm(), 2e-6, "its place",
        path);
    off(rotation_angle_rad(packet.ecef_from_imu().rotation.transpose() * ecef_from_body.rotation),
        1e-9, "its attitude", path);
    off((ecef_from_enu * packet.velocity_enu_mps - velocity_ecef).norm(), 1e-8, "its velocity",
        path);
    off((packet.force_imu_mps2 - body_from_imu.rotation * three_of(imu, sample, kAccel)).norm(),
        2e-9, "its force", path);
    off((packet.rate_imu_radps - body_from_imu.rotation * three_of(imu, sample, kGyro)).norm(),
        2e-12, "its turn rate", path);
    off((packet.level_from_imu * packet.force_imu_mps2 - packet.force_level_mps2).norm(), 1e-8,
        "its level force", path);
    off((packet.level_from_imu * packet.rate_imu_radps - packet.rate_level_radps).norm(), 1e-11,
        "its level turn rate", path);
    off(((packet.enu_from_level().transpose() * packet.velocity_enu_mps).head<2>() -
         packet.velocity_level_mps)
            .norm(),
        1e-8, "its level velocity", path);
  }

  /// An array of the folder, with its text beside it.
  Rows rows_of(const Dataset& dataset, const std::string& folder, const std::string& name,
               std::size_t width, std::size_t num_rows, std::size_t item_size = sizeof(double)) {
    const std::string path = folder + "/" + name + ".npy";
    Rows rows = parse_rows(parse_npy(core::read_file(dataset.root / path), path), item_size, path);
    if (rows.num_rows != num_rows || rows.width != width)
      core::fail(core::ErrorKind::Input, "{}: {} x {} numbers, where {} x {} are right", path,
                 rows.num_rows, rows.width, num_rows, width);
    const std::string text_path = folder + "/" + name + ".txt";
    const std::string text = core::read_text_file(dataset.root / text_path);
    const std::vector<TextLine> lines = split_lines(text);
    files_.expect(lines.size() == num_rows, "{}: {} lines for {} rows", text_path, lines.size(),
                  num_rows);
    for (std::size_t i = 0; i < std::min(lines.size(), num_rows); ++i) {
      const std::vector<double> numbers =
          parse_numbers(lines[i].text, width, fmt::format("{}:{}", text_path, i + 1));
      for (std::size_t k = 0; k < width; ++k) {
        const double number = item_size == sizeof(float)
                                  ? static_cast<double>(static_cast<float>(numbers[k]))
                                  : numbers[k];
        files_.expect(number == rows.at(i, k), "{}:{}: another number than {} has", text_path,
                      i + 1, path);
      }
    }
    return rows;
  }

  void compare_tartanair(const Dataset& dataset, const Sequence& sequence,
                         const std::vector<SensorRecord>& sensors) {
    constexpr int kPerFrame = 10;
    const std::string folder = sequence.path + "/imu";
    const int left = sequence.camera_index("lcam_front");
    if (left < 0 || !sequence.cameras[static_cast<std::size_t>(left)].body_from_camera)
      core::fail(core::ErrorKind::Input, "{}: dataset.json says nothing of lcam_front", folder);
    const Pose body_from_camera =
        *sequence.cameras[static_cast<std::size_t>(left)].body_from_camera;
    const auto imu = std::find_if(sensors.begin(), sensors.end(), [&](const SensorRecord& one) {
      const double samples = one.rate_hz / (kPerFrame * sequence.rate_hz);
      return one.kind == "imu" && is_of_rig(sequence, one) && !one.is_integrated &&
             std::round(samples) >= 1.0 && std::abs(samples - std::round(samples)) < 1e-6 &&
             (one.body_from_sensor.translation - body_from_camera.translation).norm() < 1e-6;
    });
    if (imu == sensors.end())
      core::fail(core::ErrorKind::Input,
                 "{}: no IMU of sensors.json stands at lcam_front with ten samples a frame",
                 folder);
    const auto step =
        static_cast<std::size_t>(std::llround(imu->rate_hz / (kPerFrame * sequence.rate_hz)));
    const auto num_rows =
        static_cast<std::size_t>(sequence.num_frames - 1) * static_cast<std::size_t>(kPerFrame);
    num_samples_ = static_cast<std::int64_t>(num_rows);
    const auto all = [&](const char* name, std::size_t width = 3) {
      return rows_of(dataset, folder, name, width, num_rows);
    };
    const Rows time = all("imu_time", 1), acc = all("acc"), gyro = all("gyro"),
               pos = all("pos_global"), vel = all("vel_global"), ori = all("ori_global"),
               vel_body = all("vel_body"), acc_nograv = all("acc_nograv"),
               acc_nograv_body = all("acc_nograv_body");
    const Rows cam_time = rows_of(dataset, folder, "cam_time", 1,
                                  static_cast<std::size_t>(sequence.num_frames), sizeof(float));
    for (std::size_t i = 0; i < cam_time.num_rows; ++i)
      off(std::abs(cam_time.at(i) - static_cast<double>(i) / sequence.rate_hz),
          1e-7 * (1.0 + cam_time.at(i)), "time of a frame",
          fmt::format("{}/cam_time.npy, row {}", folder, i));
    const Pose enu_from_ecef_pose = ecef_from_local(sequence.origin).inverse();
    const Matrix3d ned_from_enu = (Matrix3d() << 0, 1, 0, 1, 0, 0, 0, 0, -1).finished();
    const Matrix3d ned_from_ecef = ned_from_enu * enu_from_ecef_pose.rotation;
    const Matrix3d sensor_from_frd = imu->body_from_sensor.rotation.transpose() *
                                     body_from_camera.rotation * frd_from_rdf().transpose();
    const Vector3d earth = kEarthRate_radps * Vector3d::UnitZ();
    std::vector<double> gravities;
    for (std::size_t k = 0; k < num_rows; ++k) {
      const std::size_t sample = k * step;
      const std::optional<ImuState> state =
          sample < imu->times_s.size() ? imu->imu_state(sample) : std::nullopt;
      if (!state) {
        files_.expect(false, "{}: row {} has no sample of {}/{}", folder, k, imu->rig, imu->name);
        return;
      }
      const std::string where = fmt::format("{}, row {}", folder, k);
      const Matrix3d ned_from_frd =
          ned_from_ecef * state->ecef_from_sensor.rotation * sensor_from_frd;
      const Vector3d acceleration =
          ned_from_ecef * (state->ecef_from_sensor.rotation * three_of(*imu, sample, kTrueAccel) +
                           normal_gravity_ecef_mps2(state->ecef_from_sensor.translation) -
                           2.0 * earth.cross(state->velocity_ecef_mps));
      const Vector3d rate =
          sensor_from_frd.transpose() * (three_of(*imu, sample, kTrueGyro) -
                                         state->ecef_from_sensor.rotation.transpose() * earth);
      const Vector3d turned = ori.three(k);
      const Matrix3d said = (Eigen::AngleAxisd(turned.x(), Vector3d::UnitX()) *
                             Eigen::AngleAxisd(turned.y(), Vector3d::UnitY()) *
                             Eigen::AngleAxisd(turned.z(), Vector3d::UnitZ()))
                                .toRotationMatrix();
      off(std::abs(time.at(k) - static_cast<double>(k) / (kPerFrame * sequence.rate_hz)), 1e-12,
          "imu_time", where);
      off((pos.three(k) - ned_from_enu * (enu_from_ecef_pose * state->ecef_from_sensor.translation))
              .norm(),
          1e-7, "pos_global", where);
      off((vel.three(k) - ned_from_ecef * state->velocity_ecef_mps).norm(), 1e-9, "vel_global",
          where);
      off(rotation_angle_rad(said.transpose() * ned_from_frd), 1e-9, "ori_global", where);
      off((gyro.three(k) - rate).norm(), 1e-11, "gyro", where);
      off((acc_nograv.three(k) - acceleration).norm(), 1e-8, "acc_nograv", where);
      off((vel_body.three(k) - ned_from_frd.transpose() * vel.three(k)).norm(), 1e-9, "vel_body",
          where);
      off((acc_nograv_body.three(k) - ned_from_frd.transpose() * acc_nograv.three(k)).norm(), 1e-9,
          "acc_nograv_body", where);
      const Vector3d gravity = ned_from_frd * acc.three(k) - acceleration;
      gravities.push_back(-gravity.z());
      off((gravity + Vector3d(0.0, 0.0, kGravity_mps2)).norm(), 1e-8, "acc", where);
    }
    name_gravity(gravities, folder);
  }

  void name_gravity(const std::vector<double>& gravities, const std::string& folder) {
    if (gravities.empty()) return;
    const auto [least, most] = std::minmax_element(gravities.begin(), gravities.end());
    constexpr double kSame_mps2 = 1e-3;
    if (*most - *least > kSame_mps2 || std::abs(*most - kGravity_mps2) <= kSame_mps2) return;
    mistake_ = CheckResult::Mistake{
        "imu_gravity",
        fmt::format("{}/acc.npy: forces hold a gravity of {:.4g} m/s², where the format has {}",
                    folder, 0.5 * (*least + *most), kGravity_mps2)};
  }

  /// The format's own, whatever the place.
  static constexpr double kGravity_mps2 = 9.8;
  bool is_trial_ = false;
  FileContradictions files_;
  std::optional<CheckResult::Mistake> mistake_;
  std::int64_t num_samples_ = 0;
};

}  // namespace

std::unique_ptr<Checker> make_imu_files_check(const ValidateOptions& options) {
  return std::make_unique<ImuFilesChecker>(options);
}

}  // namespace terracast::validate
