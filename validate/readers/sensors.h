#pragma once

#include <optional>
#include <string>
#include <vector>

#include "validate/dataset.h"

namespace terracast::validate {

/// A sensor of sensors.json with its samples.
struct SensorRecord {
  std::string rig, name, kind;
  std::string file;  ///< relative to the dataset
  double rate_hz = 0.0;
  Pose body_from_sensor, rig_from_sensor;
  double least_range_m = 0.0, most_range_m = 0.0;  ///< of a rangefinder's settings
  /// Of an IMU's settings: samples are means over the time since the one before.
  bool is_integrated = false;
  std::vector<double> times_s;
  std::vector<double> values;  ///< of all channels, sample by sample; may be infinite
  std::size_t num_channels = 0;
};

/// Reads sensors.json of a sequence and the samples that it names; of a kind that is not known, too.
/// returns  nothing where the sequence has none
/// throws   Input: what is wrong with them; Io
std::vector<SensorRecord> read_sensors(const Dataset& dataset, const Sequence& sequence);

}  // namespace terracast::validate
