#pragma once

#include <cstddef>
#include <vector>

#include "tiler/grid.h"

namespace terracast::tiler {

/// Cells of a grid from first to before end.
struct CellBox {
  int first_column = 0;
  int first_row = 0;
  int end_column = 0;
  int end_row = 0;

  bool operator==(const CellBox&) const = default;
};

/// No box is wider or higher, in cells: straight lines between corners keep to the cells' sides
/// whatever the projection is.
inline constexpr int kMostBoxCells = 64;

/// Boxes over the cells whose height is known, each of them in one box: over all of them, unless
/// that takes more boxes than `most`. Then cells are taken in squares of 2 by 2, 4 by 4, … of
/// which every cell is known, so that no box ever holds one that is not; squares end at a box's
/// width, and where even those are more than `most`, there is none.
/// heights   NaN: unknown
/// cost      some 10 ns a cell, one thread
std::vector<CellBox> boxes_of_known(const Grid<float>& heights, std::size_t most);

}  // namespace terracast::tiler
