#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "geo/fixes/csv_table.h"
#include "geo/fixes/fix_format.h"
#include "geo/geodesy.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

constexpr double kMetresPerFoot = 0.3048;  // exactly
const double kDegreesPerRadian = degrees_from_radians(1.0);

constexpr std::string_view kAttitude = "attitude";
constexpr std::string_view kOfTheSpeed = "speed, which the motion is compared with";
constexpr std::string_view kEcef = "place fixed to the Earth";
constexpr std::string_view kRest = "not needed for the motion";

// Without the prefix /fdm/jsbsim/. Properties are named by their paths; the groups of an output directive by captions.
constexpr std::array kKnown = {
    core::KnownName{"Time", "times in seconds"},
    core::KnownName{"simulation/sim-time-sec", "times in seconds"},
    core::KnownName{"position/ecef-x-ft", kEcef},
    core::KnownName{"position/ecef-y-ft", kEcef},
    core::KnownName{"position/ecef-z-ft", kEcef},
    core::KnownName{"X_{ECEF} (ft)", kEcef},
    core::KnownName{"Y_{ECEF} (ft)", kEcef},
    core::KnownName{"Z_{ECEF} (ft)", kEcef},
    core::KnownName{"position/lat-geod-deg", "geodetic latitude"},
    core::KnownName{"position/lat-geod-rad", "geodetic latitude"},
    core::KnownName{"Latitude Geodetic (deg)", "geodetic latitude"},
    core::KnownName{"position/long-gc-deg", "longitude"},
    core::KnownName{"position/long-gc-rad", "longitude"},
    core::KnownName{"Longitude (deg)", "longitude"},
    core::KnownName{"position/geod-alt-ft", "height above the ellipsoid in feet"},
    core::KnownName{"position/h-sl-ft", "height above the sea in feet"},
    core::KnownName{"position/h-sl-meters", "height above the sea in metres"},
    core::KnownName{"Altitude ASL (ft)", "height above the sea in feet"},
    core::KnownName{"position/h-agl-ft",
                    "height above the simulated ground, of above = \"ground\""},
    core::KnownName{"Altitude AGL (ft)",
                    "height above the simulated ground, of above = \"ground\""},
    core::KnownName{"attitude/phi-rad", kAttitude},
    core::KnownName{"attitude/theta-rad", kAttitude},
    core::KnownName{"attitude/psi-rad", kAttitude},
    core::KnownName{"attitude/phi-deg", kAttitude},
    core::KnownName{"attitude/theta-deg", kAttitude},
    core::KnownName{"attitude/psi-deg", kAttitude},
    core::KnownName{"Phi (deg)", kAttitude},
    core::KnownName{"Theta (deg)", kAttitude},
    core::KnownName{"Psi (deg)", kAttitude},
    core::KnownName{"velocities/v-north-fps", kOfTheSpeed},
    core::KnownName{"velocities/v-east-fps", kOfTheSpeed},
    core::KnownName{"V_{North} (ft/s)", kOfTheSpeed},
    core::KnownName{"V_{East} (ft/s)", kOfTheSpeed},
    core::KnownName{"position/lat-gc-*",
                    "geocentric: up to 0.19 degrees (21 km) from the geodetic latitude", false},
    core::KnownName{"Latitude (deg)",
                    "geocentric: up to 0.19 degrees (21 km) from the geodetic latitude", false},
    core::KnownName{"accelerations/*", kRest, false},
    core::KnownName{"aero/*", kRest, false},
    core::KnownName{"ap/*", kRest, false},
    core::KnownName{"atmosphere/*", kRest, false},
    core::KnownName{"attitude/*", kRest, false},
    core::KnownName{"fcs/*", kRest, false},
    core::KnownName{"flight-path/*", kRest, false},
    core::KnownName{"forces/*", kRest, false},
    core::KnownName{"gear/*", kRest, false},
    core::KnownName{"inertia/*", kRest, false},
    core::KnownName{"metrics/*", kRest, false},
    core::KnownName{"moments/*", kRest, false},
    core::KnownName{"position/*", kRest, false},
    core::KnownName{"propulsion/*", kRest, false},
    core::KnownName{"simulation/*", kRest, false},
    core::KnownName{"velocities/*", kRest, false},
    core::KnownName{"# comments", "notes of the writer", false}};
