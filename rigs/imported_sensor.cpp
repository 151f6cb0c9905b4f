#include "rigs/imported_sensor.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/toml_reader.h"

namespace terracast::rigs {

namespace {

constexpr const char* kKeys = "keys of a sensor";

/// Yaw, pitch and roll that turn a sensor, intrinsic about z, y and x. Straight up or down yaw and roll turn about one
/// axis: what yaw is then hardly matters, as roll is what it leaves.
std::vector<double> euler_deg(const Eigen::Matrix3d& turn) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  const double yaw = std::atan2(turn(1, 0), turn(0, 0));
  const double c = std::cos(yaw), s = std::sin(yaw);
  const double pitch = std::atan2(-turn(2, 0), c * turn(0, 0) + s * turn(1, 0));
  const double roll = std::atan2(s * turn(0, 2) - c * turn(1, 2), c * turn(1, 1) - s * turn(0, 1));
  return {yaw / kDegree, pitch / kDegree, roll / kDegree};
}

/// What is wrong with a key, without the line that it would have in a file of ours.
std::string without_line(const std::string& message) {
  if (!message.starts_with(kKeys)) return message;
  const std::size_t end = message.find(": ");
  return end == std::string::npos ? message : message.substr(end + 2);
}

}  // namespace

sensors::SensorOptions sensor_of_keys(const std::string& where, const std::string& toml,
                                      const geo::Rigid3d& rig_from_sensor) {
  sensors::SensorOptions sensor;
  try {
    core::TomlDocument::parse(toml, kKeys).read(sensor);
    if (rig_from_sensor.translation.norm() > 0.0) {
      const Eigen::Vector3d offset_mm = 1e3 * rig_from_sensor.translation;
      sensor.offset_mm = {offset_mm.x(), offset_mm.y(), offset_mm.z()};
    }
    if (rig_from_sensor.rotation.vec().norm() > 0.0)
      sensor.euler_deg = euler_deg(rig_from_sensor.rotation.toRotationMatrix());
    sensor.validate();
  } catch (const core::Error& error) {
    if (error.kind() != core::ErrorKind::Config) throw;
    core::fail(core::ErrorKind::Input, "{}: {}", where, without_line(error.message()));
  }
  return sensor;
}

sensors::SensorOptions imu_of_noise(const std::string& where, const std::string& name,
                                    const ImuNoise& noise, const geo::Rigid3d& rig_from_sensor) {
  return sensor_of_keys(
      where,
      fmt::format("name = \"{}\"\nkind = \"imu\"\nrate_hz = {}\n"
                  "[gyroscope]\nnoise_radps_per_sqrt_hz = {}\n"
                  "walk_radps_per_s_per_sqrt_hz = {}\n"
                  "[accelerometer]\nnoise_mps2_per_sqrt_hz = {}\n"
                  "walk_mps2_per_s_per_sqrt_hz = {}\n",
                  name, noise.rate_hz, noise.gyro_noise_radps_per_sqrt_hz,
                  noise.gyro_walk_radps_per_s_per_sqrt_hz, noise.accel_noise_mps2_per_sqrt_hz,
                  noise.accel_walk_mps2_per_s_per_sqrt_hz),
      rig_from_sensor);
}

}  // namespace terracast::rigs
