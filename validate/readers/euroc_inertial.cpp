#include "validate/readers/euroc_inertial.h"

#include <algorithm>
#include <cmath>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/printable.h"
#include "validate/geodesy.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

using core::ErrorKind;
using core::fail;
using Eigen::Vector3d;

std::int64_t nanoseconds(double time_s) { return std::llround(1e9 * time_s); }

Vector3d three(const StampedRow& row, std::size_t first) {
  Vector3d vector;
  for (std::size_t i = 0; i < 3; ++i)
    vector[static_cast<Eigen::Index>(i)] = parse_number(row.cells[first + i], row.where);
  return vector;
}

EurocState state_of(const StampedRow& row) {
  EurocState state;
  for (std::size_t i = 0; i < 4; ++i)
    state.rotation_wxyz[i] = parse_number(row.cells[3 + i], row.where);
  const auto& q = state.rotation_wxyz;
  const Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
  constexpr double kUnitLength = 1e-9;
  if (!(std::abs(rotation.norm() - 1.0) <= kUnitLength))
    fail(ErrorKind::Input, "{}: a quaternion of length {}, not 1", row.where, rotation.norm());
  state.local_from_body = {rotation.normalized().toRotationMatrix(), three(row, 0)};
  state.velocity_mps = three(row, 7);
  state.gyro_bias_radps = three(row, 10);
  state.accel_bias_mps2 = three(row, 13);
  return state;
}

/// Why a row's state is not the one that the IMU tells; empty: it is.
std::string wrong_state(const EurocState& found, const ImuState& imu, const Pose& local_from_ecef) {
  // Nine decimals of places and speeds, of coordinates that are rounded to 1e-9 m; fifteen of a quaternion.
  constexpr double kPlace_m = 5e-8, kSpeed_mps = 5e-9, kAngle_rad = 1e-11;
  const Pose right = local_from_ecef * imu.ecef_from_sensor;
  const auto angle_to = [&right](const Eigen::Matrix3d& rotation) {
    return rotation_angle_rad(right.rotation.transpose() * rotation);
  };
  const double way_m = (found.local_from_body.translation - right.translation).norm();
  const double angle_rad = angle_to(found.local_from_body.rotation);
  if (!(angle_rad <= kAngle_rad)) {
    const auto& q = found.rotation_wxyz;
    const Eigen::Quaterniond exchanged(q[3], q[0], q[1], q[2]);
    if (angle_to(exchanged.toRotationMatrix()) <= kAngle_rad)
      return "quaternions stand as x y z w; w x y z is right";
    if (angle_to(found.local_from_body.rotation.transpose()) <= kAngle_rad)
      return "rotations are from R to the body; from the body to R is right";
    return fmt::format("attitudes are {:.3g} deg off the IMU's", degrees_from_radians(angle_rad));
  }
  if (!(way_m <= kPlace_m)) return fmt::format("places are {:.3g} m off the IMU's", way_m);
  const Vector3d velocity = local_from_ecef.rotation * imu.velocity_ecef_mps;
  if (!((found.velocity_mps - velocity).norm() <= kSpeed_mps)) {
    if ((right.rotation * found.velocity_mps - velocity).norm() <= 3.0 * kSpeed_mps)
      return "velocities are along the body's axes; along R's is right";
    return fmt::format("velocities are {:.3g} m/s off the IMU's",
                       (found.velocity_mps - velocity).norm());
  }
  if (found.gyro_bias_radps != imu.gyro_bias_radps || found.accel_bias_mps2 != imu.accel_bias_mps2)
    return "biases are not the IMU's";
  return {};
}

/// Between two samples a bias lies between theirs.
bool lies_between(const Vector3d& bias, const Vector3d& before, const Vector3d& after) {
  constexpr double kRounding = 1e-12;
  const Vector3d margin = kRounding * (before.cwiseAbs() + after.cwiseAbs());
  return ((bias - before.cwiseMin(after) + margin).array() >= 0.0).all() &&
         ((before.cwiseMax(after) - bias + margin).array() >= 0.0).all();
}