constexpr std::array kTables = {
    core::KnownTable{"jsbsim", "columns, without /fdm/jsbsim/", kKnown}};

/// The property's path without the root under which a program keeps it, or a caption as it is.
std::string_view without_root(std::string_view name) {
  constexpr std::string_view kRoot = "fdm/jsbsim/";
  std::string_view rest = name;
  if (rest.starts_with('/')) rest.remove_prefix(1);
  return rest.starts_with(kRoot) ? rest.substr(kRoot.size()) : name;
}

/// A name of a quantity, and what its numbers are of metres, degrees or metres a second.
struct Spelling {
  std::string_view name;
  double si;
};

/// Tables of JSBSim's output directive: places in feet, the body's attitude from forward-right-down to
/// north-east-down.
class JsbsimFixes final : public FixFormat {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("separator", separator_, "What stands between fields (TABULAR writes tabs).",
              core::one_of({",", "tab"}));
  }
  std::unique_ptr<FixFormat> clone() const override { return std::make_unique<JsbsimFixes>(*this); }
  std::string heights_above() const override { return "ellipsoid"; }

  FixTable read(const std::filesystem::path& file, const std::string& above) const override {
    const CsvTable table(file, separator_ == "tab" ? '\t' : ',');
    if (table.num_rows() > kMostFixes)
      fail(ErrorKind::Input, "{}: {} rows; up to {} are read: cut it", file.string(),
           table.num_rows(), kMostFixes);
    const Columns columns(table, file, above);
    columns.refuse_sphere(file);
    FixTable result;
    for (std::size_t row = 0; row < table.num_rows(); ++row)
      result.fixes.push_back(columns.fix_of(row));
    columns.count(result);
    return result;
  }

 private:
  struct Column {
    std::size_t index;
    double si;
  };

  class Columns {
   public:
    Columns(const CsvTable& table, const std::filesystem::path& file, const std::string& above)
        : table_(table), file_(file) {
      constexpr std::size_t kMostColumns = 10000;
      if (table.column_names().size() > kMostColumns)
        fail(ErrorKind::Input, "{}: {} columns; a run with all its properties has some 2000",
             file.string(), table.column_names().size());
      for (std::size_t i = 0; i < table.column_names().size(); ++i) {
        const std::string_view name = without_root(table.column_names()[i]);
        if (!indices_.try_emplace(std::string(name), i).second) repeated_.insert(std::string(name));
      }
      const auto time = all_of({{{"simulation/sim-time-sec", 1.0}}, {{"Time", 1.0}}});
      if (time.empty())
        fail(ErrorKind::Input,
             "{}: there is no column Time or simulation/sim-time-sec; its columns are {}",
             file.string(), fmt::join(table.column_names(), ", "));
      time_ = time.front();
      ecef_ = all_of({{{"position/ecef-x-ft", kMetresPerFoot},
                       {"position/ecef-y-ft", kMetresPerFoot},
                       {"position/ecef-z-ft", kMetresPerFoot}},
                      {{"X_{ECEF} (ft)", kMetresPerFoot},
                       {"Y_{ECEF} (ft)", kMetresPerFoot},
                       {"Z_{ECEF} (ft)", kMetresPerFoot}}});
      if (ecef_.empty()) take_level_place(file);
      take_height(file, above);
      attitude_ = all_of(
          {{{"attitude/psi-rad", kDegreesPerRadian},
            {"attitude/theta-rad", kDegreesPerRadian},
            {"attitude/phi-rad", kDegreesPerRadian}},
           {{"attitude/psi-deg", 1.0}, {"attitude/theta-deg", 1.0}, {"attitude/phi-deg", 1.0}},
           {{"Psi (deg)", 1.0}, {"Theta (deg)", 1.0}, {"Phi (deg)", 1.0}}});
      speed_ = all_of(
          {{{"velocities/v-north-fps", kMetresPerFoot}, {"velocities/v-east-fps", kMetresPerFoot}},
           {{"V_{North} (ft/s)", kMetresPerFoot}, {"V_{East} (ft/s)", kMetresPerFoot}}});
    }

    /// throws   Input: heights above the ellipsoid are far from those above the sea, as where the Earth is a sphere
    void refuse_sphere(const std::filesystem::path& file) const {
      // The sea of the Earth's gravity is up to 107 m from the ellipsoid; the sphere, up to 21 km.
      constexpr double kMostApart_m = 200.0;
      if (height_over_the_sea_.empty()) return;
      for (std::size_t row = 0; row < table_.num_rows(); ++row) {
        const auto over_the_sea = numbers(row, height_over_the_sea_);
        const double height_m = fix_of(row).place.z();
        if (!over_the_sea || !(std::abs(height_m - (*over_the_sea)[0]) > kMostApart_m)) continue;
        fail(ErrorKind::Input,
             "{}, line {}: {:.1f} m above the ellipsoid and {:.1f} m above the sea ({}), which are "
             "{:.0f} m apart or less on the Earth: this run's Earth is a sphere, as in older "
             "stand-alone versions of JSBSim; above = \"egm96\" takes the heights above its sea",
             file.string(), table_.line(row), height_m, (*over_the_sea)[0],
             table_.column_names()[height_over_the_sea_.front().index], kMostApart_m);
      }
    }

    Fix fix_of(std::size_t row) const {
      Fix fix;
      fix.line = table_.line(row);
      if (const auto time = table_.number(row, time_.index)) fix.time_s = *time;
      if (const auto place = numbers(row, ecef_)) {
        const Geodetic geodetic =
            geodetic_from_ecef(Eigen::Vector3d((*place)[0], (*place)[1], (*place)[2]));
        fix.place.head<2>() << geodetic.lat_deg, geodetic.lon_deg;
        if (takes_height_of_ecef_) fix.place.z() = geodetic.height_m;
      } else if (const auto level = numbers(row, level_)) {
        fix.place.head<2>() << (*level)[0], (*level)[1];
      }
      if (const auto height = numbers(row, height_)) fix.place.z() = (*height)[0];
      if (const auto angles = numbers(row, attitude_))
        fix.attitude = enu_from_body_by_ned_angles(radians_from_degrees((*angles)[0]),
                                                   radians_from_degrees((*angles)[1]),
                                                   radians_from_degrees((*angles)[2]));
      if (const auto speed = numbers(row, speed_))
        fix.speed_mps = std::hypot((*speed)[0], (*speed)[1]);
      return fix;
    }

    /// Each column, by whether it was taken; of two that state the same, one is.
    void count(FixTable& result) const {
      std::set<std::size_t> used = {time_.index};
      for (const std::vector<Column>* columns : {&ecef_, &level_, &height_, &attitude_, &speed_})
        for (const Column& column : *columns) used.insert(column.index);
      const auto num_rows = static_cast<std::int64_t>(table_.num_rows());
      for (const auto& [name, index] : indices_) {
        if (repeated_.contains(name)) {
          result.ledger.ignore(name, "stands in several columns, and is not needed", num_rows);
          continue;
        }
        const core::KnownName* known = core::find_known(kKnown, name);
        if (known != nullptr && known->is_used && !used.contains(index)) {
          result.ledger.ignore(name, "another column states it, or it is not asked for", num_rows);
          continue;
        }
        std::size_t num_empty = 0;
        for (std::size_t row = 0; row < table_.num_rows(); ++row)
          num_empty += table_.is_empty(row, index) ? 1 : 0;
        if (num_empty > 0) result.empty[name] = num_empty;
        result.ledger.count(name, kKnown, num_rows - static_cast<std::int64_t>(num_empty));
      }
      if (table_.num_comments() > 0)
        result.ledger.count("# comments", kKnown, static_cast<std::int64_t>(table_.num_comments()));
      for (const std::string& remark : remarks_) result.remarks.push_back(remark);
    }

   private:
    /// The first group of spellings of which all are there; empty: none is.
    /// throws   Input: one of them names several columns
    std::vector<Column> all_of(const std::vector<std::vector<Spelling>>& groups) const {
      for (const std::vector<Spelling>& group : groups) {
        std::vector<Column> columns;
        for (const Spelling& spelling : group)
          if (const auto found = indices_.find(spelling.name); found != indices_.end())
            columns.push_back({found->second, spelling.si});
        if (columns.size() != group.size()) continue;
        for (const Spelling& spelling : group)
          if (repeated_.contains(spelling.name))
            fail(ErrorKind::Input, "{}: two columns are named {}", file_.string(), spelling.name);
        return columns;
      }
      return {};
    }

    void take_level_place(const std::filesystem::path& file) {
      const std::vector<Column> latitude = all_of({{{"position/lat-geod-deg", 1.0}},
                                                   {{"position/lat-geod-rad", kDegreesPerRadian}},
                                                   {{"Latitude Geodetic (deg)", 1.0}}});
      const std::vector<Column> longitude = all_of({{{"position/long-gc-deg", 1.0}},
                                                    {{"position/long-gc-rad", kDegreesPerRadian}},
                                                    {{"Longitude (deg)", 1.0}}});
      if (!latitude.empty() && !longitude.empty()) {
        level_ = {latitude.front(), longitude.front()};
        return;
      }
      const bool has_geocentric = indices_.contains("position/lat-gc-deg") ||
                                  indices_.contains("position/lat-gc-rad") ||
                                  indices_.contains("Latitude (deg)");
      fail(ErrorKind::Input,
           "{}: it states no place{}; write position/ecef-x-ft, -y-ft and -z-ft, or "
           "position/lat-geod-deg, position/long-gc-deg and position/geod-alt-ft",
           file.string(),
           has_geocentric && latitude.empty()
               ? " but for a geocentric latitude, which is up to 0.19 degrees (21 km) from the "
                 "geodetic one"
               : "");
    }

    void take_height(const std::filesystem::path& file, const std::string& above) {
      const std::vector<std::vector<Spelling>> over_the_sea = {
          {{"position/h-sl-ft", kMetresPerFoot}},
          {{"position/h-sl-meters", 1.0}},
          {{"Altitude ASL (ft)", kMetresPerFoot}}};
      if (above == "none") return;
      if (above == "ellipsoid") {
        height_over_the_sea_ = all_of(over_the_sea);
        takes_height_of_ecef_ = !ecef_.empty();
        if (takes_height_of_ecef_) return;
        height_ = all_of({{{"position/geod-alt-ft", kMetresPerFoot}}});
        if (height_.empty() && !(height_ = height_over_the_sea_).empty())
          remarks_.push_back(
              fmt::format("heights are those of {}, taken to be above the ellipsoid; older "
                          "stand-alone versions "
                          "of JSBSim count them from a sphere of 20925650 ft, for a sea level",
                          table_.column_names()[height_.front().index]));
      } else if (above == "egm96") {
        height_ = all_of(over_the_sea);
      } else if (above == "ground") {
        height_ = all_of(
            {{{"position/h-agl-ft", kMetresPerFoot}}, {{"Altitude AGL (ft)", kMetresPerFoot}}});
      } else {
        fail(ErrorKind::Config,
             "above = \"{}\"; JSBSim states heights above the ellipsoid, above the sea (egm96) and "
             "above the simulated ground (ground); {}",
             above, kNoHeightsWayOut);
      }
      if (height_.empty())
        fail(ErrorKind::Input, "{}: it states no heights above \"{}\" (its columns are {}); {}",
             file.string(), above, fmt::join(table_.column_names(), ", "), kNoHeightsWayOut);
    }

    /// Nothing where there are no such columns, or one of the cells is empty.
    std::optional<std::vector<double>> numbers(std::size_t row,
                                               const std::vector<Column>& columns) const {
      if (columns.empty()) return std::nullopt;
      std::vector<double> values;
      for (const Column& column : columns) {
        const auto value = table_.number(row, column.index);
        if (!value) return std::nullopt;
        values.push_back(*value * column.si);
      }
      return values;
    }

    const CsvTable& table_;
    const std::filesystem::path& file_;
    std::map<std::string, std::size_t, std::less<>> indices_;
    std::set<std::string, std::less<>> repeated_;  ///< names of several columns
    Column time_{};
    std::vector<Column> ecef_, level_, height_, attitude_, speed_;
    std::vector<Column> height_over_the_sea_;  ///< of above = "ellipsoid", to compare with
    bool takes_height_of_ecef_ = false;
    std::vector<std::string> remarks_;
  };

  std::string separator_ = ",";
};

}  // namespace

FixFormatInfo jsbsim_fixes() {
  return {.name = "jsbsim",
          .summary = "A table that JSBSim's output directive wrote (CSV or TABULAR).",
          .make = [] { return std::unique_ptr<FixFormat>(new JsbsimFixes); },
          .known = kTables};
}

}  // namespace terracast::geo
