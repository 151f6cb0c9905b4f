#pragma once

#include <vector>

#include "tiler/roads/road_heights.h"
#include "tiler/roads/road_network.h"

namespace terracast::tiler {

/// Where ways, said to be on the ground or on bridges, would lie in cuttings more than 20 m deep at their
/// middle line, as sources leave out tunnels: as far to both sides as they lie more than 8 m deep. A mountain
/// is pierced from such depths on, not cut. Runways are always cut.
std::vector<Stretch> deep_cuttings(const RoadNetwork& network, const RoadHeights& heights);

}  // namespace terracast::tiler
