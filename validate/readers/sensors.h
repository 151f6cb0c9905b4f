#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "validate/dataset.h"
#include "validate/npy.h"

namespace terracast::validate {

/// Where an IMU is and how it errs at a sample's time.
struct ImuState {
  Pose ecef_from_sensor;
  Eigen::Vector3d velocity_ecef_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_bias_radps = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias_mps2 = Eigen::Vector3d::Zero();
};

/// Of the settings of a receiver of satellites' signals.
struct GnssSettings {
  double mask_deg = 0.0;
  bool plants_pass = false, has_ionosphere = true, has_troposphere = true;
  double clock_offset_us = 0.0, clock_drift_ppb = 0.0;
  double pseudorange_noise_m = 0.0, carrier_noise_mm = 0.0, doppler_noise_hz = 0.0;
};

/// A sensor's clock as sensors.json states it: it shows t + offset_s + drift t, and stamps jitter about it.
struct SensorClock {
  double offset_s = 0.0, drift = 0.0, jitter_sd_s = 0.0;
  double believed_offset_s = 0.0, believed_drift = 0.0;
  double reading_s(double time_s) const { return time_s + offset_s + drift * time_s; }
};

/// A sensor of sensors.json with its samples.
struct SensorRecord {
  std::string rig, name, kind;
  std::string file;  ///< relative to the dataset
  double rate_hz = 0.0;
  Pose body_from_sensor, rig_from_sensor;
  double least_range_m = 0.0, most_range_m = 0.0;  ///< of settings, where it measures_ranges()
  /// Of an IMU's settings: samples are means over the time since the one before.
  bool is_integrated = false;
  double sea_level_pressure_pa = 0.0, warmer_k = 0.0;  ///< of a barometer's settings
  std::string settings_toml;
  std::vector<double> times_s;
  std::optional<SensorClock> clock;  ///< nothing: it shows the time
  std::vector<double> stamps_s;  ///< by its clock, of each sample; of scans they stay in the files
  std::vector<double> values;    ///< of all channels, sample by sample; may be infinite
  std::size_t num_channels = 0;
  bool is_scan = false;  ///< `file` is the folder of its scans; times and values stay there
  /// Of a lidar's settings.
  std::int64_t num_rays = 1;
  double range_noise_m = 0.0, range_step_m = 0.0;
  std::vector<double>
      elevations_deg;                 ///< of rings, where the head spins; empty: of another pattern
  double beams_within_m = 0.0;        ///< so far from the sensor's middle they begin, at most
  GnssSettings gnss;                  ///< of gnss_observations
  std::vector<std::string> channels;  ///< names, without the clock's stamps

  /// Of a diagnosis: what is undone in each frame's scans after they were read; may be empty.
  std::function<void(NpyTable& scans, int frame)> change_scans;

  /// Of a diagnosis: samples before and after are not known, and nothing is compared with them.
  std::size_t first_known = 0, end_known = static_cast<std::size_t>(-1);
  bool is_known(std::size_t sample) const { return sample >= first_known && sample < end_known; }

  const double* row(std::size_t sample) const { return &values[sample * num_channels]; }

  /// When a sample was taken by the clock that a format's files state.
  /// is_by_clock   they state the sensor's own
  double stated_s(std::size_t sample, bool is_by_clock) const {
    return is_by_clock && clock ? stamps_s[sample] : times_s[sample];
  }

  /// Nothing of another kind, and of IMUs of earlier versions, which do not tell.
  std::optional<ImuState> imu_state(std::size_t sample) const;
};

/// Settings of an event camera.
struct EventSettings {
  std::string camera;  ///< through whose lens it looks; empty: its own, of so many pixels
  int width_px = 0, height_px = 0;
  double contrast_on = 0.0, contrast_off = 0.0, contrast_sd = 0.0;
  double refractory_us = 0.0;
  bool are_changes_lost = false;                     ///< within the refractory time
  double cutoff_hz = 0.0, cutoff_least_share = 1.0;  ///< of the low-pass; 0: there is none
  double leak_hz = 0.0, dark_cd_per_m2 = 0.0;
};
/// throws   Input: they are missing, or no numbers
EventSettings event_settings(const SensorRecord& sensor);

/// The scans of a scanner that begin from a frame's time to before the next one's.
/// throws   Input: other columns than sensors.json says; as parse_npy_table(); Io
NpyTable read_scans(const Dataset& dataset, const SensorRecord& scanner, int frame);
/// Its last channel is a range, or its truth, within the settings' limits or +inf.
bool measures_ranges(const SensorRecord& sensor);

/// Reads sensors.json of a sequence and the samples that it names; of a kind that is not known, too.
/// returns  nothing where the sequence has none
/// throws   Input: what is wrong with them; Io
std::vector<SensorRecord> read_sensors(const Dataset& dataset, const Sequence& sequence);

}  // namespace terracast::validate
