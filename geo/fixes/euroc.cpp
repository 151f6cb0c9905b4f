#include <array>
#include <charconv>
#include <cmath>

#include "core/error.h"
#include "geo/fixes/csv_table.h"
#include "geo/fixes/fix_format.h"
#include "geo/fixes/text.h"
#include "geo/fixes/times.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

constexpr std::string_view kOfTheMotion = "follows from the places and attitudes that are flown";
constexpr std::string_view kOfTheUnit = "an error of the inertial unit, not of its motion";

// Without the units in brackets behind them.
constexpr std::array kKnown = {
    core::KnownName{"timestamp", "times in nanoseconds"},
    core::KnownName{"p_RS_R_x", "place in metres"},
    core::KnownName{"p_RS_R_y", "place in metres"},
    core::KnownName{"p_RS_R_z", "place in metres"},
    core::KnownName{"q_RS_w", "attitude"},
    core::KnownName{"q_RS_x", "attitude"},
    core::KnownName{"q_RS_y", "attitude"},
    core::KnownName{"q_RS_z", "attitude"},
    core::KnownName{"v_RS_R_x", "speed, which the motion is compared with"},
    core::KnownName{"v_RS_R_y", "speed, which the motion is compared with"},
    core::KnownName{"v_RS_R_z", kOfTheMotion, false},
    core::KnownName{"b_w_RS_S_x", kOfTheUnit, false},
    core::KnownName{"b_w_RS_S_y", kOfTheUnit, false},
    core::KnownName{"b_w_RS_S_z", kOfTheUnit, false},
    core::KnownName{"b_a_RS_S_x", kOfTheUnit, false},
    core::KnownName{"b_a_RS_S_y", kOfTheUnit, false},
    core::KnownName{"b_a_RS_S_z", kOfTheUnit, false},
    core::KnownName{"# comments", "notes of the writer", false}};
constexpr std::array kTables = {core::KnownTable{"euroc", "columns, without their units", kKnown}};

/// "p_RS_R_x" of "p_RS_R_x [m]" and of "#timestamp [ns]".
std::string_view without_unit(std::string_view name) {
  if (name.starts_with('#')) name.remove_prefix(1);
  return trimmed(name.substr(0, name.find('[')));
}

