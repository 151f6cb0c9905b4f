#pragma once

#include <optional>
#include <vector>

#include "tiler/vector_source.h"

namespace terracast::tiler {

/// A ring of very many corners without those that lie within a hand's breadth of the one kept before: as few as can be
/// told apart in a world, so that what looks at all corners near a place looks at few. Rings of fewer than 2000
/// corners are left as they are.
PointsWorld without_crowded_corners(PointsWorld ring);

/// What lies within an odd number of an outer ring's windings and of no hole, as polygons whose rings do not cross:
/// of a bow tie its two halves. Corners where edges cross are rounded to steps of world::kHeightStep_m.
/// rings     outer one first, as sources have them
/// returns   nothing where they are sound as they are
/// cost      grows little faster than the number of corners
std::optional<std::vector<std::vector<PointsWorld>>> repaired_area(
    const std::vector<PointsWorld>& rings);

/// Of what repaired_area() would find, or of the rings where they are sound, m2.
double enclosed_m2(const std::vector<PointsWorld>& rings);

}  // namespace terracast::tiler
