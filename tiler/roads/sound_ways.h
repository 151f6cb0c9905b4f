#pragma once

#include <vector>

#include "tiler/roads/road_network.h"

namespace terracast::tiler {

/// Ways of which a network can be made, whatever their order was: of places, cut at the world's
/// square, each once, thinned where they have too many points, and without those that are scribbled
/// or crowd.
/// half_size_m   of the world's square
/// counts        what was repaired or left out is added
std::vector<Way> sound_ways(std::vector<Way> ways, double half_size_m, NetworkCounts& counts);

}  // namespace terracast::tiler
