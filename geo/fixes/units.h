#pragma once

#include <string_view>

#include "core/error.h"
#include "geo/units.h"

namespace terracast::geo {

/// The value of a unit that a config names: one_of() has let only these words in.
inline double metres_per(std::string_view unit) {
  return unit == "ft" ? metres_from_feet(1.0) : 1.0;
}
inline double degrees_per(std::string_view unit) {
  return unit == "rad" ? degrees_from_radians(1.0) : 1.0;
}
inline double radians_per(std::string_view unit) {
  return unit == "deg" ? radians_from_degrees(1.0) : 1.0;
}
/// The international knot, 1852 m an hour exactly.
inline constexpr double kMetresPerSecondPerKnot = 1852.0 / 3600.0;
inline double metres_per_second_per(std::string_view unit) {
  if (unit == "kn") return kMetresPerSecondPerKnot;
  return unit == "kmh" ? 1.0 / 3.6 : 1.0;
}
inline double seconds_per(std::string_view unit) {
  if (unit.ends_with("ms")) return 1e-3;
  if (unit.ends_with("us")) return 1e-6;
  return unit.ends_with("ns") ? 1e-9 : 1.0;
}

}  // namespace terracast::geo
