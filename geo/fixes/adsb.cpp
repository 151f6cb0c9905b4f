#include <array>
#include <map>

#include "core/error.h"
#include "geo/fixes/csv_table.h"
#include "geo/fixes/fix_format.h"
#include "geo/fixes/text.h"
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

/// Tables of aircraft that broadcast their places. `above` chooses the altitude: "ellipsoid" the
/// geometric one, "pressure" the pressure altitude.
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
    const std::size_t altitude = altitude_column(table, layout, file, above);
    const std::vector<bool> is_wanted = rows_of_aircraft(table, file);
    FixTable result;
    result.has_utc = true;
    const std::size_t time = table.column(layout.time);
    const std::size_t latitude = table.column(layout.latitude);
    const std::size_t longitude = table.column(layout.longitude);
    const auto speed = table.find_column(layout.speed);
    std::size_t num_without_altitude = 0;
    for (std::size_t row = 0; row < table.num_rows(); ++row) {
      if (!is_wanted[row]) continue;
      Fix fix;
      fix.line = table.line(row);
      const std::string_view time_text = trimmed(table.cell(row, time));
      if (const auto seconds = number_of(time_text))
        fix.time_s = *seconds;
      else if (!time_text.empty())
        fix.time_s = unix_seconds_from_text(time_text, 0.0, table.where(row));
      const auto lat = table.number(row, latitude), lon = table.number(row, longitude);
      const auto height = table.number(row, altitude);
      if (!height) ++num_without_altitude;
      if (lat && lon && height) fix.place = {*lat, *lon, *height * layout.metres_per_altitude};
      if (speed)
        if (const auto value = table.number(row, *speed))
          fix.speed_mps = *value * layout.mps_per_speed;
      result.fixes.push_back(std::move(fix));
    }
    if (!result.fixes.empty() && num_without_altitude == result.fixes.size())
      fail(ErrorKind::Input, "{}: column {} is empty in all {} rows; {}", file.string(),
           table.column_names()[altitude], num_without_altitude,
           above == "ellipsoid" ? "above = \"pressure\" takes the pressure altitude, with a "
                                  "pressure_offset_m"
                                : "above = \"ellipsoid\" takes the geometric altitude");
    return result;
  }

 private:
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

  static std::size_t altitude_column(const CsvTable& table, const Layout& layout,
                                     const std::filesystem::path& file, const std::string& above) {
    if (above != "ellipsoid" && above != "pressure")
      fail(ErrorKind::Config,
           "{}: above = \"{}\"; aircraft broadcast a geometric altitude (above = \"ellipsoid\") "
           "and a pressure altitude (above = \"pressure\", with a pressure_offset_m)",
           file.string(), above);
    return table.column(above == "ellipsoid" ? layout.geometric_altitude
                                             : layout.pressure_altitude);
  }

  std::vector<bool> rows_of_aircraft(const CsvTable& table,
                                     const std::filesystem::path& file) const {
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
      return is_wanted;
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
    return is_wanted;
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
      .make = [] { return std::unique_ptr<FixFormat>(new AdsbFixes); }};
}

}  // namespace terracast::geo
