#include "validate/checks/lidar_clouds.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <optional>

#include "core/atomic_file.h"
#include "core/error.h"
#include "validate/geodesy.h"
#include "validate/text.h"

namespace terracast::validate {

namespace {

using Eigen::Vector3d;

/// What of a row may differ, and by how much.
struct Allowed {
  double place_m = 0.0;
  double time_s = 0.0;
  double intensity = 0.0;
};

void compare_row(const CloudRow& right, const CloudRow& row, const Allowed& allowed,
                 const std::string& where, FileContradictions& found) {
  // Heights that nobody can tell are NaN.
  double off_m = 0.0;
  for (int axis = 0; axis < 3; ++axis)
    if (!std::isnan(right.place[axis]))
      off_m = std::max(off_m, std::abs(row.place[axis] - right.place[axis]));
  found.expect(off_m <= allowed.place_m, "{} is {:.3g} m from its scan's point", where, off_m);
  found.expect(std::abs(row.time_s - right.time_s) <= allowed.time_s, "{} is {:.3g} s late", where,
               row.time_s - right.time_s);
  found.expect(std::abs(row.intensity - right.intensity) <= allowed.intensity,
               "{} has the intensity {}, not {}", where, row.intensity, right.intensity);
  found.expect(row.return_number == right.return_number && row.num_returns == right.num_returns &&
                   row.class_id == right.class_id && row.instance_id == right.instance_id,
               "{} has another return, class or instance than its scan's point", where);
}

void compare_rows(const std::vector<CloudRow>& right, const std::vector<CloudRow>& rows,
                  const Allowed& allowed, const std::string& name, FileContradictions& found) {
  found.expect(right.size() == rows.size(), "{}: {} points, where its scans have {}", name,
               rows.size(), right.size());
  for (std::size_t i = 0; i < std::min(right.size(), rows.size()); ++i)
    compare_row(right[i], rows[i], allowed, fmt::format("{}: point {}", name, i), found);
}

/// What a file holds; nothing where it is not there or cannot be read, which is noted.
template <class Parse>
std::optional<Cloud> cloud_in(const Dataset& dataset, const std::string& path, const Parse& parse,
                              FileContradictions& found) {
  if (!dataset.files.contains(path)) return std::nullopt;
  try {
    return parse(core::read_file(dataset.root / path), path);
  } catch (const core::Error& error) {
    if (error.kind() != core::ErrorKind::Input) throw;
    found.expect(false, "{}", error.message());
    return std::nullopt;
  }
}

/// The number behind the last AUTHORITY["EPSG","…"] of the map in a WKT of a compound system.
std::optional<int> epsg_of_map(const std::string& wkt) {
  const std::size_t end = wkt.find(",VERT_CS[");
  if (end == std::string::npos) return std::nullopt;
  constexpr std::string_view kAuthority = "AUTHORITY[\"EPSG\",\"";
  const std::size_t at = wkt.rfind(kAuthority, end);
  if (at == std::string::npos || wkt.size() < at + kAuthority.size() + 5) return std::nullopt;
  const std::string digits = wkt.substr(at + kAuthority.size(), 5);
  if (digits.find_first_not_of("0123456789") != std::string::npos) return std::nullopt;
  const int epsg = std::stoi(digits);
  const int zone = epsg % 100;
  const bool is_utm = (epsg / 100 == 326 || epsg / 100 == 327) && zone >= 1 && zone <= 60;
  return is_utm ? std::optional(epsg) : std::nullopt;
}

/// Leap seconds by a UTC's day, as IERS's bulletins C add them up.
double gps_minus_utc_s(const std::string& utc) {
  constexpr const char* kDays[] = {
      "1981-07-01", "1982-07-01", "1983-07-01", "1985-07-01", "1988-01-01", "1990-01-01",
      "1991-01-01", "1992-07-01", "1993-07-01", "1994-07-01", "1996-01-01", "1997-07-01",
      "1999-01-01", "2006-01-01", "2009-01-01", "2012-07-01", "2015-07-01", "2017-01-01"};
  double leaps_s = 0.0;
  for (const char* day : kDays) leaps_s += utc.substr(0, 10) >= day ? 1.0 : 0.0;
  return leaps_s;
}

/// Rows on the map, in GPS time.
void place_on_map(const Sequence& sequence, int epsg, const Undulation& undulation_m,
                  std::vector<CloudRow>& rows) {
  const Pose ecef_from_enu = ecef_from_local(sequence.origin);
  const double gps_start_s =
      1e-9 * static_cast<double>(parse_utc_ns(sequence.utc_start, "utc_start") -
                                 parse_utc_ns("1980-01-06T00:00:00Z", "epoch")) +
      gps_minus_utc_s(sequence.utc_start);
  for (CloudRow& row : rows) {
    const Geodetic place = geodetic_from_ecef(ecef_from_enu * row.place);
    const std::optional<double> geoid_m =
        undulation_m ? undulation_m(place.lat_deg, place.lon_deg) : std::nullopt;
    row.place << utm_from_geodetic(epsg, place.lat_deg, place.lon_deg),
        geoid_m ? place.height_m - *geoid_m : std::numeric_limits<double>::quiet_NaN();
    row.time_s += gps_start_s;
  }
}

}  // namespace

std::vector<CloudRow> shown_rows(const NpyTable& scans, const std::string& name) {
  std::vector<CloudRow> rows(scans.num_rows);
  const auto column = [&](const std::string& of) { return scans.numbers(of, name); };
  const std::vector<double> time_s = column("time_s"), range_m = column("range_m"),
                            true_m = column("true_range_m"), reflectance = column("reflectance"),
                            number = column("return_number"), returns = column("num_returns"),
                            class_id = column("class_id"), instance = column("instance_id");
  std::array<std::vector<double>, 3> to, from;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::string end = std::string(1, "xyz"[axis]) + "_m";
    to[axis] = column("local_" + end);
    from[axis] = column("local_origin_" + end);
  }
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Vector3d point(to[0][i], to[1][i], to[2][i]);
    const Vector3d origin(from[0][i], from[1][i], from[2][i]);
    rows[i] = {.place = point + (range_m[i] / true_m[i] - 1.0) * (point - origin),
               .time_s = time_s[i],
               .intensity = reflectance[i],
               .return_number = static_cast<std::int64_t>(number[i]),
               .num_returns = static_cast<std::int64_t>(returns[i]),
               .class_id = static_cast<std::int64_t>(class_id[i]),
               .instance_id = static_cast<std::int64_t>(instance[i])};
  }
  return rows;
}

