#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "world/tile_store.h"

namespace terracast::test {

/// How many things reach over a border into a neighbouring tile, by the kind of their layer: "buildings solids",
/// "vegetation instances", "roads strips".
using Crossings = std::map<std::string, std::int64_t>;

/// Looks at all tiles of a world, by what their objects' own vertices say: each object is in a tile once, whatever
/// reaches into a neighbour of the same level is there, too, and is the same to the last bit, and no id names two
/// objects. Whatever does not hold fails the test.
Crossings expect_whole_over_borders(const world::TileStore& store);

}  // namespace terracast::test
