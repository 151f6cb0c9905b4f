#include "tiler/erosion.h"

#include <cmath>
#include <utility>

#include "core/parallel.h"
#include "tiler/flow_routing.h"

namespace terracast::tiler {
namespace {

/// A^0.45 = sqrt(A) / A^0.05; only correctly rounded operations, so that it is the same everywhere.
float area_power(float area_m2) {
  // A^0.4375 = A^(7/16) by square roots: 1/2 of 7/8.
  const float half = std::sqrt(area_m2);
  const float sixteenth = std::sqrt(std::sqrt(std::sqrt(half)));
  return half / sixteenth;
}

void incise(Grid<float>& heights_m, const ErosionInputs& inputs, const ErosionOptions& options) {
  const FlowRouting flow = route_flow(heights_m, inputs.is_sea);
  const auto spacing_m = static_cast<float>(inputs.spacing_m);
  const auto power = static_cast<float>(options.stream_power);
  for (const std::int32_t cell_index : flow.order) {
    const auto cell = static_cast<std::size_t>(cell_index);
    if (inputs.is_sea[cell] != 0) continue;
    const std::int32_t receiver_index = flow.receiver[cell];
    const auto receiver = static_cast<std::size_t>(receiver_index);
    const int shift = std::abs(cell_index - receiver_index);
    const bool is_diagonal = shift != 1 && shift != heights_m.width;
    const float distance_m = is_diagonal ? spacing_m * 1.41421356F : spacing_m;
    const float factor = power * inputs.erodibility.values[cell] *
                         area_power(flow.area[cell] * spacing_m * spacing_m) / distance_m;
    const float below_m = std::max(heights_m.values[receiver], 0.0F);
    // Sediment fills hollows to their spill before the rivers cut.
    const float start_m = flow.filled_m.values[cell] + inputs.uplift_m.values[cell];
    heights_m.values[cell] = (start_m + factor * below_m) / (1.0F + factor);
  }
}

/// One pass of slides (a tenth of what is too steep moves between neighbours) and creep; stable
/// while creep stays below 0.15.
void relax_slopes(Grid<float>& heights_m, const ErosionInputs& inputs,
                  const ErosionOptions& options) {
  const Grid<float> before = heights_m;
  const float limit_m = static_cast<float>(options.talus_slope * inputs.spacing_m);
  const auto creep = static_cast<float>(options.creep);
  core::parallel_for(heights_m.height, [&](std::int64_t row) {
    const int j = static_cast<int>(row);
    for (int i = 0; i < before.width; ++i) {
      if (inputs.is_sea[before.index(i, j)] != 0) continue;
      const float here_m = before(i, j);
      float change_m = 0.0F;
      for (const auto& [di, dj] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
        if (!before.contains(i + di, j + dj)) continue;
        const float rise_m = before(i + di, j + dj) - here_m;
        change_m += creep * rise_m;
        if (rise_m > limit_m) change_m += 0.1F * (rise_m - limit_m);
        if (rise_m < -limit_m) change_m += 0.1F * (rise_m + limit_m);
      }
      heights_m(i, j) = here_m + change_m;
    }
  });
}

}  // namespace

Grid<float> erode(const ErosionInputs& inputs, const ErosionOptions& options) {
  Grid<float> heights_m = inputs.heights_m;
  for (int step = 0; step < options.num_steps; ++step) {
    incise(heights_m, inputs, options);
    for (int pass = 0; pass < 5; ++pass) relax_slopes(heights_m, inputs, options);
  }
  return heights_m;
}

Grid<float> refined(const Grid<float>& grid) {
  Grid<float> fine(2 * grid.width - 1, 2 * grid.height - 1);
  for (int j = 0; j < fine.height; ++j)
    for (int i = 0; i < fine.width; ++i) {
      const int i0 = i / 2;
      const int j0 = j / 2;
      const int i1 = (i + 1) / 2;
      const int j1 = (j + 1) / 2;
      fine(i, j) = 0.25F * (grid(i0, j0) + grid(i1, j0) + grid(i0, j1) + grid(i1, j1));
    }
  return fine;
}

}  // namespace terracast::tiler