/// Why a row's readings are not those that the IMU shows; empty: they are.
std::string wrong_reading(const Vector3d& turn_rate, const Vector3d& force, const double* shown) {
  const Vector3d right_rate(shown[0], shown[1], shown[2]),
      right_force(shown[3], shown[4], shown[5]);
  if (turn_rate == right_rate && force == right_force) return {};
  if (turn_rate == right_force && force == right_rate)
    return "forces stand before turn rates; turn rates first is right";
  constexpr double kSameDigits = 1e-9;
  const auto is_near = [](const Vector3d& a, const Vector3d& b) {
    return (a - b).norm() <= kSameDigits * b.norm();
  };
  if (is_near(turn_rate, Vector3d(right_rate * degrees_from_radians(1.0))))
    return "turn rates are in degrees a second; radians are right";
  if (is_near(turn_rate, Vector3d(-right_rate))) return "turn rates have the other sign";
  if (is_near(force, Vector3d(-right_force))) return "forces have the other sign";
  return "other readings than the IMU shows";
}

/// A number of an IMU's settings, by section and start of its key.
double setting_of(const std::string& toml, const std::string& section, const std::string& key,
                  const std::string& where) {
  bool is_there = false;
  for (const TextLine& line : split_lines(toml)) {
    if (line.text.starts_with("[")) is_there = line.text == "[" + section + "]";
    const std::size_t equals = line.text.find('=');
    if (is_there && line.text.starts_with(key) && equals != std::string_view::npos)
      return parse_number(trimmed(line.text.substr(equals + 1)), where);
  }
  fail(ErrorKind::Input, "{}: settings_toml has no {} of {}", where, key, section);
}

void check_densities(const YamlKeys& yaml, const std::string& start, const SensorRecord& imu) {
  for (const char* instrument : {"gyroscope", "accelerometer"})
    for (const auto& [theirs, ours] :
         {std::array{"_noise_density", "noise_"}, std::array{"_random_walk", "walk_"}}) {
      const std::string key = start + instrument + theirs;
      const double right = setting_of(imu.settings_toml, instrument, ours, imu.file);
      if (yaml.number(key) != right)
        fail(ErrorKind::Input, "{} = {}, but {} in its settings", yaml.where(key), yaml.number(key),
             right);
    }
}

void check_rate(const YamlKeys& yaml, const std::string& key, double right_hz) {
  if (yaml.number(key) != right_hz)
    fail(ErrorKind::Input, "{} = {}, but {} Hz in sensors.json", yaml.where(key), yaml.number(key),
         right_hz);
}

}  // namespace

std::vector<SensorRecord> euroc_imus(const Dataset& dataset, const Sequence& sequence) {
  std::vector<SensorRecord> imus = read_sensors(dataset, sequence);
  std::erase_if(imus, [&](const SensorRecord& sensor) {
    return sensor.kind != "imu" ||
           std::none_of(sequence.cameras.begin(), sequence.cameras.end(),
                        [&](const Camera& camera) { return camera.rig == sensor.rig; });
  });
  return imus;
}

std::vector<StampedRow> stamped_rows(std::string_view text, const std::string& path,
                                     std::size_t num_columns) {
  const std::vector<TextLine> lines = split_lines(text);
  if (lines.empty() || !lines[0].text.starts_with("#"))
    fail(ErrorKind::Input, "{}:1: a first line that does not begin with #", path);
  std::vector<StampedRow> rows;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    StampedRow row;
    row.where = path + ":" + std::to_string(lines[i].number);
    row.cells = split_at(lines[i].text, ',');
    if (row.cells.size() != num_columns)
      fail(ErrorKind::Input, "{}: {} columns, not {}", row.where, row.cells.size(), num_columns);
    row.stamp_ns = parse_integer(row.cells[0], row.where);
    row.cells.erase(row.cells.begin());
    if (!rows.empty() && row.stamp_ns <= rows.back().stamp_ns)
      fail(ErrorKind::Input, "{}: a stamp that is not after the one before it", row.where);
    rows.push_back(std::move(row));
  }
  return rows;
}

Pose read_t_bs(const YamlKeys& yaml) {
  if (yaml.number("T_BS.cols") != 4.0 || yaml.number("T_BS.rows") != 4.0)
    fail(ErrorKind::Input, "{}: another size than 4 x 4", yaml.where("T_BS"));
  const std::vector<double> n = yaml.numbers("T_BS.data", 16);
  const Eigen::Matrix4d m =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(n.data());
  const Pose pose{m.topLeftCorner<3, 3>(), m.topRightCorner<3, 1>()};
  constexpr double kRotation = 1e-9;
  if (!pose.rotation.isUnitary(kRotation) || !(pose.rotation.determinant() > 0.0) ||
      m.row(3) != Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0))
    fail(ErrorKind::Input, "{} is no rigid motion", yaml.where("T_BS"));
  return pose;
}

