#pragma once

#include <Eigen/Core>
#include <functional>
#include <utility>
#include <vector>

#include "tiler/roads/road_network.h"

namespace terracast::tiler {

/// threads   safe
using IsWater = std::function<bool(const Eigen::Vector2d& place_world)>;

/// Where each line of a network runs over water that is too wide for a culvert: from and to, along the line.
/// Bridges and tunnels do not.
std::vector<std::vector<std::pair<double, double>>> water_gaps(const RoadNetwork& network,
                                                               const IsWater& is_water,
                                                               const IsWater& is_sea);

}  // namespace terracast::tiler
