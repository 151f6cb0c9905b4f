#pragma once

#include <algorithm>
#include <cmath>

namespace terracast::world {

/// Height above the sea where snow lies in summer: 5100 m in the tropics, 2950 m at 45 degrees, 900 m
/// at 75. A rule of thumb of the latitude alone; dry ranges have it 500 m higher, coasts lower.
inline double snow_line_m(double lat_deg) {
  return std::clamp(5100.0 - 70.0 * std::max(std::abs(lat_deg) - 15.0, 0.0), 300.0, 5100.0);
}

/// Height above the sea up to which forests grow.
inline double tree_line_m(double lat_deg) { return snow_line_m(lat_deg) - 900.0; }

}  // namespace terracast::world
