#pragma once

#include <array>

#include "validate/geodesy.h"

/// The validator's own delays of satellites' signals by the air.
namespace terracast::validate {

/// Klobuchar's model with the numbers of a navigation file, of the code at L1, m.
/// source   IS-GPS-200, figure 20-4
double klobuchar_m(const std::array<double, 4>& alpha, const std::array<double, 4>& beta,
                   const Geodetic& place, double azimuth_rad, double elevation_rad,
                   double gps_second_of_day);

/// Saastamoinen's model in the standard atmosphere with 70 % humidity, m.
double saastamoinen_m(double lat_rad, double altitude_msl_m, double elevation_rad);

}  // namespace terracast::validate
