#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

/// Clouds of points as other programs read them, of our datasets: PLY, PCD, LAS 1.4.
namespace terracast::validate {

/// A point of any of the forms.
struct CloudRow {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< m; of LAS on its map
  double time_s = 0.0;                              ///< of LAS GPS time since 1980-01-06
  double intensity = 0.0;                           ///< 0 to 1
  std::int64_t return_number = 0;
  std::int64_t num_returns = 0;
  std::int64_t class_id = 0;
  std::int64_t instance_id = 0;
  double scan_angle_deg = 0.0;  ///< LAS alone
};

struct Cloud {
  std::vector<CloudRow> rows;
  std::string wkt;      ///< LAS alone: the system of coordinates
  double step_m = 0.0;  ///< to which places are rounded; 0: as their numbers are
};

/// throws   Input: another form, properties that are missing or of other types, truncated
Cloud parse_ply(std::span<const std::byte> bytes, const std::string& name);
Cloud parse_pcd(std::span<const std::byte> bytes, const std::string& name);
/// throws   Input: not LAS 1.4 of point format 6 with WKT and GPS time, counts or bounds that are not its points', truncated
Cloud parse_las(std::span<const std::byte> bytes, const std::string& name);

}  // namespace terracast::validate
