#pragma once

#include <vector>

#include "tiler/country/plan_ground.h"
#include "tiler/country/survey.h"

namespace terracast::tiler::country {

struct River {
  PointsWorld line;  ///< downstream
  double width_m = 0.0;
  bool is_stream = false;  ///< narrower than a river
};

/// Streams and rivers where the ground's water runs: down its steepest way, filled hollows passed, to the
/// sea or the border. A tributary ends at a point of what it flows into.
std::vector<River> find_rivers(const PlanGround& ground);
/// The ground's nodes that rivers run through, streams left out.
Grid<std::uint8_t> river_nodes(const PlanGround& ground);

/// Hollows that fill up: outlines at the height of their spill, by marching squares.
std::vector<PointsWorld> find_lakes(const PlanGround& ground);

}  // namespace terracast::tiler::country
