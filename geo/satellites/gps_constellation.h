#pragma once

#include <vector>

#include "geo/satellites/broadcast_orbit.h"

namespace terracast::geo {

/// Elements hold for two hours, from an hour before their time: where they are told once for a whole number of these.
inline constexpr double kOrbitInterval_s = 7200.0;

/// The time of the elements that are sent at a time: the nearest even hour.
double toe_of(double gps_s);

/// The 24 satellites of GPS's baseline constellation about a time, PRN 1 to 24 in the order of their slots A1 … F4: circular
/// orbits whose tracks over the ground repeat each sidereal day as planned, clocks without error. Not where the real ones
/// were at that time: their like in number and spread. Elements are rounded to the digits that RINEX has.
/// source   GPS Standard Positioning Service Performance Standard (2008), table 3.2-1, epoch 1993-07-01
std::vector<BroadcastOrbit> baseline_constellation(double toe_gps_s);

}  // namespace terracast::geo
