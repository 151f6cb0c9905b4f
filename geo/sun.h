#pragma once

#include <Eigen/Core>
#include <string>

#include "geo/geodesy.h"

namespace terracast::geo {

/// Seconds since 1970-01-01T00:00:00Z of "YYYY-MM-DDTHH:MM:SS[.fff]Z".
/// throws Config: another form, or no such date
double unix_seconds_from_utc(const std::string& utc);

/// The same in text, to the millisecond: "YYYY-MM-DDTHH:MM:SS.mmmZ", without the fraction where it is
/// nought.
/// throws Input: a year that is not 0000 to 9999
std::string utc_from_unix_seconds(double unix_seconds);

/// Unit vector towards the sun's centre in the world frame.
/// place      where it is seen from: the parallax is up to 0.0024 deg
/// accuracy   0.01 deg from 1950 to 2050 (Meeus's lower-accuracy method with the perturbations);
///            without refraction
/// threads    safe
Eigen::Vector3d sun_direction_world(const WorldFrame& frame, const Geodetic& place,
                                    double unix_seconds);

/// The sun's mean angular radius, rad.
inline constexpr double kSunAngularRadius_rad = 0.004654793;

}  // namespace terracast::geo
