#include "geo/satellites/gps_constellation.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <string>

#include "geo/gps_time.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

/// Right ascension of the planes' ascending nodes at the epoch.
constexpr std::array<double, 6> kNodes_deg = {272.847, 332.847, 32.847, 92.847, 152.847, 212.847};
/// Arguments of latitude at the epoch.
constexpr std::array<std::array<double, 4>, 6> kSlots_deg = {
    {{268.126, 161.786, 11.676, 41.806},
     {80.956, 173.336, 309.976, 204.376},
     {111.876, 11.796, 339.666, 241.556},
     {135.226, 265.446, 35.156, 167.356},
     {197.046, 302.596, 66.066, 333.686},
     {238.886, 345.226, 105.206, 135.346}}};
constexpr double kGreenwich_deg = 279.06;      // 18 h 36 min 14.4 s
constexpr double kEpoch_unix_s = 741484800.0;  // 1993-07-01
constexpr double kAxis_m = 26559700.0;
constexpr double kInclination_deg = 55.0;
/// By the Earth's flattening: -4.4874e-7 degrees a second, in the standard's almanac.
constexpr double kNodeRate_degps = -4.4874e-7;

/// As RINEX writes it: 13 digits.
double as_written(double value) {
  return std::strtod(fmt::format("{:.12e}", value).c_str(), nullptr);
}

/// Within -pi to pi.
double wrapped(double angle_rad) { return std::remainder(angle_rad, 2.0 * std::numbers::pi); }

}  // namespace

double toe_of(double gps_s) { return kOrbitInterval_s * std::round(gps_s / kOrbitInterval_s); }

std::vector<BroadcastOrbit> baseline_constellation(double toe_gps_s) {
  const double node_rate_radps = as_written(radians_from_degrees(kNodeRate_degps));
  const double sqrt_a = as_written(std::sqrt(kAxis_m));
  // Two turns while the Earth turns once under the plane: tracks repeat.
  const double motion_radps = 2.0 * (kGpsEarthRate_radps - node_rate_radps);
  const double kepler_radps = std::sqrt(kGpsGravity_m3ps2) / (sqrt_a * sqrt_a * sqrt_a);
  const double since_epoch_s = toe_gps_s - gps_seconds_from_unix(kEpoch_unix_s);
  const double in_week_s = std::fmod(toe_gps_s, kGpsWeek_s);

  std::vector<BroadcastOrbit> orbits;
  for (std::size_t plane = 0; plane < kNodes_deg.size(); ++plane)
    for (const double slot_deg : kSlots_deg[plane]) {
      const double node_rad =
          radians_from_degrees(kNodes_deg[plane] - kGreenwich_deg) +
          std::remainder((node_rate_radps - kGpsEarthRate_radps) * since_epoch_s,
                         2.0 * std::numbers::pi);
      orbits.push_back(
          {.prn = static_cast<int>(orbits.size()) + 1,
           .toe_gps_s = toe_gps_s,
           .sqrt_a = sqrt_a,
           .i0_rad = as_written(radians_from_degrees(kInclination_deg)),
           .omega0_rad = as_written(wrapped(node_rad + kGpsEarthRate_radps * in_week_s)),
           .omega_dot_radps = node_rate_radps,
           .m0_rad =
               as_written(wrapped(radians_from_degrees(slot_deg) + motion_radps * since_epoch_s)),
           .delta_n_radps = as_written(motion_radps - kepler_radps)});
    }
  return orbits;
}

}  // namespace terracast::geo
