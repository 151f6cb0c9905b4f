#pragma once

#include <cmath>

#include "tiler/vegetation/plant.h"

namespace terracast::tiler {

/// Pieces of a field are squares of this side; rows run along x, on through the next piece.
inline constexpr double kCropPiece_m = 4.0;

/// How deep crops reach below their foot: pieces are level, fields not quite.
inline constexpr double kCropSunk_m = 0.35;

/// Calls plant(foot) for each place of a piece of a field: rows `row_m` apart, places `step_m` apart in
/// them, somewhat uneven; the piece's side is a multiple of both, or nearly.
template <class PlantOne>
void for_each_in_rows(double row_m, double step_m, Draws& draws, PlantOne&& plant) {
  const int num_rows = static_cast<int>(std::lround(kCropPiece_m / row_m));
  const int num_steps = static_cast<int>(std::lround(kCropPiece_m / step_m));
  for (int j = 0; j < num_rows; ++j)
    for (int i = 0; i < num_steps; ++i)
      plant(Eigen::Vector3d(
          (i + 0.5) * kCropPiece_m / num_steps - 0.5 * kCropPiece_m +
              draws.about(0.0, 0.25 * step_m),
          (j + 0.5) * kCropPiece_m / num_rows - 0.5 * kCropPiece_m + draws.about(0.0, 0.06 * row_m),
          -kCropSunk_m));
}

}  // namespace terracast::tiler
