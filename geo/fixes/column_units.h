#pragma once

#include <string>
#include <string_view>

/// Units of a table's columns: what the config says, or else the column's name, or else metres, degrees, metres a second.
namespace terracast::geo {

/// Angle: of places, which some count in ten millionths of a degree. Attitude: of bodies.
enum class Quantity { Length, Angle, Attitude, Speed, Time };

/// The unit that a column's name states in its last brackets, or as the one unit among its words behind the first, as
/// the config calls it: "ft" of alt_ft_msl, "height (feet)"; "mph" of "speed [mph]"; "ms" of time_ms; empty: none.
std::string unit_of_name(Quantity quantity, std::string_view column);

/// What a number of a unit is in metres, degrees, metres a second or seconds.
/// unit   a number's, as the config calls it; of times with "unix_" before it too
double si_per(Quantity quantity, std::string_view unit);

/// The unit in which a column is read.
struct ColumnUnit {
  ColumnUnit() = default;
  /// stated   by the config under a key; empty: nothing
  ColumnUnit(Quantity quantity, std::string_view column, std::string_view key,
             std::string_view stated);

  double si = 1.0;     ///< si_per() of it
  std::string remark;  ///< for the log: what was found, or contradicts the config; empty: nothing
};

}  // namespace terracast::geo
