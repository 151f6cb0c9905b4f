#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "validate/dataset.h"
#include "validate/readers/sensors.h"
#include "validate/readers/velodyne.h"

/// The scans of a lidar as the format's own files should hold them.
namespace terracast::validate {

/// A point of a scan.
struct ScanRow {
  Eigen::Vector3d local = Eigen::Vector3d::Zero();      ///< shown, in the sequence's frame
  Eigen::Vector3d in_sensor = Eigen::Vector3d::Zero();  ///< shown, at its pulse's time
  double time_s = 0.0;
  double reflectance = 0.0;
  std::int64_t class_id = 0;
  std::int64_t instance_id = 0;
};

/// A lidar's scans, dealt to frames by their pulses' times.
class DealtScans {
 public:
  /// throws   Input: the dataset has no such lidar; as read_sensors(); Io
  DealtScans(const Dataset& dataset, const Sequence& sequence, const FormatScans& scans);

  const SensorRecord& lidar() const { return lidar_; }
  int num_frames() const { return sequence_.num_frames; }
  /// Rows with floor(time_s * rate_hz + 0.5) of a frame, in the order of their times.
  /// throws   Input: damaged scans; Io
  std::vector<ScanRow> rows(int frame);
  /// The same; nothing where they are damaged.
  std::optional<std::vector<ScanRow>> rows_if_whole(int frame);
  /// throws   as rows()
  std::int64_t num_after_last_frame();
  /// SemanticKITTI's number of a row.
  std::uint16_t label(const ScanRow& row) const;

 private:
  const std::vector<ScanRow>& rows_of_file(int frame);

  const Dataset& dataset_;
  const Sequence& sequence_;
  SensorRecord lidar_;
  std::set<std::int64_t> moving_;
  /// The two files that were read last.
  std::array<std::pair<int, std::vector<ScanRow>>, 2> files_ = {};
  std::size_t oldest_ = 0;
};

/// Where a frame's points should be, and how far off rounding may bring them.
class PlacedRows {
 public:
  PlacedRows(const Dataset& dataset, const Sequence& sequence, const FormatScans& scans,
             const std::optional<Pose>& local_from_camera, int frame,
             const std::vector<ScanRow>& rows);
  /// Distance of a file's point from where row `i` has it, as a share of what is allowed.
  double share(const Eigen::Vector3d& place, std::size_t i) const;

 private:
  const std::vector<ScanRow>& rows_;
  std::optional<Pose>
      local_from_points_;  ///< nothing: files hold points as they were at their own times
  double pose_m_ = 0.0, pose_rad_ = 0.0;
};

}  // namespace terracast::validate
