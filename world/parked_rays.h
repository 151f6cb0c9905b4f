#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "world/ray_lanes.h"
#include "world/unit_turns.h"

namespace terracast::world {

/// Rays that wait for tiles that are not loaded, by tile.
class ParkedRays {
 public:
  /// Rays whose passages are through one tile, the one that is not loaded.
  void park(const RayLanes& rays, LaneMask lanes);

  bool is_empty() const { return waiting_.empty(); }
  /// The tiles for which rays wait, sorted by the shortest distance at which a parked ray enters each:
  /// rays that pass through a near tile on their way to others gather there first.
  /// first_index   added to the tiles' numbers
  void list(std::size_t first_index, std::vector<TileDemand>& demands);

  /// Takes the rays that wait for a tile.
  /// returns   groups of them, all lanes of all but the last
  struct Groups {
    std::vector<RayLanes> rays;
    LaneMask last_lanes = 0;
  };
  Groups take(std::uint32_t tile);

 private:
  struct Waiting {
    std::uint32_t tile;
    double nearest_m;       ///< shortest way of a ray to the tile
    std::size_t count = 0;  ///< of rays; they fill the groups one after the other
    std::vector<RayLanes> groups = {};
  };
  std::vector<Waiting> waiting_;
};

}  // namespace terracast::world
