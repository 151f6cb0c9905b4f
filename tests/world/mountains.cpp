#include "tests/world/mountains.h"

#include <cmath>

#include "core/random.h"

namespace terracast::test {

double value_noise(double x, double y, std::uint64_t octave) {
  const double fx = std::floor(x);
  const double fy = std::floor(y);
  const auto at = [&](int i, int j) {
    const auto index = static_cast<std::uint64_t>(static_cast<std::int64_t>(fx) + i) * 1000003U +
                       static_cast<std::uint64_t>(static_cast<std::int64_t>(fy) + j);
    return 2.0 * core::random_unit(7, octave, index) - 1.0;
  };
  const auto smooth = [](double t) { return t * t * (3.0 - 2.0 * t); };
  const double u = smooth(x - fx);
  const double v = smooth(y - fy);
  return (at(0, 0) * (1 - u) + at(1, 0) * u) * (1 - v) + (at(0, 1) * (1 - u) + at(1, 1) * u) * v;
}

double mountain_height_m(double x, double y) {
  double height = 1200.0;
  double amplitude = 350.0;
  double period = 1700.0;
  for (std::uint64_t octave = 0; octave < 9; ++octave) {
    const double noise = value_noise(x / period, y / period, octave);
    height += amplitude * (octave < 4 ? 1.0 - 2.0 * std::abs(noise) : noise);
    amplitude *= 0.47;
    period *= 0.5;
  }
  return height;
}

TinyWorldOptions mountain_options(int coarsest_level) {
  TinyWorldOptions options;
  options.finest_level = 0;
  options.coarsest_level = coarsest_level;
  options.refine = [](const world::TileId& id) {
    const Eigen::Vector2d center = id.center_world();
    return std::hypot(center.x() - 200.0, center.y() - 100.0) < 0.9 * id.side_m() + 100.0;
  };
  return options;
}

}  // namespace terracast::test
