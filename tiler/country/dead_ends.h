#pragma once

#include <functional>
#include <vector>

#include "tiler/country/ways.h"

namespace terracast::tiler::country {

/// Streets that no road leads to are left out.
void drop_unreached(std::vector<Way>& ways);

/// What is known of water where ways end.
struct WaterAtWays {
  /// Stretches of a line that bridges over water would take, one by one, in order.
  std::function<std::vector<StructureSpan>(const PointsWorld& line)> bridges;
  std::function<bool(const Point& at)> is_wet;
};

/// Cuts ways that end in water, or on a bridge that leads to no other way, back to the shore, or to their last
/// meeting with another way where that comes first. What is left of nothing is left out.
/// ways   joined at their crossings
void retreat_from_water(std::vector<Way>& ways, const WaterAtWays& water);

}  // namespace terracast::tiler::country
