#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "tests/support/brute_terrain.h"
#include "tests/support/test_data.h"
#include "world/lod.h"
#include "world/tile_store.h"

namespace terracast::test {

/// Hills with a mast, a slab and a wood of prototypes on them, of which every triangle is known: the truth for distances. The
/// square is 1024 m wide; tiles are finer about its middle. Every tile holds all objects.
class SettledWorld {
 public:
  SettledWorld();

  static double ground_m(double x, double y);

  const world::TileStore& store() const { return store_; }
  const std::vector<world::CutTile>& cut() const { return cut_; }

  /// The mast stands here: a tenth of a metre thick, of the layer "masts".
  static constexpr double kMastX_m = 40.0, kMastY_m = 10.25, kMastHeight_m = 30.0;
  static constexpr double kMastWidth_m = 0.125;

  /// The distance from a point to the nearest of all triangles nearer than reach_m; else reach_m. One triangle after the
  /// other, by its plane and its sides.
  double brute_distance_m(const Eigen::Vector3d& point_world, double reach_m) const;

 private:
  using Triangle = std::array<Eigen::Vector3d, 3>;

  world::TileStore settle();

  ScratchFolder folder_;
  std::vector<Triangle> triangles_;  ///< of objects, world
  world::TileStore store_;
  std::vector<world::CutTile> cut_;
  BruteTerrain terrain_;
};

}  // namespace terracast::test
