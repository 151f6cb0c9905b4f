#pragma once

#include <numbers>

namespace terracast::geo {

inline constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;

constexpr double radians_from_degrees(double degrees) { return degrees * kRadiansPerDegree; }
constexpr double degrees_from_radians(double radians) { return radians / kRadiansPerDegree; }
constexpr double metres_from_millimetres(double millimetres) { return millimetres * 1e-3; }
/// The international foot, 0.3048 m exactly.
constexpr double metres_from_feet(double feet) { return feet * 0.3048; }

}  // namespace terracast::geo
