#pragma once

#include <string>

#include "core/schema.h"
#include "geo/fixes/csv_table.h"
#include "geo/fixes/exact_time.h"
#include "geo/fixes/times.h"

namespace terracast::geo {

/// Keys of a table's column of times.
struct CsvTimeOptions {
  std::string column = "time_s";
  std::string unit;
  double utc_offset_h = 0.0;
  double wraps_s = 0.0;

  void describe(core::SchemaVisitor& visit);
};

/// The unit that a column's name states: time_ms, t [us], "timestamp (ns)", unix_s; empty: none.
std::string time_unit_of_name(std::string_view name);

/// The times of a table's rows.
class CsvTimes {
 public:
  /// throws   Input: no such column
  CsvTimes(const CsvTimeOptions& options, const CsvTable& table);

  std::size_t column() const { return column_; }
  bool has_utc() const { return unit_.starts_with("unix") || unit_ == "text"; }
  /// Of the rows in their order, since zero_s(); not a number where the cell is empty.
  /// accuracy   differences of times are those of the written decimals, to 1e-12 s within an hour
  /// throws   Input: the cell holds something else than the unit says, with the line and what would read it
  double next_s(std::size_t row);
  /// The zero of the times that were given, on the table's clock.
  double zero_s() const { return near_zero_.zero_s(); }
  /// What was assumed.
  void remark(FixTable& result) const;

 private:
  ExactTime number_time(std::size_t row);
  ExactTime text_time(std::size_t row);

  const CsvTimeOptions& options_;
  const CsvTable& table_;
  std::size_t column_;
  std::string unit_;
  bool is_unit_found_ = false;  ///< not stated by the config
  NearZero near_zero_;
  UnwrappedTime unwrapped_;
  std::size_t num_without_zone_ = 0;
  std::string_view unix_unit_;  ///< in which plain times would be of this century
};

}  // namespace terracast::geo
