#include "geo/satellites/signal_delays.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "geo/satellites/broadcast_orbit.h"
#include "geo/units.h"

namespace terracast::geo {
namespace {

constexpr double kPi = std::numbers::pi;

/// a0 + a1 x + a2 x^2 + a3 x^3.
double cubic(const std::array<double, 4>& a, double x) {
  return a[0] + x * (a[1] + x * (a[2] + x * a[3]));
}

}  // namespace

KlobucharModel klobuchar_of_2004() {
  return {.alpha = {0.1118e-7, -0.7451e-8, -0.5961e-7, 0.1192e-6},
          .beta = {0.1167e6, -0.2294e6, -0.1311e6, 0.1049e7}};
}

double ionosphere_delay_m(const KlobucharModel& model, const Geodetic& place, double azimuth_rad,
                          double elevation_rad, double gps_s) {
  // Angles are in semicircles, as the standard has them.
  const double elevation = elevation_rad / kPi;
  const double earth_angle = 0.0137 / (elevation + 0.11) - 0.022;
  const double latitude =
      std::clamp(place.lat_deg / 180.0 + earth_angle * std::cos(azimuth_rad), -0.416, 0.416);
  const double longitude =
      place.lon_deg / 180.0 + earth_angle * std::sin(azimuth_rad) / std::cos(latitude * kPi);
  const double magnetic = latitude + 0.064 * std::cos((longitude - 1.617) * kPi);
  constexpr double kDay_s = 86400.0;
  double local_s = std::fmod(4.32e4 * longitude + gps_s, kDay_s);
  if (local_s < 0.0) local_s += kDay_s;
  const double slant = 1.0 + 16.0 * std::pow(0.53 - elevation, 3);
  const double amplitude_s = std::max(0.0, cubic(model.alpha, magnetic));
  const double period_s = std::max(72000.0, cubic(model.beta, magnetic));
  const double phase = 2.0 * kPi * (local_s - 50400.0) / period_s;
  const double bulge =
      std::abs(phase) < 1.57 ? 1.0 + phase * phase * (-0.5 + phase * phase / 24.0) : 0.0;
  return kLight_mps * slant * (5e-9 + amplitude_s * bulge);
}

double troposphere_delay_m(double lat_rad, double altitude_msl_m, double elevation_rad) {
  constexpr double kHumidity = 0.7;
  const double altitude_m = std::clamp(altitude_msl_m, -500.0, 11000.0);
  const double pressure_hpa = 1013.25 * std::pow(1.0 - 2.2557e-5 * altitude_m, 5.2568);
  const double temperature_k = 288.15 - 6.5e-3 * altitude_m;
  const double vapour_hpa =
      6.108 * kHumidity * std::exp((17.15 * temperature_k - 4684.0) / (temperature_k - 38.45));
  const double zenith = std::cos(0.5 * kPi - elevation_rad);
  const double dry_m = 0.0022768 * pressure_hpa /
                       (1.0 - 0.00266 * std::cos(2.0 * lat_rad) - 0.00028 * 1e-3 * altitude_m);
  const double wet_m = 0.002277 * (1255.0 / temperature_k + 0.05) * vapour_hpa;
  return (dry_m + wet_m) / zenith;
}

}  // namespace terracast::geo
