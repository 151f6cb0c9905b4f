#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "tiler/roofs/straight_skeleton.h"

namespace terracast::tiler {

/// A polygon whose rings touch themselves or each other, cut between its corners into polygons
/// whose rings do not, as is_valid() asks: what they cover together is what it covers, exactly.
/// Cuts are the shorter edges of its triangulation.
/// rings       outer ring first; holes may touch it and each other in points and along edges
/// returns     nothing where edges cross, or holes lie outside the outer ring or in each other
/// num_steps   not null: edges that were looked at when its triangles were put together are added
/// cost        grows with the square of the number of corners
/// threads     safe
std::optional<std::vector<RingsSteps>> cut_where_rings_touch(const RingsSteps& rings,
                                                             std::int64_t* num_steps = nullptr);

}  // namespace terracast::tiler
