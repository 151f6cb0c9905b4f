#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "world/lod.h"
#include "world/ray_lanes.h"
#include "world/ray_trail.h"

namespace terracast::world {

/// The tiles of a cut in the plane, and how rays pass from one to the next, in double.
///
/// A side is crossed at (side - origin) / direction, from world coordinates alone, so that the exit
/// from a tile is the entry into the next one to the last bit: no ray is lost between tiles and
/// none is in two. Threads: safe.
class TileMap {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffU;
  /// A tile of the cut.
  struct Leaf {
    std::array<double, 2> x, y;  ///< western and eastern, southern and northern side
    double highest_z_world;
    /// The tiles beyond the sides west, east, south, north: beyond the southern (western) half of
    /// the side, then the other half.
    std::array<std::uint32_t, 8> beyond;
  };

  /// throws Input: the store lacks a tile, the cut is empty, names a tile twice, has a hole within
  /// one of its coarsest tiles or is not balanced
  /// is_turned     of the world upside down: a tile's lowest point, at -z, is its highest
  TileMap(const TileStore& store, const std::vector<CutTile>& cut, bool is_turned = false);

  /// Puts rays into the first tile in which they may meet the ground (they are not above the tile's
  /// highest point all the way).
  /// hint      a tile to look at first; becomes that of the last ray that starts elsewhere
  /// trail     takes the tiles over which rays pass on the way; null: none wants to know
  /// returns   the rays of `asked` for which there is one in [t_min, t_max]
  LaneMask enter(RayLanes& rays, LaneMask asked, std::uint32_t& hint, RayTrail* trail) const;
  /// Puts rays that have passed through their tile into the next such one.
  LaneMask go_on(RayLanes& rays, LaneMask asked, RayTrail* trail) const;

  /// The tile that holds a place; on a border the one north-east of it if there is one.
  std::optional<std::uint32_t> tile_at_place(double x_world, double y_world) const;

 private:
  struct Node {
    double x_middle, y_middle;
    std::array<std::int32_t, 4> children;  ///< node; -1 none; -2 - leaf
  };
  struct Root {
    double x0, x1, y0, y1;
    std::int32_t node;
  };

  void add_leaf(std::uint32_t leaf, const TileId& id);
  void find_neighbours(const std::vector<CutTile>& cut);
  std::int32_t root_at(double x_world, double y_world) const;
  std::uint32_t leaf_at(double x_world, double y_world) const;
  std::uint32_t leaf_on_ray(std::int32_t node, const RayLanes& rays, int lane, double t) const;
  /// Puts a ray into the nearest root that it enters at t or later.
  /// is_start   it has not been in any tile yet
  bool enter_root(RayLanes& rays, int lane, double t, bool is_start) const;
  /// The height above which rays are not followed.
  double above_all_z(const RayTrail* trail) const;
  /// Completes the passages of rays whose tile and entry are known, going on from tile to tile until
  /// the ground may be met.
  /// passed   those that have passed through the tile where they are
  LaneMask go_to_ground(RayLanes& rays, LaneMask asked, LaneMask passed, RayTrail* trail) const;

  int root_level_ = 0;
  double root_side_m_ = 0.0;
  std::int32_t root_x0_ = 0;  ///< address of the south-western cell of the grid of roots
  std::int32_t root_y0_ = 0;
  std::int32_t num_roots_x_ = 0;
  std::int32_t num_roots_y_ = 0;
  std::vector<std::int32_t> root_grid_;  ///< node of each cell; -1 none
  std::vector<Root> roots_;
  bool is_rectangle_ = false;  ///< a ray that has left the tiles does not come back
  double highest_z_world_ = 0.0;
  std::vector<Node> nodes_;
  std::vector<Leaf> leaves_;
};

}  // namespace terracast::world
