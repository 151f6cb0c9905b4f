#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

/// Clouds of points that methods and scanners write: places alone, whatever else they hold.
namespace terracast::validate {

struct PointCloud {
  std::string form;                          ///< "PLY", "PCD", "LAS", "COLMAP", "xyz"
  std::vector<Eigen::Vector3d> points = {};  ///< finite, below 1e9 m
  std::int64_t num_invalid = 0;              ///< points that the file marks by NaN
  std::int64_t num_withheld = 0;             ///< points that LAS marks as deleted; left out
  std::vector<std::string> unused = {};  ///< parts of the file that hold no points: "12 of face"
};

/// Reads a cloud by the end of its name:
///   .ply                         text, or binary of either byte order; vertices with x, y, z of any type
///   .pcd                         text or binary (not binary_compressed)
///   .las                         1.0 to 1.4, all point formats (not .laz)
///   points3D.txt, points3D.bin   COLMAP
///   .xyz, .txt, .csv, .asc       rows that begin with x y z, all parted by semicolons if the first one
///                                has any, else by commas if it has any, else by blanks; as many cells each
/// throws  Input: damage, data behind the last point, another form, no point, more than 30 000 000 points,
///         a place beyond 1e9 m; Io
PointCloud read_point_cloud(const std::filesystem::path& file);

/// The same of bytes. `name` tells the form.
PointCloud parse_point_cloud(std::span<const std::byte> bytes, const std::string& name);

}  // namespace terracast::validate
