#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "world/tile.h"
#include "world/tile_store.h"

namespace terracast::world_check {

/// Told of a fault: which kind, and of what, where.
using Report = std::function<void(std::string_view kind, const std::string& what)>;
/// Told how many things a kind of faults has been asked of.
using Asked = std::function<void(std::string_view kind, std::int64_t count)>;

/// How things of a tile stand on its ground. A place is judged in the finest tile that holds it.
/// is_judged   whether a place's finest tile is this one
void check_ground(const world::Tile& tile, const world::WorldManifest& manifest,
                  const std::function<bool(double x_world, double y_world)>& is_judged,
                  const Report& report, const Asked& asked);

}  // namespace terracast::world_check
