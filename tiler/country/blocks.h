#pragma once

#include <vector>

#include "tiler/country/ways.h"

namespace terracast::tiler::country {

/// A face of the net of ways, seen from within: on the left of each of its edges.
struct Block {
  PointsWorld ring;             ///< not closed; may run along a dead end and back
  std::vector<RoadKind> kinds;  ///< of the edge that begins at each point
  double area_m2 = 0.0;         ///< below 0: the land round a net
  double half_width_m(std::size_t edge) const { return 0.5 * rule_of(kinds[edge]).width_m; }
};

/// All faces of ways that were joined at their crossings.
std::vector<Block> find_blocks(const std::vector<Way>& ways);

/// A block's ring without dead ends and without points that are nearly on a line; `kinds` goes with it.
Block tidied(const Block& block, double tolerance_m);

/// The direction of a block's longest edge.
Point longest_edge(const Block& block);

}  // namespace terracast::tiler::country
