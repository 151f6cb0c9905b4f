#pragma once

#include "tests/support/tiny_world.h"

namespace terracast::test {

/// Smooth noise of period 1 in [-1, 1].
double value_noise(double x, double y, std::uint64_t octave);

/// Sharp ridges, slopes up to 60 degrees, detail down to 3 m.
double mountain_height_m(double x, double y);

/// A world of four levels at least, fine near (200, 100) m.
TinyWorldOptions mountain_options(int coarsest_level);

}  // namespace terracast::test
