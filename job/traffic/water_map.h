#pragma once

#include <Eigen/Core>
#include <unordered_map>
#include <vector>

#include "job/traffic/ships.h"
#include "world/tile_store.h"

namespace terracast::job {

/// The water of a world's finest tiles. Tiles are read when they are first looked at. Threads: one at a time.
class WaterMap {
 public:
  /// store   outlives the map
  explicit WaterMap(const world::TileStore& store);

  /// As all four samples around a place have it: water where all are, as deep as the shallowest. Nothing is water outside
  /// the world.
  /// throws   as TileStore::load()
  WaterAt at(const Eigen::Vector2d& at_world);

 private:
  struct Sheet {
    std::vector<world::Cover> cover;
    std::vector<std::int32_t> depth_steps;
  };
  /// The finest tile at a place.
  const world::TileInfo* tile_with(const Eigen::Vector2d& at_world) const;

  const world::TileStore& store_;
  int finest_ = 0;
  int coarsest_ = -1;
  std::unordered_map<world::TileId, Sheet> sheets_;
};

}  // namespace terracast::job
