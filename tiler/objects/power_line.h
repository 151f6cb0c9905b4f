#pragma once

#include <Eigen/Core>
#include <string_view>
#include <vector>

namespace terracast::tiler {

/// Where a support of a power line holds its wires, in its own frame: x along the line, y to the left
/// of it. The same number on supports of the same kind, in the same order.
std::vector<Eigen::Vector3d> wire_points(std::string_view thing);

/// A wire between two points of one height hangs along c (cosh(x / c) - 1); c is its pull over its
/// weight, about 1400 m for the everyday stress of steel-cored aluminium (CIGRE TB 273: 1000 to 2000 m).
inline constexpr double kCatenary_m = 1400.0;
/// Of wood poles' wires, which are slacker.
inline constexpr double kPoleCatenary_m = 700.0;

/// How far the wire hangs below its first end's height, at a share of the level distance.
/// distance_m   level, between its ends
/// rise_m       of the second end above the first
/// returns      height above the first end, m
/// accuracy     1e-9 m against the catenary through both ends (test)
double wire_height_m(double share, double distance_m, double rise_m, double catenary_m);

}  // namespace terracast::tiler
