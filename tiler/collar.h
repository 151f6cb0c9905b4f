#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "tiler/grid.h"

namespace terracast::tiler {

/// Samples of one exact value beside a raster's data, undeclared: what a raster that was turned or
/// cut to a shape is filled up with.
struct Collar {
  double height_m = 0.0;
  std::int64_t num_samples = 0;
};

/// Finds a raster's collar and makes it NaN. A collar
///  - holds the same value to the bit as a corner of the raster, and hangs together with the
///    window's border;
///  - has at least 64 samples and 0.2 % of the window's;
///  - ends in a cliff: 95 of 100 samples beside it differ from it by more than 25 m. Seas and lakes,
///    of one exact value too, have shores;
///  - or else leaves ground of a turned rectangle: regions of the value at three corners of the
///    window or more, and what is left fills its convex hull to 98 %, which no island does.
/// heights_m          a window of the raster
/// corner_heights_m   the raster's own corners
std::optional<Collar> remove_collar(Grid<double>& heights_m,
                                    std::span<const double> corner_heights_m);

}  // namespace terracast::tiler
