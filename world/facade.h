#pragma once

#include <algorithm>
#include <cmath>

#include "world/shape.h"

namespace terracast::world {

/// Width of the bays of a style along a wall's u. Walls of houses are a little narrower or wider for each
/// whole bay: their u is stretched so that bays begin and end at their corners.
constexpr double facade_bay_m(FacadeStyle style) {
  switch (style) {
    case FacadeStyle::Hall:
      return 6.0;
    case FacadeStyle::Church:
      return 4.6;
    case FacadeStyle::Offices:
      return 1.5;
    case FacadeStyle::CurtainWall:
      return 1.6;
    case FacadeStyle::Shops:
      return 3.4;
    case FacadeStyle::Apartments:
      return 3.3;
    default:
      return 2.9;
  }
}

/// The factor on a length that makes it the nearest whole number of parts, at least one.
/// wanted_m   length of a part that would be best
/// part_m     length of a part after it
inline double whole_parts_scale(double length_m, double wanted_m, double part_m) {
  return std::max(std::round(length_m / wanted_m), 1.0) * part_m / length_m;
}

}  // namespace terracast::world
