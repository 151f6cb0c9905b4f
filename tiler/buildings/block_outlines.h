#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "tiler/grid.h"

namespace terracast::tiler {

/// The outline of a piece: its outer ring first, then its holes; in cells, (0, 0) the outer corner
/// of the first cell.
using CellRings = std::vector<std::vector<Eigen::Vector2d>>;

/// Outlines of pieces along straight walls: of each piece of a grid one, by its number. Walls round
/// blocks are drawn first, then those between their pieces, which end on them; two pieces have the
/// wall between them in common, corner by corner.
/// piece      0: none; numbers from 1 on, each of cells that share sides
/// farthest   see straightened()
/// throws     Internal: GDAL cannot
std::vector<CellRings> outlines_of(const Grid<std::int32_t>& piece, std::int32_t num_pieces,
                                   double farthest);

}  // namespace terracast::tiler
