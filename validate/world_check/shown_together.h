#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <tuple>
#include <vector>

#include "world/tile.h"

namespace terracast::world_check {

/// Shapes of two solids that may be shown in one image and have faces in one plane there.
struct CoincidentShapes {
  std::uint32_t first_id = 0, second_id = 0;  ///< of the instances, the lower one first
  int first_level = 0, second_level = 0;      ///< coarsest levels of the shapes
  double area_m2 = 0.0;
  Eigen::Vector3d place_world = Eigen::Vector3d::Zero();  ///< one such place

  /// The same for any tile in which both shapes are found.
  auto shapes() const { return std::tuple(first_id, second_id, first_level, second_level); }
};

struct ShownTogether {
  std::int64_t num_shapes = 0;  ///< that may be shown beside the tile's
  std::vector<CoincidentShapes> coincident;
};

/// Whether two tiles may be in one cut of a world: neither lies in the other, and neighbours along an edge differ by one
/// level at most, which leaves two at a corner; also of what the quadtree brings with them, the tiles beside the finer
/// one. More than two levels apart is none of what a tile's neighbourhood has.
bool may_be_in_one_cut(const world::TileId& one, const world::TileId& other);

/// Of all that a tile holds what has faces in one plane, as any cut with this tile shows it: each solid by the level of the
/// tile of the cut that holds its place, which is this tile or another, up to two levels finer or coarser. So pairs count
/// that only show where levels meet, and what stands in one tile and reaches over tiles that are not there.
/// has_tile   whether the world has a tile
ShownTogether coincident_shapes(const world::Tile& tile,
                                const std::function<bool(const world::TileId&)>& has_tile);

}  // namespace terracast::world_check
