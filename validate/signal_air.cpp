#include "validate/signal_air.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace terracast::validate {

double klobuchar_m(const std::array<double, 4>& alpha, const std::array<double, 4>& beta,
                   const Geodetic& place, double azimuth_rad, double elevation_rad,
                   double gps_second_of_day) {
  constexpr double kPi = std::numbers::pi;
  constexpr double kHalfTurn_deg = 180.0;
  const double e = elevation_rad / kPi;
  const double psi = 0.0137 / (e + 0.11) - 0.022;
  const double phi =
      std::min(0.416, std::max(-0.416, place.lat_deg / kHalfTurn_deg + psi * std::cos(azimuth_rad)));
  const double lambda =
      place.lon_deg / kHalfTurn_deg + psi * std::sin(azimuth_rad) / std::cos(kPi * phi);
  const double magnetic = phi + 0.064 * std::cos(kPi * (lambda - 1.617));
  double t = 43200.0 * lambda + gps_second_of_day;
  t -= 86400.0 * std::floor(t / 86400.0);
  double amplitude = 0.0, period = 0.0;
  for (std::size_t n = 0; n < 4; ++n) {
    amplitude += alpha[n] * std::pow(magnetic, static_cast<double>(n));
    period += beta[n] * std::pow(magnetic, static_cast<double>(n));
  }
  const double x = 2.0 * kPi * (t - 50400.0) / std::max(period, 72000.0);
  double delay_s = 5e-9;
  if (std::abs(x) < 1.57)
    delay_s += std::max(amplitude, 0.0) * (1.0 - x * x / 2.0 + std::pow(x, 4) / 24.0);
  return 299792458.0 * (1.0 + 16.0 * std::pow(0.53 - e, 3)) * delay_s;
}

double saastamoinen_m(double lat_rad, double altitude_msl_m, double elevation_rad) {
  const double h = std::clamp(altitude_msl_m, -500.0, 11000.0);
  const double pressure_hpa = 1013.25 * std::pow(1.0 - h * 2.2557e-5, 5.2568);
  const double kelvin = 273.15 + 15.0 - h * 6.5e-3;
  const double vapour_hpa = 0.7 * 6.108 * std::exp((17.15 * kelvin - 4684.0) / (kelvin - 38.45));
  const double gravity = 1.0 - 0.00266 * std::cos(2.0 * lat_rad) - 2.8e-7 * h;
  return (0.0022768 * pressure_hpa / gravity + 0.002277 * (1255.0 / kelvin + 0.05) * vapour_hpa) /
         std::sin(elevation_rad);
}

}  // namespace terracast::validate