/// States of EuRoC's datasets (ASL's layout): state_groundtruth_estimate0/data.csv, the pose of the inertial unit S in
/// the file's own frame R, whose z is up.
class EurocFixes final : public FixFormat {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("attitude_axes", attitude_axes_,
              "The axes that the quaternions turn: forward left up, forward right down, right "
              "down forward (a camera), or up right forward (the inertial unit of EuRoC's own "
              "datasets).",
              core::one_of({"flu", "frd", "rdf", "urf"}));
    visit.key("unix_times", unix_times_, "Times count from 1970 UTC, not from any zero.");
  }
  std::unique_ptr<FixFormat> clone() const override { return std::make_unique<EurocFixes>(*this); }
  FixFrame frame() const override { return FixFrame::Local; }

  FixTable read(const std::filesystem::path& path, const std::string&) const override {
    std::error_code error;
    const auto file = std::filesystem::is_directory(path, error) ? path / "data.csv" : path;
    const CsvTable table(file, ',');
    if (table.num_rows() > kMostFixes)
      fail(ErrorKind::Input, "{}: {} rows; up to {} are read: cut it", file.string(),
           table.num_rows(), kMostFixes);
    const Columns columns(table, file);
    FixTable result;
    result.frame = FixFrame::Local;
    result.attitude_frame = AttitudeFrame::Local;
    std::optional<std::int64_t> first_ns;
    for (std::size_t row = 0; row < table.num_rows(); ++row)
      result.fixes.push_back(fix_of(table, row, columns, first_ns));
    if (unix_times_ && first_ns) result.zero_unix_s = static_cast<double>(*first_ns) / kPerSecond;
    columns.count(result);
    remark_if_tilted(result);
    return result;
  }

 private:
  class Columns {
   public:
    Columns(const CsvTable& table, const std::filesystem::path& file) : table_(table) {
      constexpr std::size_t kMostColumns = 10000;
      if (table.column_names().size() > kMostColumns)
        fail(ErrorKind::Input, "{}: {} columns; states of EuRoC have 17", file.string(),
             table.column_names().size());
      for (std::size_t i = 0; i < table.column_names().size(); ++i)
        if (!indices_.try_emplace(std::string(without_unit(table.column_names()[i])), i).second)
          repeated_.insert(std::string(without_unit(table.column_names()[i])));
      time = required("timestamp", file);
      for (const std::string_view name : {"p_RS_R_x", "p_RS_R_y", "p_RS_R_z"})
        place.push_back(required(name, file));
      for (const std::string_view name : {"q_RS_w", "q_RS_x", "q_RS_y", "q_RS_z"})
        attitude.push_back(required(name, file));
      for (const std::string_view name : {"v_RS_R_x", "v_RS_R_y"})
        if (indices_.contains(name)) speed.push_back(required(name, file));
    }

    /// Nothing where a cell is empty, or where there are no such columns.
    std::optional<std::array<double, 4>> numbers(std::size_t row,
                                                 const std::vector<std::size_t>& columns) const {
      std::array<double, 4> values = {};
      for (std::size_t i = 0; i < columns.size(); ++i) {
        const auto value = table_.number(row, columns[i]);
        if (!value) return std::nullopt;
        values[i] = *value;
      }
      if (columns.empty()) return std::nullopt;
      return values;
    }

    void count(FixTable& result) const {
      const auto num_rows = static_cast<std::int64_t>(table_.num_rows());
      for (const auto& [name, index] : indices_) {
        if (repeated_.contains(name)) {
          result.ledger.ignore(name, "stands in several columns, and is not needed", num_rows);
          continue;
        }
        std::size_t num_empty = 0;
        for (std::size_t row = 0; row < table_.num_rows(); ++row)
          num_empty += table_.is_empty(row, index) ? 1 : 0;
        if (num_empty > 0) result.empty[name] = num_empty;
        result.ledger.count(name, kKnown, num_rows);
      }
      if (table_.num_comments() > 0)
        result.ledger.count("# comments", kKnown, static_cast<std::int64_t>(table_.num_comments()));
    }

    std::size_t time = 0;
    std::vector<std::size_t> place, attitude, speed;

   private:
    std::size_t required(std::string_view name, const std::filesystem::path& file) const {
      if (repeated_.contains(name))
        fail(ErrorKind::Input, "{}: two columns are named {}", file.string(), name);
      if (const auto found = indices_.find(name); found != indices_.end()) return found->second;
      fail(ErrorKind::Input,
           "{}: there is no column {}; states of EuRoC have timestamp, p_RS_R_x to z and q_RS_w to "
           "z, and this has {}. Poses of others are read by format = \"tum\" or \"csv\"",
           file.string(), name, fmt::join(table_.column_names(), ", "));
    }

    const CsvTable& table_;
    std::map<std::string, std::size_t, std::less<>> indices_;
    std::set<std::string, std::less<>> repeated_;  ///< names of several columns
  };

  Fix fix_of(const CsvTable& table, std::size_t row, const Columns& columns,
             std::optional<std::int64_t>& first_ns) const {
    Fix fix;
    fix.line = table.line(row);
    fix.time_s = time_of(table, row, columns.time, first_ns);
    if (const auto p = columns.numbers(row, columns.place)) fix.place << (*p)[0], (*p)[1], (*p)[2];
    if (const auto v = columns.numbers(row, columns.speed); v && columns.speed.size() == 2)
      fix.speed_mps = std::hypot((*v)[0], (*v)[1]);
    const auto q = columns.numbers(row, columns.attitude);
    if (!q) return fix;
    const Eigen::Quaterniond rotation((*q)[0], (*q)[1], (*q)[2], (*q)[3]);
    constexpr double kNormTolerance = 0.01;
    if (std::abs(rotation.norm() - 1.0) > kNormTolerance)
      fail(ErrorKind::Input, "{}: the quaternion has length {:.4f}; rotations have 1",
           table.where(row), rotation.norm());
    fix.attitude = rotation.normalized() * axes_from_body(attitude_axes_);
    return fix;
  }

  /// A vehicle is upright most of the time.
  void remark_if_tilted(FixTable& table) const {
    constexpr double kLeastMean = 0.5;
    double sum = 0.0;
    std::size_t count = 0;
    for (const Fix& fix : table.fixes) {
      if (!fix.attitude) continue;
      sum += (*fix.attitude * Eigen::Vector3d::UnitZ()).z();
      ++count;
    }
    if (count == 0 || sum >= kLeastMean * static_cast<double>(count)) return;
    table.remarks.push_back(
        fmt::format("with attitude_axes = \"{}\" the body's z axis points up by {:.2f} on average, "
                    "where 1 is upright: are these the axes? The inertial unit of EuRoC's own "
                    "datasets has attitude_axes = \"urf\"",
                    attitude_axes_, sum / static_cast<double>(count)));
  }

  static constexpr double kPerSecond = 1e9;

  /// Since the first of the times; not a number where the cell is empty.
  double time_of(const CsvTable& table, std::size_t row, std::size_t column,
                 std::optional<std::int64_t>& first_ns) const {
    if (table.is_empty(row, column)) return Fix().time_s;
    const std::string_view text = trimmed(table.cell(row, column));
    std::int64_t time_ns = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), time_ns);
    if (error != std::errc() || end != text.data() + text.size() || time_ns < 0)
      fail(ErrorKind::Input,
           "{}: timestamp = {} is no whole number of nanoseconds; other times are read by format = "
           "\"csv\"",
           table.where(row), text.substr(0, 80));
    if (unix_times_ && !is_unix_time(static_cast<double>(time_ns) / kPerSecond))
      fail(ErrorKind::Input,
           "{}: timestamp = {} is no time between 1900 and 2200 in nanoseconds since 1970; times "
           "from another zero have unix_times = false",
           table.where(row), text.substr(0, 80));
    if (!first_ns) first_ns = time_ns;
    return static_cast<double>(time_ns - *first_ns) / kPerSecond;
  }

  std::string attitude_axes_ = "flu";
  bool unix_times_ = false;
};

}  // namespace

FixFormatInfo euroc_fixes() {
  return {
      .name = "euroc",
      .summary = "States of EuRoC's datasets (data.csv), about an origin that the config names.",
      .make = [] { return std::unique_ptr<FixFormat>(new EurocFixes); },
      .known = kTables};
}

}  // namespace terracast::geo
