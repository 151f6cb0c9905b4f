#include "world/tile.h"

#include <algorithm>

namespace terracast::world {

double Tile::lowest_z_world() const {
  return center_z_m + *std::min_element(height_steps.begin(), height_steps.end()) * kHeightStep_m;
}

double Tile::highest_z_world() const {
  const std::int32_t ground_steps = *std::max_element(height_steps.begin(), height_steps.end());
  return center_z_m + std::max(ground_steps, objects_top_steps) * kHeightStep_m;
}

}  // namespace terracast::world
