#pragma once

#include <cstdint>
#include <vector>

#include "tiler/grid.h"

namespace terracast::tiler {

/// What of a raster of heights is a building.
struct BlockRules {
  double least_height_m = 2.5;   ///< cells that stand so far above the ground and more
  std::int64_t least_cells = 4;  ///< of a block, and of a piece of one
  /// Heights of the cells of a piece lie within so much of each other.
  double height_class_m = 4.0;
};

/// A part of a block, about as high everywhere.
struct BlockPiece {
  int first_column = 0;  ///< of its first cell, by rows
  int first_row = 0;
  std::int64_t num_cells = 0;
  double median_m = 0.0;  ///< of its cells, without those between it and what lies beside it
  double spread_m = 0.0;  ///< from the tenth to the ninetieth hundredth of these
};

/// The buildings of a raster: blocks are cells of which each shares a side with another; a block is
/// cut into pieces.
struct RasterBlocks {
  Grid<std::int32_t> piece;        ///< of each cell: 0 is none, else counts `pieces` from 1
  std::vector<BlockPiece> pieces;  ///< by their first cells, row by row
  std::int64_t num_cells = 0;      ///< as high as a building is
  std::int64_t num_blocks = 0;
  std::int64_t num_specks = 0;  ///< left out: smaller blocks
  std::int64_t num_speck_cells = 0;
};

/// Pieces are grown from the least step between neighbours on, as long as no two cells of a piece
/// differ by more than the class (Soille 2008, constrained connectivity). What is smaller than a
/// piece may be, or nowhere two cells wide, as the cells half on a wall are, goes to the pieces
/// beside it, cell by cell to the one nearest in height; a block without a piece is one.
/// heights_m   above the ground; NaN: unknown
/// cost        about 0.3 us a cell as high as a building, one thread
RasterBlocks find_blocks(const Grid<float>& heights_m, const BlockRules& rules);

}  // namespace terracast::tiler
