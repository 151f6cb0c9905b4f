#include "rigs/imported_sensor.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/toml_reader.h"

namespace terracast::rigs {

namespace {

/// Yaw, pitch and roll that turn a sensor, intrinsic about z, y and x. Straight up or down yaw and roll turn about one
/// axis: all of it is called yaw.
std::vector<double> euler_deg(const Eigen::Matrix3d& turn) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  constexpr double kUpright = 1e-9;
  const double level = std::hypot(turn(0, 0), turn(1, 0));
  const bool is_upright = level < kUpright;
  return {(is_upright ? std::atan2(-turn(0, 1), turn(1, 1)) : std::atan2(turn(1, 0), turn(0, 0))) /
              kDegree,
          std::atan2(-turn(2, 0), level) / kDegree,
          (is_upright ? 0.0 : std::atan2(turn(2, 1), turn(2, 2))) / kDegree};
}

}  // namespace

sensors::SensorOptions sensor_of_keys(const std::string& toml,
                                      const geo::Rigid3d& rig_from_sensor) {
  sensors::SensorOptions sensor;
  core::TomlDocument::parse(toml, "the sensor").read(sensor);
  if (rig_from_sensor.translation.norm() > 0.0) {
    const Eigen::Vector3d offset_mm = 1e3 * rig_from_sensor.translation;
    sensor.offset_mm = {offset_mm.x(), offset_mm.y(), offset_mm.z()};
  }
  if (rig_from_sensor.rotation.vec().norm() > 0.0)
    sensor.euler_deg = euler_deg(rig_from_sensor.rotation.toRotationMatrix());
  return sensor;
}

sensors::SensorOptions imu_of_noise(const std::string& name, const ImuNoise& noise,
                                    const geo::Rigid3d& rig_from_sensor) {
  return sensor_of_keys(
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
