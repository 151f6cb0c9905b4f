#pragma once

#include "tiler/grid.h"

namespace terracast::tiler {

/// What the shape of the land says, on one grid over the whole square.
struct Relief {
  double spacing_m = 0.0;
  Grid<float> ruggedness;  ///< smoothed slope, rise over run; 0 at sea
  Grid<float> moisture;    ///< 0 dry ridge … 255 wet valley floor
};

/// Slopes, and the topographic wetness index ln(a / tan slope) of Beven and Kirkby (1979) from
/// routed flow, a being the area that drains through a metre of contour.
/// heights_m   of the measured surface
/// is_sea      as many as heights
Relief analyse_relief(const Grid<float>& heights_m, const std::vector<std::uint8_t>& is_sea,
                      double spacing_m);

}  // namespace terracast::tiler
