#pragma once

#include <vector>

#include "tiler/roofs/straight_skeleton.h"

namespace terracast::tiler {

/// What of a polygon lies farther inside than its edges, whatever becomes of these on the way:
/// edges that are too short vanish, necks part it. Where its border turns inward, corners stay, or
/// are cut beyond 120 degrees. No polygon where nothing lies so far inside.
///
/// Edges that have moved inward go round what is left anticlockwise, and round nothing else (Chen
/// and McMains, Polygon offsetting by computing winding numbers, 2005).
/// rings      a polygon, outer ring first, anticlockwise, holes clockwise; they may touch
/// by_steps   above 0
/// returns    polygons whose corners are rounded, so that rings may touch by a step
/// cost       grows with the square of the number of corners
/// throws     Internal: edges that cannot be triangulated
std::vector<RingsSteps> polygons_within(const RingsSteps& rings, double by_steps);

}  // namespace terracast::tiler
