#pragma once

#include <string>

#include "geo/rigid3.h"
#include "sensors/sensor.h"

/// Sensors beside cameras that other programs' files of rigs state.
namespace terracast::rigs {

/// What calibrations say of an IMU's noise, as ours has it; 0: none.
struct ImuNoise {
  double rate_hz = 200.0;
  double gyro_noise_radps_per_sqrt_hz = 0.0;
  double gyro_walk_radps_per_s_per_sqrt_hz = 0.0;
  double accel_noise_mps2_per_sqrt_hz = 0.0;
  double accel_walk_mps2_per_s_per_sqrt_hz = 0.0;
};

/// where    "imu.yaml: imu0", for messages
/// throws   Input: noise, a rate or a place that an IMU cannot have
sensors::SensorOptions imu_of_noise(const std::string& where, const std::string& name,
                                    const ImuNoise& noise, const geo::Rigid3d& rig_from_sensor);

/// A sensor by the TOML of its keys, those of a `[[rigs.sensors]]`, placed on a rig with axes FLU.
/// where      for messages: what the file says it in
/// accuracy   places to 1e-12 m, rotations to 1e-12 rad
/// throws     Input: values that the sensor cannot have
sensors::SensorOptions sensor_of_keys(const std::string& where, const std::string& toml,
                                      const geo::Rigid3d& rig_from_sensor);

}  // namespace terracast::rigs
