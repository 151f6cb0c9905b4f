#include "export/imu_states.h"

#include "export/stream_columns.h"
#include "geo/gravity.h"

namespace terracast::exporters {

Eigen::Vector3d ImuState::rate_on_earth_radps() const {
  const Eigen::Vector3d earth_radps = geo::kEarthRate_radps * Eigen::Vector3d::UnitZ();
  return true_gyro_radps - ecef_from_sensor.rotation.conjugate() * earth_radps;
}

std::vector<ImuState> imu_states(const capture::SequenceReader& sequence, int stream_index) {
  const capture::StreamInfo& stream =
      sequence.info().streams[static_cast<std::size_t>(stream_index)];
  const capture::Samples samples = sequence.read_samples(stream_index);
  const StreamColumns columns(stream);
  const std::size_t gyro = columns.at("gyro_x_radps"), accel = columns.at("accel_x_mps2"),
                    true_gyro = columns.at("true_gyro_x_radps"),
                    true_accel = columns.at("true_accel_x_mps2"), place = columns.at("ecef_x_m"),
                    attitude = columns.at("ecef_qw"), velocity = columns.at("ecef_vx_mps");
  std::vector<ImuState> states;
  states.reserve(samples.times_s.size());
  for (std::size_t i = 0; i < samples.times_s.size(); ++i) {
    const double* row = &samples.values[i * stream.channels.size()];
    const auto three = [row](std::size_t first) {
      return Eigen::Vector3d(row[first], row[first + 1], row[first + 2]);
    };
    const double* q = row + attitude;
    states.push_back({.time_s = samples.times_s[i],
                      .ecef_from_sensor = {Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized(),
                                           three(place)},
                      .velocity_ecef_mps = three(velocity),
                      .gyro_radps = three(gyro),
                      .accel_mps2 = three(accel),
                      .true_gyro_radps = three(true_gyro),
                      .true_accel_mps2 = three(true_accel)});
  }
  return states;
}

bool samples_instants(const capture::StreamInfo& imu) {
  return imu.settings_toml.find("sampling = \"instant\"") != std::string::npos;
}

}  // namespace terracast::exporters
