#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "core/error.h"
#include "geo/fixes/csv_table.h"
#include "geo/fixes/fix_format.h"
#include "geo/fixes/text.h"
#include "geo/fixes/times.h"
#include "geo/fixes/units.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

/// Column names of a kind of table, and its units.
struct Layout {
  std::string_view time, latitude, longitude, pressure_altitude, geometric_altitude, speed;
  double metres_per_altitude, mps_per_speed;
};

/// Tables with units in their column names; the Python package `traffic`; OpenSky's state vectors.
constexpr std::array kLayouts = {
    Layout{"timestamp_utc", "latitude_deg", "longitude_deg", "baro_altitude_ft", "geo_altitude_ft",
           "groundspeed_kt", metres_from_feet(1.0), kMetresPerSecondPerKnot},
    Layout{"timestamp", "latitude", "longitude", "altitude", "geoaltitude", "groundspeed",
           metres_from_feet(1.0), kMetresPerSecondPerKnot},
    Layout{"time", "lat", "lon", "baroaltitude", "geoaltitude", "velocity", 1.0, 1.0}};

constexpr std::string_view kOfACourse = "follows from the way that is flown";
constexpr std::string_view kOfAClimb = "follows from the altitudes";
constexpr std::string_view kOfRadio = "of the aircraft's radio, not of its motion";
constexpr std::string_view kOfAName = "a name; aircraft chooses by icao24 and callsign";

// As `traffic` and OpenSky's tables of state vectors call them.
constexpr std::array kKnown = {
    core::KnownName{"timestamp_utc", "time"},
    core::KnownName{"timestamp", "time"},
    core::KnownName{"time", "time"},
    core::KnownName{"latitude_deg", "latitude"},
    core::KnownName{"latitude", "latitude"},
    core::KnownName{"lat", "latitude"},
    core::KnownName{"longitude_deg", "longitude"},
    core::KnownName{"longitude", "longitude"},
    core::KnownName{"lon", "longitude"},
    core::KnownName{"baro_altitude_ft", "pressure altitude, with above = \"pressure\""},
    core::KnownName{"altitude", "pressure altitude, with above = \"pressure\""},
    core::KnownName{"baroaltitude", "pressure altitude, with above = \"pressure\""},
    core::KnownName{"geo_altitude_ft", "geometric altitude, with above = \"ellipsoid\""},
    core::KnownName{"geoaltitude", "geometric altitude, with above = \"ellipsoid\""},
    core::KnownName{"groundspeed_kt", "speed over ground, which the motion is compared with"},
    core::KnownName{"groundspeed", "speed over ground, which the motion is compared with"},
    core::KnownName{"velocity", "speed over ground, which the motion is compared with"},
    core::KnownName{"icao24", "which aircraft"},
    core::KnownName{"callsign", "which aircraft"},

    core::KnownName{"track_deg", kOfACourse, false},
    core::KnownName{"track", kOfACourse, false},
    core::KnownName{"heading", kOfACourse, false},
    core::KnownName{"track_rate", kOfACourse, false},
    core::KnownName{"track_unwrapped", kOfACourse, false},
    core::KnownName{"vertical_rate_ftmin", kOfAClimb, false},
    core::KnownName{"vertical_rate", kOfAClimb, false},
    core::KnownName{"vertrate", kOfAClimb, false},
    core::KnownName{"ias", "speed through the air, not over ground", false},
    core::KnownName{"tas", "speed through the air, not over ground", false},
    core::KnownName{"mach", "speed through the air, not over ground", false},
    core::KnownName{"roll", "too seldom broadcast; the attitude follows from the path", false},
    core::KnownName{"onground", "too_low says what becomes of a flight on the ground", false},
    core::KnownName{"hour", "follows from the time", false},
    core::KnownName{"lastposupdate", "a place that is repeated is dropped by itself", false},
    core::KnownName{"last_position", "a place that is repeated is dropped by itself", false},
    core::KnownName{"lastcontact", kOfRadio, false},
    core::KnownName{"alert", kOfRadio, false},
    core::KnownName{"spi", kOfRadio, false},
    core::KnownName{"squawk", kOfRadio, false},
    core::KnownName{"serials", kOfRadio, false},
    core::KnownName{"flight_id", kOfAName, false},
    core::KnownName{"registration", kOfAName, false},
    core::KnownName{"typecode", kOfAName, false},
    core::KnownName{"origin", kOfAName, false},
    core::KnownName{"destination", kOfAName, false},
    core::KnownName{"# comments", "notes of the writer", false}};
constexpr std::array kTables = {core::KnownTable{"adsb", "columns", kKnown}};

