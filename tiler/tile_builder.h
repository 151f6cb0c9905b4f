#pragma once

#include "tiler/surface.h"
#include "world/tile.h"

namespace terracast::tiler {

/// One tile of the surface: heights rounded to the world's lattice of kHeightStep_m, centre at a
/// whole metre.
/// throws   Internal: more relief than a tile can hold (over 16 km)
world::Tile build_tile(const WorldSurface& surface, const world::TileId& id);

}  // namespace terracast::tiler
