#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "world/tile.h"
#include "world/tile_store.h"

namespace terracast::world_check {

/// Told of a fault: which kind, and of what, where.
using Report = std::function<void(std::string_view kind, const std::string& what)>;
/// Told how many things a kind of faults has been asked of.
using Asked = std::function<void(std::string_view kind, std::int64_t count)>;

/// How far a prototype of scale 1 reaches from its foot, and where it may stand.
struct PrototypeSize {
  double top_m = 0.0;        ///< upward
  double side_m = 0.0;       ///< in the plane
  bool is_seagrass = false;  ///< it grows below water and nowhere else
  bool is_stone = false;     ///< all of it, and there is some: it may lie on land and below water
};
PrototypeSize size_of(const world::Prototype& prototype);

/// How things of a tile stand on its ground, below water on its bed.
/// tile        with Tile::water_depth_steps
/// sizes       of the world's prototypes
/// is_judged   whether this is the finest tile that holds a place: things are judged there alone
void check_ground(const world::Tile& tile, const world::WorldManifest& manifest,
                  const std::vector<PrototypeSize>& sizes,
                  const std::function<bool(double x_world, double y_world)>& is_judged,
                  const Report& report, const Asked& asked);

}  // namespace terracast::world_check
