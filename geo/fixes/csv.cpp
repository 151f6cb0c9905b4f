#include <array>
#include <cmath>

#include "core/error.h"
#include "geo/fixes/angles.h"
#include "geo/fixes/column_units.h"
#include "geo/fixes/csv_table.h"
#include "geo/fixes/csv_times.h"
#include "geo/fixes/fix_format.h"
#include "geo/fixes/text.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

class CsvFixes final : public FixFormat {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("separator", separator_, "What stands between fields.",
              core::one_of({",", ";", "tab"}));
    visit.key("decimal_sign", decimal_sign_,
              "What stands between a number's whole and its fraction.", core::one_of({".", ","}));
    visit.key("frame", frame_,
              "What place_columns hold: latitude, longitude, height; or x, y, z fixed to the Earth "
              "(ECEF); or x, y, z about `origin`.",
              core::one_of({"geodetic", "ecef", "local"}));
    visit.key("place_columns", place_columns_,
              "Names of the three columns of the place, in order; of latitude and longitude alone "
              "where the table has no heights, with above = \"ground\".",
              core::Constraint{.min_size = 2, .max_size = 3});
    visit.key("angle_unit", angle_unit_,
              "Of latitude and longitude; deg_e7: ten millionths of a degree; dms: written like "
              "46\u00B0 30' 12.5\" N. Empty: as the columns' names say (lat_rad), or else deg; the "
              "log tells.",
              core::one_of({"", "deg", "rad", "deg_e7", "dms"}));
    visit.key(
        "length_unit", length_unit_,
        "Of heights, or of x, y, z. Empty: as the columns' names say (alt_ft, height (feet)), "
        "or else m; the log tells.",
        core::one_of({"", "m", "ft", "km", "cm", "mm"}));
    times_.describe(visit);
    visit.key("attitude_columns", attitude_columns_,
              "Names of the columns of a quaternion w, x, y, z, or of the angles yaw, pitch, roll "
              "about z, then y, then x; empty: no attitude.");
    visit.key(
        "attitude_unit", attitude_unit_,
        "Of yaw, pitch, roll; of the gimbal's too. Empty: as the columns' names say (roll_rad), "
        "or else deg; the log tells.",
        core::one_of({"", "deg", "rad"}));
    visit.key("attitude_axes", attitude_axes_,
              "The body's axes: forward left up, forward right down, or right down forward.",
              core::one_of({"flu", "frd", "rdf"}));
    visit.key("attitude_frame", attitude_frame_,
              "What the rotation leads to: east-north-up or north-east-down of the place, the "
              "Earth's axes, or the file's own x, y, z.",
              core::one_of({"enu", "ned", "ecef", "local"}));
    visit.key("attitude_inverse", attitude_inverse_,
              "The rotation leads from that frame to the body instead.");
    visit.key(
        "gimbal_columns", gimbal_columns_,
        "Names of the columns of the camera's yaw (clockwise from north), pitch (up) and roll "
        "(to the right); empty: no gimbal.");
    visit.key(
        "speed_column", speed_column_,
        "Name of a column of speeds over ground, which the motion is compared with; or empty.");
    visit.key(
        "speed_unit", speed_unit_,
        "Its unit. Empty: as the column's name says (speed [mph]), or else mps; the log tells.",
        core::one_of({"", "mps", "kn", "kmh", "mph"}));
  }

  void validate() const override {
    if (place_columns_.size() == 2 && frame_ != "geodetic")
      fail(ErrorKind::Config, "place_columns names 2 columns; frame = \"{}\" takes 3: x, y, z",
           frame_);
    if (separator_ == "," && decimal_sign_ == ",")
      fail(ErrorKind::Config,
           "decimal_sign = \",\" and separator = \",\" are one sign; such tables have separator = "
           "\";\" or \"tab\"");
    if (!attitude_columns_.empty() && attitude_columns_.size() != 3 &&
        attitude_columns_.size() != 4)
      fail(ErrorKind::Config,
           "attitude_columns names {} columns; a quaternion takes 4 (w, x, y, z), angles take 3 "
           "(yaw, pitch, roll)",
           attitude_columns_.size());
    if (!gimbal_columns_.empty() && gimbal_columns_.size() != 3)
      fail(ErrorKind::Config, "gimbal_columns names {} columns; it takes 3: yaw, pitch, roll",
           gimbal_columns_.size());
    if (attitude_frame_ == "local" && !attitude_columns_.empty() && frame_ != "local")
      fail(ErrorKind::Config, "attitude_frame = \"local\" needs frame = \"local\"");
  }

  std::unique_ptr<FixFormat> clone() const override { return std::make_unique<CsvFixes>(*this); }

  FixFrame frame() const override {
    if (frame_ == "ecef") return FixFrame::Ecef;
    return frame_ == "local" ? FixFrame::Local : FixFrame::Geodetic;
  }

  FixTable read(const std::filesystem::path& file, const std::string& above) const override {
    const CsvTable table(file, CsvStyle{.separator = separator_ == "tab" ? '\t' : separator_[0],
                                        .decimal_sign = decimal_sign_[0],
                                        .is_stated = true});
    const bool has_heights = above != "none" || frame() != FixFrame::Geodetic;
    const Columns columns(*this, table, has_heights);
    CsvTimes times(times_, table);
    FixTable result;
    result.frame = frame();
    if (attitude_frame_ == "ecef") result.attitude_frame = AttitudeFrame::Ecef;
    if (attitude_frame_ == "local") result.attitude_frame = AttitudeFrame::Local;
    result.fixes.reserve(table.num_rows());
    for (std::size_t row = 0; row < table.num_rows(); ++row) {
      result.fixes.push_back(fix_of(table, row, columns));
      result.fixes.back().time_s = times.next_s(row);
    }
    if (times.has_utc()) result.zero_unix_s = times.zero_s();
    times.remark(result);
    columns.remark(result);
    std::set<std::size_t> used = columns.all();
    used.insert(times.column());
    const std::array ignored = {
        core::KnownName{has_heights || place_columns_.size() < 3 ? "" : place_columns_[2].c_str(),
                        kNoHeightsWanted, false}};
    table.count(used, ignored, result);
    return result;
  }

 private:
  /// A column, and what its numbers are of metres, degrees or metres a second.
  struct Column {
    std::size_t index = 0;
    ColumnUnit unit;
  };

  struct Columns {
    Columns(const CsvFixes& options, const CsvTable& table, bool has_heights) {
      const auto add = [&](std::vector<Column>& columns, std::size_t index, Quantity quantity,
                           std::string_view key, std::string_view stated) {
        columns.push_back({index, ColumnUnit(quantity, table.column_names()[index], key, stated)});
      };
      const bool is_geodetic = options.frame() == FixFrame::Geodetic;
      for (const std::size_t index : place_indices(options, table, has_heights))
        if (!is_geodetic || place.size() == 2)
          add(place, index, Quantity::Length, "length_unit", options.length_unit_);
        else if (options.angle_unit_ == "dms")
          place.push_back({index, {}});
        else
          add(place, index, Quantity::Angle, "angle_unit", options.angle_unit_);
      for (const std::size_t index : indices(options.attitude_columns_, table))
        if (options.attitude_columns_.size() == 4)
          attitude.push_back({index, {}});
        else
          add(attitude, index, Quantity::Attitude, "attitude_unit", options.attitude_unit_);
      for (const std::size_t index : indices(options.gimbal_columns_, table))
        add(gimbal, index, Quantity::Attitude, "attitude_unit", options.attitude_unit_);
      if (!options.speed_column_.empty())
        add(speed, table.column(options.speed_column_), Quantity::Speed, "speed_unit",
            options.speed_unit_);
    }
    static std::vector<std::size_t> place_indices(const CsvFixes& options, const CsvTable& table,
                                                  bool has_heights) {
      std::vector<std::string> names = options.place_columns_;
      if (!has_heights) names.resize(2);
      const bool lacks_heights = options.frame() == FixFrame::Geodetic && names.size() == 3 &&
                                 !table.find_column(names[2]) && table.find_column(names[1]);
      if (lacks_heights)
        fail(ErrorKind::Input, "{}; where it has no heights, {}", table.message_without(names[2]),
             kNoHeightsWayOut);
      return indices(names, table);
    }
    static std::vector<std::size_t> indices(const std::vector<std::string>& names,
                                            const CsvTable& table) {
      std::vector<std::size_t> result;
      for (const std::string& name : names) result.push_back(table.column(name));
      return result;
    }
    std::set<std::size_t> all() const {
      std::set<std::size_t> result;
      for (const std::vector<Column>* columns : {&place, &attitude, &gimbal, &speed})
        for (const Column& column : *columns) result.insert(column.index);
      return result;
    }
    void remark(FixTable& result) const {
      for (const std::vector<Column>* columns : {&place, &attitude, &gimbal, &speed})
        for (const Column& column : *columns)
          if (!column.unit.remark.empty()) result.remarks.push_back(column.unit.remark);
    }
    std::vector<Column> place, attitude, gimbal;
    std::vector<Column> speed;  ///< one or none
  };

  /// Nothing where one of the cells is empty.
  static std::optional<std::vector<double>> numbers(const CsvTable& table, std::size_t row,
                                                    const std::vector<Column>& columns) {
    std::vector<double> values;
    for (const Column& column : columns) {
      const auto value = table.number(row, column.index);
      if (!value) return std::nullopt;
      values.push_back(*value * column.unit.si);
    }
    if (values.empty()) return std::nullopt;
    return values;
  }

  Fix fix_of(const CsvTable& table, std::size_t row, const Columns& columns) const {
    Fix fix;
    fix.line = table.line(row);
    fix.place = place_of(table, row, columns.place);
    if (const auto values = numbers(table, row, columns.attitude))
      fix.attitude = attitude_of(*values, table.where(row));
    if (const auto values = numbers(table, row, columns.gimbal))
      fix.gimbal = enu_from_body_by_ned_angles(radians_from_degrees((*values)[0]),
                                               radians_from_degrees((*values)[1]),
                                               radians_from_degrees((*values)[2]));
    if (const auto values = numbers(table, row, columns.speed)) fix.speed_mps = values->front();
    return fix;
  }

  /// Not a number where a cell is empty.
  Eigen::Vector3d place_of(const CsvTable& table, std::size_t row,
                           const std::vector<Column>& columns) const {
    Eigen::Vector3d place = Fix().place;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const bool is_written = angle_unit_ == "dms" && frame() == FixFrame::Geodetic && i < 2;
      const auto value = is_written ? angle_of(table, row, columns[i].index, i)
                                    : table.number(row, columns[i].index);
      if (value) place[static_cast<Eigen::Index>(i)] = *value * columns[i].unit.si;
    }
    return place;
  }

  static std::optional<double> angle_of(const CsvTable& table, std::size_t row, std::size_t column,
                                        std::size_t axis) {
    if (table.is_empty(row, column)) return std::nullopt;
    if (const auto angle = degrees_from_text(table.cell(row, column), axis == 0 ? "NS" : "EW"))
      return angle;
    fail(ErrorKind::Input,
         "{}: {} = \"{}\" is no {} in degrees, minutes and seconds; one like {} is expected",
         table.where(row), table.column_names()[column], table.cell(row, column).substr(0, 80),
         axis == 0 ? "latitude" : "longitude",
         axis == 0 ? "46\u00B0 30' 12.5\" N" : "7\u00B0 30' 12.5\" E");
  }

  Eigen::Quaterniond attitude_of(const std::vector<double>& values,
                                 const std::string& where) const {
    Eigen::Quaterniond rotation;
    if (values.size() == 4) {
      rotation = Eigen::Quaterniond(values[0], values[1], values[2], values[3]);
      constexpr double kNormTolerance = 0.01;
      if (std::abs(rotation.norm() - 1.0) > kNormTolerance)
        fail(ErrorKind::Input, "{}: the quaternion has length {:.4f}; rotations have 1", where,
             rotation.norm());
      rotation.normalize();
    } else {
      rotation =
          rotation_by_angles(radians_from_degrees(values[0]), radians_from_degrees(values[1]),
                             radians_from_degrees(values[2]));
    }
    if (attitude_inverse_) rotation = rotation.conjugate();
    rotation = rotation * axes_from_body(attitude_axes_);
    return attitude_frame_ == "ned" ? enu_from_ned() * rotation : rotation;
  }

  std::string separator_ = ",";
  std::string decimal_sign_ = ".";
  std::string frame_ = "geodetic";
  std::vector<std::string> place_columns_ = {"latitude_deg", "longitude_deg", "height_m"};
  std::string angle_unit_;
  std::string length_unit_;
  CsvTimeOptions times_;
  std::vector<std::string> attitude_columns_;
  std::string attitude_unit_;
  std::string attitude_axes_ = "frd";
  std::string attitude_frame_ = "ned";
  bool attitude_inverse_ = false;
  std::vector<std::string> gimbal_columns_;
  std::string speed_column_;
  std::string speed_unit_;
};

// By the keys that name columns; a column that none of them names is not known.
constexpr std::array kKnown = {
    core::KnownName{"time_column", "times"},
    core::KnownName{"place_columns", "places: latitude, longitude and height, or x, y, z"},
    core::KnownName{"attitude_columns", "the body's attitude"},
    core::KnownName{"gimbal_columns", "where the camera looks"},
    core::KnownName{"speed_column", "speeds over ground, which the motion is compared with"},
    core::KnownName{"# comments", "notes of the writer", false}};
constexpr std::array kTables = {
    core::KnownTable{"csv", "columns, by the keys that name them", kKnown}};

}  // namespace

FixFormatInfo csv_fixes() {
  return {.name = "csv",
          .summary = "A table whose columns, units and frames the config names.",
          .make = [] { return std::unique_ptr<FixFormat>(new CsvFixes); },
          .known = kTables};
}

}  // namespace terracast::geo
