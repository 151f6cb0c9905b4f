#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

/// LAS 1.4 of ASPRS, point format 6.
namespace terracast::exporters {

/// Coordinates are whole steps of this from a file's offset.
inline constexpr double kLasStep_m = 1e-4;

/// A point on a map.
struct LasPoint {
  double easting_m = 0.0;
  double northing_m = 0.0;
  double height_m = 0.0;
  double gps_s = 0.0;           ///< GPS time since 1980-01-06
  double scan_angle_deg = 0.0;  ///< from straight down, to the right of the sensor
  double reflectance = 0.0;     ///< 0 to 1, stored in 65535ths
  std::uint8_t return_number = 1;
  std::uint8_t num_returns = 1;
  std::uint8_t classification = 0;
  // Extra bytes.
  double true_range_m = 0.0;
  float incidence_rad = 0.0F;
  std::uint32_t instance_id = 0;
  std::uint8_t class_id = 0;
};

/// ASPRS's class of one of ours: ground, vegetation, building, water, rail, road, wire, tower, bridge; others have 64 and
/// more, which are free, by their own number.
std::uint8_t las_classification(std::uint8_t class_id);

/// A compound system of WGS 84 / UTM and heights above EGM96's geoid, as text of OGC 01-009.
/// epsg   326zz or 327zz
std::string utm_egm96_wkt(int epsg, double central_meridian_deg, bool is_north);

/// A whole file.
/// points    in the order of their times
/// created   "YYYY-MM-DD…": the day in the header
/// throws    Input: a coordinate farther than 214 km from the first
std::vector<std::byte> las_bytes(std::span<const LasPoint> points, const std::string& wkt,
                                 const std::string& created, std::uint16_t source_id);

}  // namespace terracast::exporters
