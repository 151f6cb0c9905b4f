#pragma once

#include <cstdint>

#include "tiler/grid.h"

namespace terracast::tiler {

/// Land that rises and is worn down by rivers and slides.
struct ErosionInputs {
  Grid<float> heights_m;             ///< at the start
  Grid<float> uplift_m;              ///< a step
  Grid<float> erodibility;           ///< 1: as it is
  std::vector<std::uint8_t> is_sea;  ///< keeps its height; rivers end there
  double spacing_m = 0.0;
};

struct ErosionOptions {
  int num_steps = 30;
  /// K dt of the stream power law dh/dt = U - K A^m S, for areas in m2 and m = 0.45.
  double stream_power = 3.0;
  /// Steepest slope that stands, rise over run; steeper ground slides down to it.
  double talus_slope = 0.75;
  /// D dt / dx2 of the creep of slopes, at the grid's spacing.
  double creep = 0.05;
};

/// Stream-power erosion by the implicit scheme of Braun and Willett (2013), hollows filled with
/// sediment, then slides and creep, for each step. The same result on every machine.
/// returns   heights after the last step
/// cost      about 0.6 us a cell and step
Grid<float> erode(const ErosionInputs& inputs, const ErosionOptions& options);

/// Twice the samples: bilinear midpoints between them; (2 w - 1) x (2 h - 1).
Grid<float> refined(const Grid<float>& grid);

}  // namespace terracast::tiler
