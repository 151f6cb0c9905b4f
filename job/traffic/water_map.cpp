#include "job/traffic/water_map.h"

#include <algorithm>
#include <limits>

namespace terracast::job {

using Eigen::Vector2d;

WaterMap::WaterMap(const world::TileStore& store) : store_(store) {
  finest_ = std::numeric_limits<int>::max();
  for (const world::TileInfo& tile : store.manifest().tiles) {
    finest_ = std::min(finest_, static_cast<int>(tile.id.level));
    coarsest_ = std::max(coarsest_, static_cast<int>(tile.id.level));
  }
}

const world::TileInfo* WaterMap::tile_with(const Vector2d& at_world) const {
  for (int level = finest_; level <= coarsest_; ++level)
    if (const world::TileInfo* tile =
            store_.find(world::tile_at(level, at_world.x(), at_world.y())))
      return tile;
  return nullptr;
}

WaterAt WaterMap::at(const Vector2d& at_world) {
  const world::TileInfo* info = tile_with(at_world);
  if (info == nullptr) return {};
  const auto [found, is_new] = sheets_.try_emplace(info->id);
  Sheet& sheet = found->second;
  if (is_new) {
    world::Tile tile = store_.load(info->id, world::WaterDepth::Read);
    sheet = {std::move(tile.cover), std::move(tile.water_depth_steps)};
  }
  if (sheet.depth_steps.empty()) return {};
  const Vector2d in_cells = (at_world - info->id.corner_world()) / info->id.spacing_m();
  const auto cell = [](double along) {
    return std::clamp(static_cast<int>(along), 0, world::kTileCells - 1);
  };
  WaterAt water{.is_water = true, .is_sea = true, .depth_m = 1e9};
  for (const int j : {0, 1})
    for (const int i : {0, 1}) {
      const std::size_t sample =
          world::Tile::sample(cell(in_cells.x()) + i, cell(in_cells.y()) + j);
      water.is_water = water.is_water && world::is_water(sheet.cover[sample]);
      water.is_sea = water.is_sea && sheet.cover[sample] == world::Cover::Sea;
      water.depth_m = std::min(water.depth_m, sheet.depth_steps[sample] * world::kHeightStep_m);
    }
  return water.is_water ? water : WaterAt{};
}

}  // namespace terracast::job
