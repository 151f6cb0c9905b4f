#pragma once

#include <Eigen/Core>
#include <functional>

#include "world/tile.h"

namespace terracast::tiler {

/// Ends what is painted on a tile's ground where the tile shows water: that has shores of its own on each level.
///
/// Strips: their middle line is cut where all four samples round a place are water, and marks go on behind as if
/// it were whole. The pieces are the same from any tile of the level.
/// Areas that reach over water of the tile's square: what is left is their land within that square, where of the
/// weights of a triangle's corners no more than half is of water; so edges run within a quarter of a sample's
/// spacing of what is shown as shore. Other areas are left whole. Piers and quays stand in water, and are left.
///
/// tile        its samples, and all that is painted on it but for streams: Paving::Water
/// cover_at    of the finished ground at samples of the tile's level beyond its square
/// cost        little where the tile has no water; else some 10 us for each sample along shores that are painted
/// threads     safe
void end_paint_at_water(
    world::Tile& tile,
    const std::function<world::Cover(const Eigen::Vector2d& place_world)>& cover_at);

}  // namespace terracast::tiler
