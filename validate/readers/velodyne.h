#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

/// Points of a lidar in KITTI's files, and SemanticKITTI's labels of them.
namespace terracast::validate {

struct ScanPoint {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< m
  double reflectance = 0.0;                         ///< 0 to 1; of PLY 0
};

/// velodyne/NNNNNN.bin: x, y, z, reflectance, little-endian float32.
/// throws   Input: no whole number of points, or a number that is not finite
std::vector<ScanPoint> parse_velodyne(std::span<const std::byte> bytes, const std::string& name);
/// The same of float64, by which a mistake is named; empty: they are none either.
std::vector<ScanPoint> parse_velodyne_float64(std::span<const std::byte> bytes);
/// TartanAir's lidar: a binary PLY of float x, y, z.
/// throws   Input: another header, truncated, or a number that is not finite
std::vector<ScanPoint> parse_lidar_ply(std::span<const std::byte> bytes, const std::string& name);

/// A point's label.
struct ScanLabel {
  std::uint16_t label = 0;
  std::uint16_t instance = 0;
  bool operator==(const ScanLabel&) const = default;
};
/// labels/NNNNNN.label: a little-endian uint32 a point.
/// throws   Input: no whole number of labels
std::vector<ScanLabel> parse_labels(std::span<const std::byte> bytes, const std::string& name);

/// Whether semantic-kitti.yaml has the number.
bool is_semantic_kitti_label(std::uint16_t label);
/// Its number of one of our classes.
std::uint16_t semantic_kitti_of(std::size_t class_id, bool is_moving);
/// Whether its instances are counted: vehicles and people.
bool has_instances(std::uint16_t label);

/// instances.csv: our instance_id by label and instance.
/// throws   Input: another header, rows that are no three counts, a pair that stands twice
using InstanceIds = std::map<std::pair<std::uint16_t, std::uint16_t>, std::int64_t>;
InstanceIds parse_instances(const std::string& text, const std::string& name);

}  // namespace terracast::validate
