#pragma once

#include <algorithm>
#include <cmath>

namespace terracast::world {

/// Height above the sea from which snow lies all summer, by latitude: a straight line through the
/// tropics' 5100 m and the Alps' 2900 m.
inline double snow_line_m(double lat_deg) {
  return std::clamp(5100.0 - 70.0 * std::max(std::abs(lat_deg) - 15.0, 0.0), 300.0, 5100.0);
}

/// Height above the sea up to which forest grows: 2000 m in the Alps, the sea at 70 degrees.
inline double tree_line_m(double lat_deg) { return std::max(snow_line_m(lat_deg) - 900.0, 0.0); }

}  // namespace terracast::world
