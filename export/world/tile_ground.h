#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "world/paint_index.h"
#include "world/ray_query.h"
#include "world/tile.h"

namespace terracast::world_export {

/// The ground of one tile as rays meet it: stitched triangles, and what covers them and is painted on them.
/// Immutable; threads: safe.
class TileGround {
 public:
  TileGround(world::Tile tile, std::uint8_t coarser_sides);

  /// Without its strips and areas: is_painted() and find_paint() tell of them.
  const world::Tile& tile() const { return tile_; }
  bool is_painted() const { return !paint_.is_empty(); }  ///< anywhere

  /// Of a sample, 0 … kTileCells.
  Eigen::Vector3d vertex_world(int i, int j) const {
    const Eigen::Vector2d corner = tile_.id.corner_world();
    const double spacing_m = tile_.id.spacing_m();
    return {corner.x() + i * spacing_m, corner.y() + j * spacing_m,
            tile_.center_z_m + above_center_m(i, j)};
  }
  world::Cover cover(int i, int j) const { return tile_.cover[world::Tile::sample(i, j)]; }

  struct Place {
    Eigen::Vector3d point_world;
    Eigen::Vector3d normal_world;  ///< unit, of the triangle
    world::SurfaceSample surface;  ///< what is of the ground
  };
  /// The ground at world x, y; beyond the tile's square that of the nearest place within.
  Place at(double x_world, double y_world) const;
  /// World z alone: exact in double on the triangles.
  double z_world(double x_world, double y_world) const;
  /// What is painted there.
  void find_paint(double x_world, double y_world, world::PaintSample& paint) const;

 private:
  double above_center_m(int i, int j) const {
    return half_steps_[world::Tile::sample(i, j)] * (0.5 * world::kHeightStep_m);
  }
  struct OnTriangle;
  OnTriangle triangle_at(double x_world, double y_world) const;
  Eigen::Vector2d within(double x_world, double y_world) const;

  world::Tile tile_;
  std::vector<std::int32_t> half_steps_;
  world::PaintIndex paint_;
};

}  // namespace terracast::world_export
