#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

namespace terracast::tiler {

/// Walls along the sides of cells, which run in steps.
///
/// A path of sides is cut into stretches that straight lines follow, by least squares through the
/// middles of the sides; what the cuts cost is the sum of their squared distances, and a price for
/// each cut (after Selinger 2003, who finds the fewest): it is minimal. Corners are where
/// neighbouring lines meet, not more than 1.5 cells from the cut. A ring whose walls would go round
/// a tenth more or less than its cells has cheaper cuts, at last one at each turn.
///
/// path       corners of cells, each a side from the one before; a ring's first one is not repeated
/// is_ring    from the last one back to the first
/// farthest   of a side's middle from its line, in cells; 0.5 at least: a slanted wall's own steps
///            reach so far
/// returns    for each point of the path, where it stands as a corner; nothing where the wall runs
///            straight past it. The ends of a path that is no ring stay where they are
/// cost       grows with the path's length
std::vector<std::optional<Eigen::Vector2d>> straightened(std::span<const Eigen::Vector2i> path,
                                                         bool is_ring, double farthest);

}  // namespace terracast::tiler
