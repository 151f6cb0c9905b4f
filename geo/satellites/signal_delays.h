#pragma once

#include <array>

#include "geo/geodesy.h"

/// What the air does to signals of satellites.
namespace terracast::geo {

/// The eight numbers of Klobuchar's model that satellites send.
struct KlobucharModel {
  std::array<double, 4> alpha{};  ///< s, s per semicircle, …
  std::array<double, 4> beta{};
};

/// Of a quiet day, 2004-01-01, as satellites sent them then.
KlobucharModel klobuchar_of_2004();

/// Delay of the code at L1, and advance of the carrier, m.
/// azimuth_rad     from north to the east
/// source          IS-GPS-200, 20.3.3.5.2.5; half of the true delay is left by it, as the standard says
double ionosphere_delay_m(const KlobucharModel& model, const Geodetic& place, double azimuth_rad,
                          double elevation_rad, double gps_s);

/// Delay of code and carrier, m, in the standard atmosphere with 70 % humidity.
/// altitude_msl_m   -500 to 11000; what is higher or lower is taken as there
/// source           Saastamoinen 1972, with the pressure, temperature and vapour of the standard atmosphere
double troposphere_delay_m(double lat_rad, double altitude_msl_m, double elevation_rad);

}  // namespace terracast::geo