void compare_clouds(const Dataset& dataset, const Sequence& sequence, const SensorRecord& lidar,
                    const Undulation& undulation_m, FileContradictions& found) {
  std::size_t strip = 0;
  const auto las_path = [&] { return fmt::format("{}/strip_{:03}.las", lidar.file, strip); };
  std::optional<Cloud> las = cloud_in(dataset, las_path(), parse_las, found);
  std::size_t las_row = 0;
  for (int frame = 0; frame < sequence.num_frames; ++frame) {
    const std::string name = fmt::format("{}/{:06}", lidar.file, frame);
    std::vector<CloudRow> right = shown_rows(read_scans(dataset, lidar, frame), name);
    double farthest_m = 0.0;
    for (const CloudRow& row : right)
      farthest_m = std::max(farthest_m, row.place.cwiseAbs().maxCoeff());
    const Allowed exact{.place_m = 1e-12 * farthest_m, .time_s = 0.0, .intensity = 0.0};
    if (const auto ply = cloud_in(dataset, name + ".ply", parse_ply, found))
      compare_rows(right, ply->rows, exact, name + ".ply", found);
    if (const auto pcd = cloud_in(dataset, name + ".pcd", parse_pcd, found)) {
      Allowed rounded = exact;
      rounded.place_m = 0x1.0p-24 * (1.0 + 1e-6) * farthest_m;
      compare_rows(right, pcd->rows, rounded, name + ".pcd", found);
    }
    if (!las) continue;
    if (las_row == las->rows.size() &&
        dataset.files.contains(fmt::format("{}/strip_{:03}.las", lidar.file, strip + 1))) {
      ++strip;
      las_row = 0;
      las = cloud_in(dataset, las_path(), parse_las, found);
      if (!las) continue;
    }
    const std::optional<int> epsg = epsg_of_map(las->wkt);
    found.expect(epsg.has_value() && las->wkt.find("\"EPSG\",\"5773\"") != std::string::npos,
                 "{}: its system of coordinates is no zone of UTM with heights above EGM96",
                 las_path());
    if (!epsg) return;
    place_on_map(sequence, *epsg, undulation_m, right);
    // Half a step; a thousandth of it is what both ways to the map differ by. Times of this size are doubles of 0.12 us.
    const Allowed stepped{
        .place_m = 0.501 * las->step_m, .time_s = 2e-7, .intensity = 0.51 / 65535.0};
    found.expect(las_row + right.size() <= las->rows.size(), "{}: its scans have more points",
                 las_path());
    for (std::size_t i = 0; i < right.size() && las_row < las->rows.size(); ++i, ++las_row)
      compare_row(right[i], las->rows[las_row], stepped,
                  fmt::format("{}: point {}", las_path(), las_row), found);
  }
  if (las)
    found.expect(las_row == las->rows.size(), "{}: {} points beyond its scans'", las_path(),
                 las->rows.size() - las_row);
}

}  // namespace terracast::validate
