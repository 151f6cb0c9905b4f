#pragma once

#include <vector>

#include "tiler/country/route_grid.h"
#include "tiler/country/sites.h"
#include "tiler/country/ways.h"

namespace terracast::tiler::country {

struct RoadNetwork {
  std::vector<Way> ways;  ///< not yet joined
  /// Stretches under the ground, as their middles: which parts of ways are tunnels.
  std::vector<PointsWorld> tunnels;
};

/// Roads from each settlement to its neighbours and out of the square, large ones first: each takes what
/// is there where that is not far round.
/// standing   buildings that were there before, below which roads lead where there is no other way
RoadNetwork plan_roads(RouteGrid& net, const PlanGround& ground,
                       const std::vector<Settlement>& settlements, const std::vector<Point>& gates,
                       const Occupancy& obstacles, const Occupancy& standing);

}  // namespace terracast::tiler::country
