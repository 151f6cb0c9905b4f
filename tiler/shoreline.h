#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "tiler/grid.h"

namespace terracast::tiler {

/// The coast of a raster that holds the sea as samples of one value: a smooth line between its samples of
/// land and those of sea, in place of the sides of its cells.
///
/// Each sample has a side: 1 inland, -1 at sea, and between them near the coast. It is the raster's own
/// land and sea, smoothed, but never across 0: the coast passes between samples of land and of sea, and
/// no islet or channel is lost. The surface is the product of two splines, of the sides and of heights over
/// sides, but no higher than the land about and no lower than the sea's floor about: it passes through all
/// samples, its zero is the zero of the sides, and away from the coast it is the spline through the heights.
/// Towards measured floors it passes into the spline through the heights.
class Shoreline {
 public:
  /// Without a coast.
  Shoreline() = default;
  /// is_shelf   sea whose floor no raster knows. The coast of a measured floor is the contour of 0 of the
  ///            measured heights, which stay as they are.
  Shoreline(const Grid<std::uint8_t>& is_sea, const Grid<std::uint8_t>& is_shelf);

  /// The surface at grid coordinates.
  /// heights_m   above the sea; those of shelves are negative
  double height_m(const Grid<double>& heights_m, const Eigen::Vector2d& at) const;

 private:
  Grid<float> side_;              ///< empty: no coast
  Grid<std::uint8_t> has_floor_;  ///< whether a measured floor is near a sample
};

}  // namespace terracast::tiler
