#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/npz_reader.h"

/// Readers as the formats' users have them; they share no code with the program.
namespace terracast::test {

std::string slurp(const std::filesystem::path& file);

/// Rows of numbers with single blanks between and none at the end, as the strictest readers want
/// them.
std::vector<std::vector<double>> read_rows(const std::filesystem::path& file);

/// WGS84, by its definition: the truth for georeferences and local frames.
struct Wgs84 {
  static Eigen::Vector3d ecef(double lat_deg, double lon_deg, double height_m);
  static Eigen::Matrix3d ecef_from_enu(double lat_deg, double lon_deg);
};

/// Takes points of one tangent frame into another.
struct TangentChange {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
  Eigen::Vector3d operator()(const Eigen::Vector3d& point) const {
    return rotation * point + translation;
  }
};
template <class Place>
TangentChange tangent_change(const Place& from, const Place& to) {
  const Eigen::Matrix3d to_rotation = Wgs84::ecef_from_enu(to.lat_deg, to.lon_deg).transpose();
  return {to_rotation * Wgs84::ecef_from_enu(from.lat_deg, from.lon_deg),
          to_rotation * (Wgs84::ecef(from.lat_deg, from.lon_deg, from.height_m) -
                         Wgs84::ecef(to.lat_deg, to.lon_deg, to.height_m))};
}

}  // namespace terracast::test
