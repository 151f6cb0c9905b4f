#pragma once

#include <Eigen/Core>
#include <span>

namespace terracast::geo {

/// By what a deviation of all ranges is multiplied in a fix; infinite where fewer than four satellites, or four in one cone,
/// leave a fix open.
struct DilutionOfPrecision {
  double horizontal, vertical, position, time;
};

/// directions_enu   to the satellites, unit: east, north, up
/// accuracy         the inverse of the matrix of directions, to rounding
DilutionOfPrecision dilution_of_precision(std::span<const Eigen::Vector3d> directions_enu);

}  // namespace terracast::geo
