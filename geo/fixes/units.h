#pragma once

#include <string_view>

#include "core/error.h"
#include "geo/units.h"

namespace terracast::geo {

/// The value of a unit of angles that a config names: one_of() has let only these words in.
inline double degrees_per(std::string_view unit) {
  return unit == "rad" ? degrees_from_radians(1.0) : 1.0;
}
/// The international knot, 1852 m an hour exactly, and mile, 1609.344 m exactly.
inline constexpr double kMetresPerSecondPerKnot = 1852.0 / 3600.0;
inline constexpr double kMetresPerSecondPerMileAnHour = 1609.344 / 3600.0;

}  // namespace terracast::geo
