#include "tiler/relief.h"

#include <cmath>

#include "tiler/flow_routing.h"

namespace terracast::tiler {
namespace {

/// Mean over 3 x 3, twice.
void smooth(Grid<float>& grid) {
  for (int pass = 0; pass < 2; ++pass) {
    const Grid<float> before = grid;
    for (int j = 0; j < grid.height; ++j)
      for (int i = 0; i < grid.width; ++i) {
        float sum = 0.0F;
        for (int dj = -1; dj <= 1; ++dj)
          for (int di = -1; di <= 1; ++di) sum += before.clamped(i + di, j + dj);
        grid(i, j) = sum / 9.0F;
      }
  }
}

}  // namespace

Relief analyse_relief(const Grid<float>& heights_m, const std::vector<std::uint8_t>& is_sea,
                      double spacing_m) {
  Relief relief;
  relief.spacing_m = spacing_m;
  relief.ruggedness = Grid<float>(heights_m.width, heights_m.height);
  relief.moisture = relief.ruggedness;

  std::vector<std::uint8_t> is_outlet = is_sea;
  for (int j = 0; j < heights_m.height; ++j)
    for (int i = 0; i < heights_m.width; ++i)
      if (i == 0 || j == 0 || i == heights_m.width - 1 || j == heights_m.height - 1)
        is_outlet[heights_m.index(i, j)] = 1;
  const FlowRouting flow = route_flow(heights_m, is_outlet);

  const double step_m = 2.0 * spacing_m;
  for (int j = 0; j < heights_m.height; ++j)
    for (int i = 0; i < heights_m.width; ++i) {
      const std::size_t cell = heights_m.index(i, j);
      const double dx =
          static_cast<double>(heights_m.clamped(i + 1, j) - heights_m.clamped(i - 1, j)) / step_m;
      const double dy =
          static_cast<double>(heights_m.clamped(i, j + 1) - heights_m.clamped(i, j - 1)) / step_m;
      const double slope = std::hypot(dx, dy);
      if (is_sea[cell] != 0) {
        relief.moisture.values[cell] = 255.0F;
        continue;
      }
      relief.ruggedness.values[cell] = static_cast<float>(slope);
      const double wetness =
          std::log(static_cast<double>(flow.area[cell]) * spacing_m / (slope + 0.005));
      // 4 is a sharp ridge, 15 the floor of a wide valley.
      relief.moisture.values[cell] =
          static_cast<float>(std::clamp((wetness - 4.0) / 11.0, 0.0, 1.0) * 255.0);
    }
  smooth(relief.ruggedness);
  smooth(relief.moisture);
  for (std::size_t cell = 0; cell < is_sea.size(); ++cell)
    if (is_sea[cell] != 0) relief.ruggedness.values[cell] = 0.0F;
  return relief;
}

}  // namespace terracast::tiler
