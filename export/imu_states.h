#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "capture/frame_reader.h"
#include "geo/rigid3.h"

/// What an IMU of a capture shows and where it then is, for formats that want more than its readings.
namespace terracast::exporters {

/// A sample.
struct ImuState {
  double time_s = 0.0;
  geo::Rigid3d ecef_from_sensor;                                ///< true
  Eigen::Vector3d velocity_ecef_mps = Eigen::Vector3d::Zero();  ///< true, against the Earth
  Eigen::Vector3d gyro_radps = Eigen::Vector3d::Zero();         ///< shown
  Eigen::Vector3d accel_mps2 = Eigen::Vector3d::Zero();         ///< shown
  Eigen::Vector3d true_gyro_radps = Eigen::Vector3d::Zero();
  Eigen::Vector3d true_accel_mps2 = Eigen::Vector3d::Zero();

  /// True turn rate against the Earth, along the sensor's axes.
  Eigen::Vector3d rate_on_earth_radps() const;
};

/// The first IMU of a rig for which `fits` holds; -1: there is none.
template <class Fits>
int find_imu(const capture::SequenceInfo& info, const std::string& rig, const Fits& fits) {
  for (std::size_t i = 0; i < info.streams.size(); ++i)
    if (info.streams[i].kind == "imu" && info.streams[i].rig == rig && fits(info.streams[i]))
      return static_cast<int>(i);
  return -1;
}

/// All samples of an IMU.
/// throws   Input: an earlier version captured it, or it is damaged
std::vector<ImuState> imu_states(const capture::SequenceReader& sequence, int stream_index);

/// Whether its samples are those of instants, not means.
bool samples_instants(const capture::StreamInfo& imu);

}  // namespace terracast::exporters
