#pragma once

#include <Eigen/Core>
#include <algorithm>

#include "tiler/gradient_noise.h"

namespace terracast::tiler {

/// 0 … 1, symmetrical about 0.5, smooth over about `period_m`.
/// which   of the noises of one period
inline double patches(const GradientNoise& noise, const Eigen::Vector2d& place_world,
                      double period_m, int which) {
  const double value = fractal_noise(noise, place_world.x() / period_m + 91.7 * which,
                                     place_world.y() / period_m - 53.1 * which, 3);
  return std::clamp(0.5 + 0.75 * value, 0.0, 1.0);
}

/// 0 up to `from`, 1 beyond `to`, smooth between.
inline double step_up(double value, double from, double to) {
  const double t = std::clamp((value - from) / (to - from), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

}  // namespace terracast::tiler