/// Tables of aircraft that broadcast their places. `above` chooses the altitude: "ellipsoid" the
/// geometric one, "pressure" the pressure altitude, "ground" and "none" neither.
class AdsbFixes final : public FixFormat {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("aircraft", aircraft_,
              "Call sign or ICAO address to take from a table of several; empty: the only one.");
  }
  std::unique_ptr<FixFormat> clone() const override { return std::make_unique<AdsbFixes>(*this); }

  FixTable read(const std::filesystem::path& file, const std::string& above) const override {
    const CsvTable table(file, ',');
    const Layout& layout = layout_of(table, file);
    const Columns columns(table, layout, altitude_column(table, layout, file, above));
    const Rows rows = rows_of_aircraft(table, file);
    FixTable result;
    result.zero_unix_s = 0.0;
    std::size_t num_without_zone = 0;
    for (std::size_t row = 0; row < table.num_rows(); ++row)
      if (rows.is_wanted[row])
        result.fixes.push_back(fix_of(table, row, layout, columns, num_without_zone));
    refuse_if_without_altitudes(table, layout, file, columns, result);
    std::set<std::size_t> used = columns.all();
    if (rows.names) used.insert(*rows.names);
    table.count(used, kKnown, result);
    if (num_without_zone > 0)
      result.remarks.push_back(
          fmt::format("{} times state no zone; they are taken to be UTC", num_without_zone));
    return result;
  }

 private:
  struct Columns {
    Columns(const CsvTable& table, const Layout& layout, std::optional<std::size_t> chosen)
        : time(table.column(layout.time)),
          latitude(table.column(layout.latitude)),
          longitude(table.column(layout.longitude)),
          altitude(chosen),
          speed(table.find_column(layout.speed)) {}
    std::set<std::size_t> all() const {
      std::set<std::size_t> result = {time, latitude, longitude};
      if (altitude) result.insert(*altitude);
      if (speed) result.insert(*speed);
      return result;
    }
    std::size_t time, latitude, longitude;
    std::optional<std::size_t> altitude, speed;
  };
  /// The rows of the wanted aircraft, and the column that names it.
  struct Rows {
    std::vector<bool> is_wanted;
    std::optional<std::size_t> names;
  };

  static Fix fix_of(const CsvTable& table, std::size_t row, const Layout& layout,
                    const Columns& columns, std::size_t& num_without_zone) {
    Fix fix;
    fix.line = table.line(row);
    fix.time_s = time_of(table, row, columns.time, num_without_zone);
    if (const auto latitude = table.number(row, columns.latitude)) fix.place.x() = *latitude;
    if (const auto longitude = table.number(row, columns.longitude)) fix.place.y() = *longitude;
    if (columns.altitude)
      if (const auto altitude = table.number(row, *columns.altitude))
        fix.place.z() = *altitude * layout.metres_per_altitude;
    if (columns.speed)
      if (const auto speed = table.number(row, *columns.speed))
        fix.speed_mps = *speed * layout.mps_per_speed;
    return fix;
  }

  static double time_of(const CsvTable& table, std::size_t row, std::size_t column,
                        std::size_t& num_without_zone) {
    const std::string_view cell = table.cell(row, column);
    if (table.is_empty(row, column)) return Fix().time_s;
    if (const auto seconds = number_of(cell)) {
      if (!is_unix_time(*seconds))
        fail(ErrorKind::Input,
             "{}: {} = {} is no time between 1900 and 2200 in seconds since 1970; format = \"csv\" "
             "reads other units, by time_unit",
             table.where(row), table.column_names()[column], cell.substr(0, 80));
      return *seconds;
    }
    const auto time = stated_time(cell, 0.0);
    if (!time) return unix_seconds_from_text(cell, 0.0, table.where(row));  // says why not
    num_without_zone += time->has_zone ? 0 : 1;
    return time->unix_s;
  }

  /// What else there is where the wanted altitude is in no row.
  static void refuse_if_without_altitudes(const CsvTable& table, const Layout& layout,
                                          const std::filesystem::path& file, const Columns& columns,
                                          const FixTable& result) {
    const bool has_altitude =
        std::any_of(result.fixes.begin(), result.fixes.end(),
                    [](const Fix& fix) { return std::isfinite(fix.place.z()); });
    if (has_altitude || result.fixes.empty() || !columns.altitude) return;
    const bool is_geometric = table.find_column(layout.geometric_altitude) == columns.altitude;
    const auto other =
        table.find_column(is_geometric ? layout.pressure_altitude : layout.geometric_altitude);
    bool has_other = false;
    for (std::size_t row = 0; other && row < table.num_rows(); ++row)
      has_other |= !table.is_empty(row, *other);
    fail(ErrorKind::Input, "{}: column {} is empty in all {} rows; {}{}", file.string(),
         table.column_names()[*columns.altitude], result.fixes.size(),
         !has_other ? ""
         : is_geometric
             ? "above = \"pressure\" takes the pressure altitude, with a pressure_offset_m, and "
             : "above = \"ellipsoid\" takes the geometric altitude, and ",
         kNoHeightsWayOut);
  }

  static const Layout& layout_of(const CsvTable& table, const std::filesystem::path& file) {
    for (const Layout& layout : kLayouts)
      if (table.find_column(layout.time) && table.find_column(layout.latitude) &&
          table.find_column(layout.longitude))
        return layout;
    std::string known;
    for (const Layout& layout : kLayouts)
      known += fmt::format("{}{}, {}, {}", known.empty() ? "" : "; or ", layout.time,
                           layout.latitude, layout.longitude);
    fail(ErrorKind::Input,
         "{}: its columns are {}; known tables have {}. Others are read by format = \"csv\", with "
         "columns and units named",
         file.string(), fmt::join(table.column_names(), ", "), known);
  }

  /// nullopt: heights come from the ground.
  static std::optional<std::size_t> altitude_column(const CsvTable& table, const Layout& layout,
                                                    const std::filesystem::path& file,
                                                    const std::string& above) {
    if (above == "ground" || above == "none") return std::nullopt;
    if (above != "ellipsoid" && above != "pressure")
      fail(ErrorKind::Config,
           "{}: above = \"{}\"; aircraft broadcast a geometric altitude (above = \"ellipsoid\") "
           "and a pressure altitude (above = \"pressure\", with a pressure_offset_m); {}",
           file.string(), above, kNoHeightsWayOut);
    const bool is_geometric = above == "ellipsoid";
    const std::string_view wanted =
        is_geometric ? layout.geometric_altitude : layout.pressure_altitude;
    if (const auto column = table.find_column(wanted)) return column;
    const bool has_other =
        table.find_column(is_geometric ? layout.pressure_altitude : layout.geometric_altitude)
            .has_value();
    fail(ErrorKind::Input, "{}: there is no column {}; {}{}", file.string(), wanted,
         !has_other ? ""
         : is_geometric
             ? "above = \"pressure\" takes the pressure altitude, with a pressure_offset_m, and "
             : "above = \"ellipsoid\" takes the geometric altitude, and ",
         kNoHeightsWayOut);
  }

  Rows rows_of_aircraft(const CsvTable& table, const std::filesystem::path& file) const {
    std::vector<bool> is_wanted(table.num_rows(), true);
    std::optional<std::size_t> names;
    for (const std::string_view column : {"icao24", "callsign"})
      if (table.find_column(column) &&
          (!names || (!aircraft_.empty() && holds(table, *table.find_column(column)))))
        names = table.find_column(column);
    if (!names) {
      if (!aircraft_.empty())
        fail(ErrorKind::Input, "{}: there is no column icao24 or callsign to find {} in",
             file.string(), aircraft_);
      return {is_wanted, std::nullopt};
    }
    std::map<std::string, std::size_t> rows_by_aircraft;
    for (std::size_t row = 0; row < table.num_rows(); ++row) {
      const std::string_view name = trimmed(table.cell(row, *names));
      if (!name.empty()) ++rows_by_aircraft[std::string(name)];
      is_wanted[row] = aircraft_.empty() || name == aircraft_;
    }
    if (aircraft_.empty() ? rows_by_aircraft.size() > 1 : !rows_by_aircraft.contains(aircraft_)) {
      constexpr std::size_t kMostListed = 20;
      std::vector<std::string> listed;
      for (const auto& [name, rows] : rows_by_aircraft)
        if (listed.size() < kMostListed) listed.push_back(fmt::format("{} ({} rows)", name, rows));
      fail(ErrorKind::Input,
           "{}: aircraft = \"{}\", and the table holds {} aircraft: {}{}; name one", file.string(),
           aircraft_, rows_by_aircraft.size(), fmt::join(listed, ", "),
           rows_by_aircraft.size() > listed.size() ? ", ..." : "");
    }
    return {is_wanted, names};
  }

  /// The wanted aircraft is named in that column.
  bool holds(const CsvTable& table, std::size_t column) const {
    for (std::size_t row = 0; row < table.num_rows(); ++row)
      if (trimmed(table.cell(row, column)) == aircraft_) return true;
    return false;
  }

  std::string aircraft_;
};

}  // namespace

FixFormatInfo adsb_fixes() {
  return {
      .name = "adsb",
      .summary = "A table of an aircraft's broadcasts (ADS-B), as traffic and OpenSky write it.",
      .make = [] { return std::unique_ptr<FixFormat>(new AdsbFixes); },
      .known = kTables};
}

}  // namespace terracast::geo
