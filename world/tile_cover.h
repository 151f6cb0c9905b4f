#pragma once

#include <vector>

#include "world/tile_store.h"

namespace terracast::world {

/// Reads Tile::cover of a store's tile alone, for a fraction of TileStore::load()'s time.
/// throws   as TileStore::load(), for what it reads
std::vector<Cover> load_cover(const TileStore& store, const TileId& id);

}  // namespace terracast::world
