#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "core/json.h"
#include "export/dataset_writer.h"
#include "export/frame_scans.h"

/// KITTI's files of a laser scanner, and SemanticKITTI's labels of its points.
namespace terracast::exporters {

/// velodyne/NNNNNN.bin: x, y, z (m, x forward, y left, z up) and reflectance (0 to 1) of each point, little-endian float32.
std::vector<std::byte> velodyne_bytes(std::span<const Eigen::Vector3d> places,
                                      std::span<const CloudPoint> points);

/// A frame's points where the sensor would have measured them at the frame's time: each is carried there by the body's own
/// motion between its pulse and that time. Bodies that move stay where their pulse met them.
std::vector<Eigen::Vector3d> deskewed_places(const FrameScans& scans, int frame,
                                             std::span<const CloudPoint> points);

/// SemanticKITTI's number of a class; 0 (unlabeled): it has none that is meant so.
/// is_moving   a body that moves in the sequence: 252 to 259
std::uint16_t semantic_kitti_label(std::uint8_t class_id, bool is_moving);

/// Labels of all points of a sequence. Instances are numbered from 1 in each class that SemanticKITTI counts (vehicles,
/// people), by our ids in ascending order; they stay the same in all frames. Other classes have instance 0.
/// threads   const use is safe
class SemanticKittiLabels {
 public:
  /// cost     reads all scans
  /// throws   Input: more than 65535 instances of a class
  explicit SemanticKittiLabels(const FrameScans& scans);

  /// labels/NNNNNN.label: a little-endian uint32 a point, class in the lower 16 bits, instance in the upper ones.
  std::vector<std::byte> bytes(std::span<const CloudPoint> points) const;
  /// instances.csv: which of our instance ids each number stands for; empty: there are none.
  std::string instances_csv() const;
  std::int64_t num_points() const { return num_points_; }
  std::int64_t most_points_of_frame() const { return most_points_of_frame_; }
  /// Points without a counterpart, by our class.
  core::Json unlabeled() const;

 private:
  std::uint16_t label_of(const CloudPoint& point) const;

  std::set<std::uint32_t> moving_;
  std::map<std::uint16_t, std::map<std::uint32_t, std::uint16_t>> instances_;
  std::map<std::uint8_t, std::int64_t> num_unlabeled_;
  std::int64_t num_points_ = 0;
  std::int64_t most_points_of_frame_ = 0;
};

/// Writes velodyne/, labels/ and instances.csv of a sequence of KITTI odometry.
/// returns   the sequence's "lidar" in dataset.json
core::Json write_odometry_scans(const FrameScans& scans, const std::string& path,
                                DatasetWriter& writer, const core::Context& context);

/// Writes velodyne_points/ of a drive of KITTI raw: points along the sensor's axes as they were at their pulses' times; first,
/// middle (the frame's time) and last of each scan.
/// returns   the sequence's "lidar" in dataset.json
core::Json write_raw_scans(const FrameScans& scans, const std::string& path, DatasetWriter& writer);

}  // namespace terracast::exporters
