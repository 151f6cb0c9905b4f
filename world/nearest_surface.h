#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "geo/geodesy.h"
#include "world/prototype_library.h"
#include "world/tile_map.h"
#include "world/tile_store.h"

namespace terracast::world {

/// The nearest point to a place on the surfaces of a cut.
struct NearestSurface {
  double distance_m = 0.0;
  Eigen::Vector3d place_world = Eigen::Vector3d::Zero();
  /// The object that it belongs to; nullopt: the ground, or water.
  std::optional<Provenance> object = std::nullopt;
  Cover cover = Cover::Land;  ///< of the ground's nearest sample
};

/// The triangle's point that is nearest to a point, all in one frame.
Eigen::Vector3d nearest_on_triangle(const Eigen::Vector3d& point,
                                    const std::array<Eigen::Vector3d, 3>& corners);

/// Computes distances from points to the triangles of a cut: ground, surfaces of water, and objects as the cut shows them.
/// Bodies that move are not among them. Queried tiles stay in memory while they are within 500 m of the later queries'
/// reach.
///
/// accuracy   1e-9 m; 1e-6 m where the triangle is nearly a line
/// cost       tens of microseconds a point near a few hundred triangles; a tile is read once as long as points stay near
/// threads    one at a time
class SurfaceFinder {
 public:
  /// The store must outlive it.
  /// throws   as TileMap and PrototypeLibrary
  SurfaceFinder(const TileStore& store, std::vector<CutTile> cut);
  ~SurfaceFinder();

  /// The nearest surface; nullopt: none is nearer than reach_m.
  /// throws   Input: a damaged tile; Io
  std::optional<NearestSurface> find(const Eigen::Vector3d& point_world, double reach_m);

  /// The height of a point above the ground or water along z; nullopt where there is no tile.
  /// throws   as find()
  std::optional<double> height_above_ground_m(const Eigen::Vector3d& point_world);

 private:
  struct LoadedTile;
  class Search;

  /// Makes near_ hold all tiles within a reach, and drops loaded tiles that are farther.
  void look_around(const Eigen::Vector3d& point_world, double reach_m);
  const LoadedTile& loaded(std::uint32_t tile);

  const TileStore& store_;
  std::vector<CutTile> cut_;
  TileMap map_;
  geo::WorldFrame frame_;
  PrototypeLibrary prototypes_;
  std::vector<std::uint32_t> near_;  ///< tiles within near_reach_m_ of near_place_
  Eigen::Vector3d near_place_ = Eigen::Vector3d::Zero();
  double near_reach_m_ = -1.0;
  std::map<std::uint32_t, std::unique_ptr<const LoadedTile>> loaded_;
};

}  // namespace terracast::world
