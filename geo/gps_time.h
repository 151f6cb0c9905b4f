#pragma once

namespace terracast::geo {

/// GPS time less UTC at a time of UTC, s: the leap seconds since 1980, which are known up to 2017; later ones would be
/// announced half a year ahead, and none is.
/// source   IERS, Bulletin C
double gps_minus_utc_s(double unix_s);

/// Seconds of GPS time since 1980-01-06, of a time of UTC.
double gps_seconds_from_unix(double unix_s);

}  // namespace terracast::geo
