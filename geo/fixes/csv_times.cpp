#include "geo/fixes/csv_times.h"

#include <cmath>
#include <limits>

#include "core/error.h"
#include "geo/fixes/column_units.h"
#include "geo/fixes/text.h"

namespace terracast::geo {
namespace {

using core::ErrorKind;
using core::fail;

constexpr double kDay_s = 86400.0;

/// The unit where a column's name states none: of its first cell.
std::string unit_of_cells(const CsvTable& table, std::size_t column) {
  for (std::size_t row = 0; row < table.num_rows(); ++row) {
    if (table.is_empty(row, column)) continue;
    if (stated_time(table.cell(row, column), 0.0)) return "text";
    return seconds_of_clock(table.cell(row, column)) ? "clock" : "s";
  }
  return "s";
}

/// Of ten, to seconds.
int exponent_of(std::string_view unit) {
  if (unit.ends_with("ms")) return -3;
  if (unit.ends_with("us")) return -6;
  return unit.ends_with("ns") ? -9 : 0;
}

}  // namespace

void CsvTimeOptions::describe(core::SchemaVisitor& visit) {
  visit.key("time_column", column, "Name of the column of times.");
  visit.key("time_unit", unit,
            "Numbers from any zero (s, ms, us, ns) or from 1970 UTC (unix_s, unix_ms, unix_us, "
            "unix_ns); text: "
            "dates like 2025-06-21T10:00:00Z; clock: times of day like 10:00:00.25. Empty: as the "
            "column's name says "
            "(time_ms, t [ns], unix_us), or else text or clock where the first cell is one, or "
            "else s; the log tells.",
            core::one_of({"", "s", "ms", "us", "ns", "unix_s", "unix_ms", "unix_us", "unix_ns",
                          "text", "clock"}));
  visit.key("utc_offset_h", utc_offset_h,
            "Hours by which dates without a zone of their own are ahead of UTC.",
            core::between(-14.0, 14.0));
  visit.key("time_wraps_s", wraps_s,
            "Where times start over: 86400 for seconds of a day, 604800 for those of a GPS week. "
            "0: they do not; "
            "times of day start over at midnight anyway.",
            core::between(0.0, 1e9));
}

std::string time_unit_of_name(std::string_view name) {
  const std::string lower = in_lower_case(name);
  const std::string unit = unit_of_name(Quantity::Time, lower);
  const bool is_unix =
      lower.find("unix") != std::string::npos || lower.find("epoch") != std::string::npos;
  return unit.empty() || !is_unix ? unit : "unix_" + unit;
}

CsvTimes::CsvTimes(const CsvTimeOptions& options, const CsvTable& table)
    : options_(options),
      table_(table),
      column_(table.column(options.column)),
      unit_(options.unit),
      unwrapped_(0.0) {
  if (unit_.empty()) {
    is_unit_found_ = true;
    unit_ = time_unit_of_name(table.column_names()[column_]);
    if (unit_.empty()) unit_ = unit_of_cells(table, column_);
  }
  const double wraps_s = unit_ == "clock" && options.wraps_s == 0.0 ? kDay_s : options.wraps_s;
  unwrapped_ = UnwrappedTime(wraps_s);
}

double CsvTimes::next_s(std::size_t row) {
  if (table_.is_empty(row, column_)) return std::numeric_limits<double>::quiet_NaN();
  const bool is_text = unit_ == "text" || unit_ == "clock";
  return unwrapped_.next_s(near_zero_.next_s(is_text ? text_time(row) : number_time(row)));
}

ExactTime CsvTimes::text_time(std::size_t row) {
  const std::string_view cell = table_.cell(row, column_);
  const auto date = stated_time(cell, options_.utc_offset_h);
  const auto clock = seconds_of_clock(cell);
  if (unit_ == "clock" && clock) return ExactTime::of(*clock);
  if (unit_ == "text" && date) {
    num_without_zone_ += date->has_zone ? 0 : 1;
    return date->exact;
  }
  const char* way_out =
      date    ? "; time_unit = \"text\" reads it"
      : clock ? "; time_unit = \"clock\" reads times of day"
      : number_of(cell)
          ? "; numbers are read by a time_unit of s, ms, us or ns, or of unix_s and the like"
          : "";
  fail(ErrorKind::Input, "{}: {} = \"{}\" is no {}; one like {} is expected{}", table_.where(row),
       table_.column_names()[column_], cell.substr(0, 80), unit_ == "text" ? "time" : "time of day",
       unit_ == "text" ? "2025-06-21T10:00:00.250Z" : "10:00:00.250", way_out);
}

ExactTime CsvTimes::number_time(std::size_t row) {
  const std::string_view cell = table_.cell(row, column_);
  const bool may_be_a_date = cell.find_first_of(":T") != std::string_view::npos;  // as no number is
  if (may_be_a_date && (stated_time(cell, 0.0) || seconds_of_clock(cell)))
    fail(ErrorKind::Input, "{}: {} = \"{}\" is no number of {}; time_unit = \"{}\" reads it",
         table_.where(row), table_.column_names()[column_], cell.substr(0, 80), unit_,
         stated_time(cell, 0.0) ? "text" : "clock");
  const double number = *table_.number(row, column_);
  const double time_s = number * si_per(Quantity::Time, unit_);
  if (unit_.starts_with("unix")) {
    const std::string_view fits = unit_of_unix_time(number);
    if (!is_unix_time(time_s))
      fail(ErrorKind::Input, "{}: {} = {} is no time between 1900 and 2200 in {}{}",
           table_.where(row), table_.column_names()[column_], cell.substr(0, 80), unit_,
           fits.empty() ? "; what are the times counted in, and from when?"
                        : fmt::format("; time_unit = \"unix_{}\" reads it", fits));
  } else if (unix_unit_.empty() && unit_of_unix_time(number) == unit_) {
    unix_unit_ = unit_of_unix_time(number);
  }
  return exact_time_of(cell, exponent_of(unit_)).value_or(ExactTime::of(time_s));
}

void CsvTimes::remark(FixTable& result) const {
  const std::string& name = table_.column_names()[column_];
  const std::string named = time_unit_of_name(name);
  if (is_unit_found_ && unit_ != "s")
    result.remarks.push_back(fmt::format("{} is read as time_unit = \"{}\", as {} says", name,
                                         unit_, named.empty() ? "its first cell" : "its name"));
  const bool is_number = unit_ != "text" && unit_ != "clock";
  if (!is_unit_found_ && is_number && !named.empty() &&
      si_per(Quantity::Time, named) != si_per(Quantity::Time, unit_))
    result.remarks.push_back(fmt::format("{} is read as time_unit = \"{}\", while its name says {}",
                                         name, unit_, named));
  if (!unix_unit_.empty())
    result.remarks.push_back(
        fmt::format("{} counts from any zero; its numbers would be times of this century by "
                    "time_unit = \"unix_{}\", which would set the sun",
                    name, unix_unit_));
  if (num_without_zone_ > 0)
    result.remarks.push_back(fmt::format(
        "{} of its times state no zone; they are taken to be {}", num_without_zone_,
        options_.utc_offset_h == 0.0
            ? "UTC, and utc_offset_h would say otherwise"
            : fmt::format("{} h ahead of UTC, as utc_offset_h says", options_.utc_offset_h)));
  if (unwrapped_.num_wraps() > 0)
    result.remarks.push_back(
        fmt::format("its times start over {} times, as at midnight", unwrapped_.num_wraps()));
}

}  // namespace terracast::geo