std::string stamp_difference(std::int64_t found_ns, std::int64_t right_ns, std::int64_t start_ns) {
  struct Unit {
    const char* words;
    std::int64_t nanoseconds;
  };
  for (const Unit& unit : {Unit{"seconds", 1'000'000'000}, Unit{"milliseconds", 1'000'000},
                           Unit{"microseconds", 1'000}})
    if (found_ns == right_ns / unit.nanoseconds ||
        found_ns == (right_ns + unit.nanoseconds / 2) / unit.nanoseconds)
      return fmt::format("stamps are in {}; nanoseconds are right", unit.words);
  if (found_ns == right_ns - start_ns) return "stamps count from the start; from 1970 is right";
  // Of a double of seconds, in which a step is 238 ns.
  constexpr std::int64_t kDouble_ns = 240;
  const std::int64_t off_ns = found_ns - right_ns;
  if (std::abs(off_ns) < kDouble_ns)
    return fmt::format("a stamp is {} ns off, as by way of a double of seconds", off_ns);
  return fmt::format("a stamp is {:.9f} s off", 1e-9 * static_cast<double>(off_ns));
}

EurocStates read_euroc_states(const Dataset& dataset, const Sequence& sequence,
                              const std::vector<SensorRecord>& imus, std::int64_t start_ns,
                              Findings& findings) {
  constexpr std::size_t kColumns = 17;
  const std::string folder = sequence.path + "/mav0/state_groundtruth_estimate0";
  const std::string path = folder + "/data.csv";
  EurocStates states;
  findings.attempt(path, [&] {
    const std::string text = core::read_text_file(dataset.root / path);
    for (const StampedRow& row : stamped_rows(text, path, kColumns))
      states.emplace(row.stamp_ns, state_of(row));
  });
  const std::string yaml_path = folder + "/sensor.yaml";
  findings.attempt(yaml_path, [&] {
    const Pose pose =
        read_t_bs(YamlKeys(core::read_text_file(dataset.root / yaml_path), yaml_path));
    if (!pose.rotation.isIdentity(0.0) || !pose.translation.isZero(0.0))
      fail(ErrorKind::Input, "{}: T_BS is not the identity, but the truth is the body's",
           yaml_path);
  });
  if (imus.empty() || states.empty()) return states;
  const SensorRecord& imu = imus.front();
  const Pose local_from_ecef = ecef_from_local(sequence.origin).inverse();
  findings.attempt(path, [&] {
    std::map<std::int64_t, ImuState> right;
    for (std::size_t k = 0; k < imu.times_s.size(); ++k)
      if (const auto state = imu.imu_state(k))
        right.emplace(start_ns + nanoseconds(imu.times_s[k]), *state);
    for (const auto& [stamp_ns, state] : right) {
      const auto found = states.find(stamp_ns);
      if (found == states.end())
        fail(ErrorKind::Input, "{}: no row of {}, when imu0 has a sample", path, stamp_ns);
      if (const std::string wrong = wrong_state(found->second, state, local_from_ecef);
          !wrong.empty())
        fail(ErrorKind::Input, "{}: {} ({})", path, wrong, stamp_ns);
    }
    for (const auto& [stamp_ns, state] : states) {
      const auto after = right.lower_bound(stamp_ns);
      if (right.empty() || (after != right.end() && after->first == stamp_ns)) continue;
      const ImuState& next = (after == right.end() ? std::prev(after) : after)->second;
      const ImuState& last = (after == right.begin() ? after : std::prev(after))->second;
      if (!lies_between(state.gyro_bias_radps, last.gyro_bias_radps, next.gyro_bias_radps) ||
          !lies_between(state.accel_bias_mps2, last.accel_bias_mps2, next.accel_bias_mps2))
        fail(ErrorKind::Input, "{}: biases of {} are not between those of the samples beside it",
             path, stamp_ns);
    }
  });
  return states;
}

void check_euroc_imu(const Dataset& dataset, const Sequence& sequence,
                     const std::vector<SensorRecord>& imus, std::size_t number,
                     std::int64_t start_ns, Findings& findings) {
  constexpr std::size_t kColumns = 7;
  const SensorRecord& imu = imus[number];
  const std::string folder = fmt::format("{}/mav0/imu{}", sequence.path, number);
  const std::string path = folder + "/data.csv";
  findings.attempt(path, [&] {
    const std::string text = core::read_text_file(dataset.root / path);
    const std::vector<StampedRow> rows = stamped_rows(text, path, kColumns);
    if (rows.size() != imu.times_s.size())
      fail(ErrorKind::Input, "{}: {} rows for {} samples of {}", path, rows.size(),
           imu.times_s.size(), imu.file);
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const std::int64_t right_ns =
          start_ns + nanoseconds(imu.stated_s(k, sequence.states_sensor_stamps));
      if (rows[k].stamp_ns != right_ns)
        fail(ErrorKind::Input, "{}: {}", rows[k].where,
             stamp_difference(rows[k].stamp_ns, right_ns, start_ns));
      const std::string wrong =
          wrong_reading(three(rows[k], 0), three(rows[k], 3), &imu.values[k * imu.num_channels]);
      if (!wrong.empty()) fail(ErrorKind::Input, "{}: {}", rows[k].where, wrong);
    }
  });
  const std::string yaml_path = folder + "/sensor.yaml";
  findings.attempt(yaml_path, [&] {
    const YamlKeys yaml(core::read_text_file(dataset.root / yaml_path), yaml_path);
    if (yaml.word("sensor_type") != "imu" || yaml.word("comment") != imu.rig + "/" + imu.name)
      fail(ErrorKind::Input, "{}: the sensor is not the IMU {}/{}", yaml_path, imu.rig, imu.name);
    check_rate(yaml, "rate_hz", imu.rate_hz);
    check_densities(yaml, "", imu);
    const Pose right = imus.front().body_from_sensor.inverse() * imu.body_from_sensor;
    const Pose found = read_t_bs(yaml);
    constexpr double kRounding = 1e-12;
    if (!((found.rotation - right.rotation).norm() <= kRounding) ||
        !((found.translation - right.translation).norm() <=
          kRounding * (1.0 + right.translation.norm())))
      fail(ErrorKind::Input, "{}: T_BS is not that of sensors.json", yaml_path);
  });
  const std::string kalibr =
      fmt::format("{}/kalibr/imu{}.yaml", sequence.path, number == 0 ? "" : std::to_string(number));
  findings.attempt(kalibr, [&] {
    const YamlKeys yaml(core::read_text_file(dataset.root / kalibr), kalibr);
    check_rate(yaml, "update_rate", imu.rate_hz);
    check_densities(yaml, "", imu);
    if (yaml.word("rostopic") != fmt::format("/imu{}", number))
      fail(ErrorKind::Input, "{}: another rostopic than /imu{}", kalibr, number);
  });
  if (number > 0) return;
  const std::string openvins = sequence.path + "/openvins/kalibr_imu_chain.yaml";
  findings.attempt(openvins, [&] {
    const YamlKeys yaml(core::read_text_file(dataset.root / openvins), openvins);
    check_rate(yaml, "imu0.update_rate", imu.rate_hz);
    check_densities(yaml, "imu0.", imu);
    for (const auto& [key, size] :
         {std::pair{"T_i_b", 4}, std::pair{"Tw", 3}, std::pair{"R_IMUtoGYRO", 3},
          std::pair{"Ta", 3}, std::pair{"R_IMUtoACC", 3}, std::pair{"Tg", 3}}) {
      const std::string name = std::string("imu0.") + key;
      const auto count = static_cast<std::size_t>(size * size);
      const std::vector<double> found = yaml.numbers(name, count);
      for (std::size_t i = 0; i < count; ++i) {
        const bool is_diagonal = i % static_cast<std::size_t>(size + 1) == 0;
        const double right = is_diagonal && std::string_view(key) != "Tg" ? 1.0 : 0.0;
        if (found[i] != right)
          fail(ErrorKind::Input, "{}: {} where {} is right", yaml.where(name), found[i], right);
      }
    }
  });
}

}  // namespace terracast::validate
