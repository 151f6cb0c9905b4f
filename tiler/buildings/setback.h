#pragma once

#include <vector>

#include "tiler/buildings/town.h"

namespace terracast::tiler {

/// Walls of what lies over nothing else stand back so far from the footprint, so that those of two houses on one line
/// are two.
inline constexpr double kInset_m = 0.010;
/// What lies over others stands back by so much more for each rank, and its top and its foundation are so much
/// lower. Planes of nearby ranks are apart by more than their rounding to steps moves them (1.4 steps of 0.98 mm).
inline constexpr double kSetback_m = 0.006;
/// The bottom of what begins above the ground is so much lower than it says: it reaches into what carries it, whose top
/// is lower by a whole number of setbacks.
inline constexpr double kSunk_m = 0.009;

/// Ranks of buildings, so that no two of those that lie over each other have faces in one plane: 0 where nothing
/// else is; of two, the later one has the higher rank. A pure function of the footprints and their order.
/// cost   edges of each pair of footprints whose boxes meet
std::vector<int> setback_ranks(const std::vector<Building>& buildings, const BuildingIndex& index);

}  // namespace terracast::tiler
