#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "world/lod.h"
#include "world/terrain_walk.h"

namespace terracast::world {

/// A ray's way through one tile of a cut.
struct TilePassage {
  std::uint32_t tile = 0;  ///< index into the cut
  int side =
      -1;  ///< through which it comes in: 0 west, 1 east, 2 south, 3 north; -1: it starts inside
  double t_entry = 0.0;
  double t_exit = 0.0;
  /// Where it passes the height of the tile's highest point: a falling ray can meet the ground only
  /// later, a rising one only earlier; +inf for a level ray.
  double t_top = 0.0;
  double t_exit_x = 0.0;  ///< through the western or eastern side; +inf: never
  double t_exit_y = 0.0;
};

/// The tiles of a cut in the plane, and how rays pass from one to the next, in double.
///
/// A side is crossed at (side - origin) / direction, from world coordinates alone, so that the exit
/// from a tile is the entry into the next one to the last bit: no ray is lost between tiles and
/// none is in two. Threads: safe.
class TileMap {
 public:
  /// throws Input: the store lacks a tile, the cut is empty, names a tile twice or is not balanced
  TileMap(const TileStore& store, const std::vector<CutTile>& cut);

  /// The first tile on a ray in which it may meet the ground (it is not above the tile's highest
  /// point all the way).
  /// hint      a tile to look at first; becomes the one where the ray starts
  /// returns   false: none in [t_min, t_max]
  bool first_passage(const WalkRay& ray, double t_min, double t_max, std::uint32_t& hint,
                     TilePassage& passage) const;
  /// The next such tile after `passage`.
  bool next_passage(const WalkRay& ray, double t_max, TilePassage& passage) const;

  /// The tile that holds a place; on a border the one north-east of it if there is one.
  std::optional<std::uint32_t> tile_at_place(double x_world, double y_world) const;

 private:
  static constexpr std::uint32_t kNone = 0xffffffffU;
  struct Leaf {
    std::array<double, 2> x, y;  ///< western and eastern, southern and northern side
    double highest_z_world;
    /// The tiles beyond the sides west, east, south, north: of the southern (western) half, of the
    /// other half.
    std::array<std::array<std::uint32_t, 2>, 4> beyond;
  };
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
  std::uint32_t leaf_on_ray(std::int32_t node, const WalkRay& ray, double t) const;
  /// The nearest root that the ray enters at t or later.
  bool enter_root(const WalkRay& ray, double t, double t_max, TilePassage& passage) const;
  /// Completes a passage whose tile and entry are known; goes on from tile to tile until the ground
  /// may be met.
  bool go_to_ground(const WalkRay& ray, double t_max, TilePassage& passage) const;
  bool step(const WalkRay& ray, double t_max, TilePassage& passage) const;

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
