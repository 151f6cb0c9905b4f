#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "validate/dataset.h"
#include "validate/readers/sensors.h"
#include "validate/readers/yaml_keys.h"

/// What EuRoC's layout says of IMUs and of the truth.
namespace terracast::validate {

/// A row of the truth: a pose of the body in R, the velocity, and the two biases.
struct EurocState {
  Pose local_from_body;
  std::array<double, 4> rotation_wxyz{};
  Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_bias_radps = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias_mps2 = Eigen::Vector3d::Zero();
};
using EurocStates = std::map<std::int64_t, EurocState>;  ///< by nanoseconds since 1970

/// The IMUs of the exported rigs, imu0 first.
/// throws   Input: sensors.json or samples are damaged; Io
std::vector<SensorRecord> euroc_imus(const Dataset& dataset, const Sequence& sequence);

/// A row's cells behind its stamp.
/// count   of them
struct StampedRow {
  std::int64_t stamp_ns = 0;
  std::vector<std::string_view> cells;
  std::string where;
};
/// The rows of a data.csv, whose stamps rise; the first line begins with #.
/// text     is viewed
/// throws   Input: another form, number of columns or order
std::vector<StampedRow> stamped_rows(std::string_view text, const std::string& path,
                                     std::size_t num_columns);

/// T_BS of a sensor.yaml.
/// throws   Input: no rigid motion
Pose read_t_bs(const YamlKeys& yaml);

/// What is wrong with a stamp, in words: in which unit it counts, or from where; else how far it is off.
std::string stamp_difference(std::int64_t found_ns, std::int64_t right_ns, std::int64_t start_ns);

/// state_groundtruth_estimate0; of an IMU that tells its state, each sample's row against it.
EurocStates read_euroc_states(const Dataset& dataset, const Sequence& sequence,
                              const std::vector<SensorRecord>& imus, std::int64_t start_ns,
                              Findings& findings);

/// imuK: its rows against what sensors/ says that it shows, its yaml and Kalibr's against its settings.
void check_euroc_imu(const Dataset& dataset, const Sequence& sequence,
                     const std::vector<SensorRecord>& imus, std::size_t number,
                     std::int64_t start_ns, Findings& findings);

}  // namespace terracast::validate
