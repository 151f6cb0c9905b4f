#include <algorithm>
#include <cmath>

#include "core/plugin_rows.h"
#include "sensors/lidar/pattern.h"

// Every pattern, in alphabetical order: X(name) is patterns/name.cpp, which defines `ScanPatternInfo name_pattern()`.
#define TERRACAST_PATTERNS(X) \
  X(cone)                     \
  X(oscillating)              \
  X(polygon)                  \
  X(raster)                   \
  X(risley)                   \
  X(spinning)

namespace terracast::sensors::lidar {

#define TERRACAST_DECLARE(name) ScanPatternInfo name##_pattern();
TERRACAST_PATTERNS(TERRACAST_DECLARE)
#undef TERRACAST_DECLARE

std::span<const ScanPatternInfo> scan_patterns() {
#define TERRACAST_ENTRY(name) name##_pattern(),
  static const ScanPatternInfo table[] = {TERRACAST_PATTERNS(TERRACAST_ENTRY)};
#undef TERRACAST_ENTRY
  return table;
}

Eigen::Vector3d direction_of(double azimuth_rad, double elevation_rad) {
  const double level = std::cos(elevation_rad);
  return {level * std::cos(azimuth_rad), level * std::sin(azimuth_rad), std::sin(elevation_rad)};
}

std::vector<double> times_of_pulses(double pulse_hz, std::int64_t scan, double rate_hz) {
  // A pulse that rounding puts just before a border is the first behind it.
  const double rounding_s = 1e-6 / pulse_hz;
  const double begin_s = static_cast<double>(scan) / rate_hz;
  const double end_s = static_cast<double>(scan + 1) / rate_hz;
  auto pulse = static_cast<std::int64_t>(std::floor(begin_s * pulse_hz)) - 1;
  while (static_cast<double>(pulse) / pulse_hz < begin_s - rounding_s) ++pulse;
  std::vector<double> times_s;
  times_s.reserve(static_cast<std::size_t>((end_s - begin_s) * pulse_hz) + 2);
  for (; static_cast<double>(pulse) / pulse_hz < end_s - rounding_s; ++pulse)
    times_s.push_back(std::max(static_cast<double>(pulse) / pulse_hz, begin_s));
  return times_s;
}

double phase_of(double time_s, double rate_hz) {
  const double turns = time_s * rate_hz;
  return turns - std::floor(turns);
}

}  // namespace terracast::sensors::lidar
