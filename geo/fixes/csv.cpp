#include <cmath>

#include "core/error.h"
#include "geo/fixes/csv_table.h"
#include "geo/fixes/fix_format.h"
#include "geo/fixes/text.h"
#include "geo/fixes/units.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

class CsvFixes final : public FixFormat {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("separator", separator_, "What stands between fields.",
              core::one_of({",", ";", "tab"}));
    visit.key("frame", frame_,
              "What place_columns hold: latitude, longitude, height; or x, y, z fixed to the Earth "
              "(ECEF); or x, y, z about `origin`.",
              core::one_of({"geodetic", "ecef", "local"}));
    visit.key("place_columns", place_columns_, "Names of the three columns of the place, in order.",
              core::size_of(3));
    visit.key("angle_unit", angle_unit_, "Of latitude and longitude.",
              core::one_of({"deg", "rad"}));
    visit.key("length_unit", length_unit_, "Of heights, or of x, y, z.", core::one_of({"m", "ft"}));
    visit.key("time_column", time_column_, "Name of the column of times.");
    visit.key("time_unit", time_unit_,
              "Numbers from any zero (s, ms, us, ns) or from 1970 UTC (unix_s, unix_ms, unix_ns); "
              "text: dates like 2025-06-21T10:00:00Z.",
              core::one_of({"s", "ms", "us", "ns", "unix_s", "unix_ms", "unix_ns", "text"}));
    visit.key("utc_offset_h", utc_offset_h_,
              "Hours by which dates without a zone of their own are ahead of UTC.",
              core::between(-14.0, 14.0));
    visit.key("attitude_columns", attitude_columns_,
              "Names of the columns of a quaternion w, x, y, z, or of the angles yaw, pitch, roll "
              "about z, then y, then x; empty: no attitude.");
    visit.key("attitude_unit", attitude_unit_, "Of yaw, pitch, roll; of the gimbal's too.",
              core::one_of({"deg", "rad"}));
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
    visit.key("speed_unit", speed_unit_, "Its unit.", core::one_of({"mps", "kn", "kmh"}));
  }

  void validate() const override {
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

  FixTable read(const std::filesystem::path& file, const std::string&) const override {
    const CsvTable table(file, separator_ == "tab" ? '\t' : separator_[0]);
    const Columns columns(*this, table);
    FixTable result;
    result.frame = frame();
    result.has_utc = time_unit_.starts_with("unix") || time_unit_ == "text";
    if (attitude_frame_ == "ecef") result.attitude_frame = AttitudeFrame::Ecef;
    if (attitude_frame_ == "local") result.attitude_frame = AttitudeFrame::Local;
    result.fixes.reserve(table.num_rows());
    for (std::size_t row = 0; row < table.num_rows(); ++row)
      result.fixes.push_back(fix_of(table, row, columns));
    return result;
  }

 private:
  struct Columns {
    Columns(const CsvFixes& options, const CsvTable& table)
        : time(table.column(options.time_column_)),
          place(indices(options.place_columns_, table)),
          attitude(indices(options.attitude_columns_, table)),
          gimbal(indices(options.gimbal_columns_, table)) {
      if (!options.speed_column_.empty()) speed = table.column(options.speed_column_);
    }
    static std::vector<std::size_t> indices(const std::vector<std::string>& names,
                                            const CsvTable& table) {
      std::vector<std::size_t> result;
      for (const std::string& name : names) result.push_back(table.column(name));
      return result;
    }
    std::size_t time;
    std::vector<std::size_t> place, attitude, gimbal;
    std::optional<std::size_t> speed;
  };

  /// Nothing where one of the cells is empty.
  static std::optional<std::vector<double>> numbers(const CsvTable& table, std::size_t row,
                                                    const std::vector<std::size_t>& columns) {
    std::vector<double> values;
    for (const std::size_t column : columns) {
      const auto value = table.number(row, column);
      if (!value) return std::nullopt;
      values.push_back(*value);
    }
    if (values.empty()) return std::nullopt;
    return values;
  }

  Fix fix_of(const CsvTable& table, std::size_t row, const Columns& columns) const {
    Fix fix;
    fix.line = table.line(row);
    if (time_unit_ == "text") {
      if (!trimmed(table.cell(row, columns.time)).empty())
        fix.time_s =
            unix_seconds_from_text(table.cell(row, columns.time), utc_offset_h_, table.where(row));
    } else if (const auto time = table.number(row, columns.time)) {
      fix.time_s = *time * seconds_per(time_unit_);
    }
    if (const auto place = numbers(table, row, columns.place)) {
      const double angle =
          frame() == FixFrame::Geodetic ? degrees_per(angle_unit_) : metres_per(length_unit_);
      fix.place = {(*place)[0] * angle, (*place)[1] * angle,
                   (*place)[2] * metres_per(length_unit_)};
    }
    if (const auto values = numbers(table, row, columns.attitude))
      fix.attitude = attitude_of(*values, table.where(row));
    if (const auto values = numbers(table, row, columns.gimbal)) {
      const double unit = radians_per(attitude_unit_);
      fix.gimbal = enu_from_body_by_ned_angles((*values)[0] * unit, (*values)[1] * unit,
                                               (*values)[2] * unit);
    }
    if (columns.speed)
      if (const auto speed = table.number(row, *columns.speed))
        fix.speed_mps = *speed * metres_per_second_per(speed_unit_);
    return fix;
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
      const double unit = radians_per(attitude_unit_);
      rotation = rotation_by_angles(values[0] * unit, values[1] * unit, values[2] * unit);
    }
    if (attitude_inverse_) rotation = rotation.conjugate();
    rotation = rotation * axes_from_body(attitude_axes_);
    return attitude_frame_ == "ned" ? enu_from_ned() * rotation : rotation;
  }

  std::string separator_ = ",";
  std::string frame_ = "geodetic";
  std::vector<std::string> place_columns_ = {"latitude_deg", "longitude_deg", "height_m"};
  std::string angle_unit_ = "deg";
  std::string length_unit_ = "m";
  std::string time_column_ = "time_s";
  std::string time_unit_ = "s";
  double utc_offset_h_ = 0.0;
  std::vector<std::string> attitude_columns_;
  std::string attitude_unit_ = "deg";
  std::string attitude_axes_ = "frd";
  std::string attitude_frame_ = "ned";
  bool attitude_inverse_ = false;
  std::vector<std::string> gimbal_columns_;
  std::string speed_column_;
  std::string speed_unit_ = "mps";
};

}  // namespace

FixFormatInfo csv_fixes() {
  return {.name = "csv",
          .summary = "A table whose columns, units and frames the config names.",
          .make = [] { return std::unique_ptr<FixFormat>(new CsvFixes); }};
}

}  // namespace terracast::geo
