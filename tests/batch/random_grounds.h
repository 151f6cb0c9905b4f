#pragma once

#include <cstdint>
#include <vector>

#include "batch/dataset/ground_cells.h"
#include "geo/geodesy.h"

namespace terracast::batch {

/// Grounds of some cells each, near to each other; one in five of a world of its own.
std::vector<GroundSeen> random_grounds(std::uint64_t seed, const geo::Geodetic& middle, int num,
                                       double spread_m);

/// Between the nearest places of two grounds, on WGS84, from all pairs of their cells; -1 when they share
/// one, infinite when they are of different worlds.
double distance_m(const GroundSeen& a, const GroundSeen& b);

}  // namespace terracast::batch
