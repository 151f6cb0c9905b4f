#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "world/tile.h"

namespace terracast::world {

/// A place on one of the two triangles of a tile's cell, which the diagonal from (x+1, y) to (x, y+1) parts: what
/// samples say of it.
struct TrianglePlace {
  struct Corner {
    int i;  ///< column and row of the tile's sample
    int j;
    std::size_t sample() const { return Tile::sample(i, j); }
  };
  /// That at the right angle, the one along x from it, the one along y.
  std::array<Corner, 3> corners;
  std::array<double, 3> weights;  ///< of each for what is linear on the triangle; 1 together

  /// The one with the largest weight, of several the first: what is not linear, such as its cover, is its sample's.
  const Corner& nearest() const {
    return corners[static_cast<std::size_t>(std::max_element(weights.begin(), weights.end()) -
                                            weights.begin())];
  }
};

/// i, j       the cell: column and row of its south-western sample
/// is_upper   of the triangle north-east of the diagonal
/// fx, fy     from that sample eastward and northward, in spacings; 0 … 1
inline TrianglePlace place_on_triangle(int i, int j, bool is_upper, double fx, double fy) {
  const int far = is_upper ? 1 : 0;
  const int near = 1 - far;
  const double along_x = is_upper ? 1.0 - fx : fx;
  const double along_y = is_upper ? 1.0 - fy : fy;
  return {.corners = {{{i + far, j + far}, {i + near, j + far}, {i + far, j + near}}},
          .weights = {1.0 - along_x - along_y, along_x, along_y}};
}

}  // namespace terracast::world
