#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "world/tile_id.h"

namespace terracast::world {

/// A start this close to the surface lies on it. More than what the clearance of a point `origin +
/// t * direction` errs by in double, 12 * 2^-53 of the largest coordinate times 1 + the triangle's
/// slopes (at 300 km 4e-10 m times that), so that a ray that leaves from its own hit is not stopped
/// by it.
inline constexpr double kOnSurface_m = 0x1.0p-26;

/// The true surface of a tile as the walk reads it: stitched heights, two triangles a cell, the
/// diagonal from (x+1, y) to (x, y+1).
struct TerrainGrid {
  const float* z_tile = nullptr;     ///< of sample (0, 0), above center_z_m, m; every value exact
  std::ptrdiff_t sample_stride = 0;  ///< floats from a sample to the next one east, north
  std::ptrdiff_t row_stride = 0;
  double corner_x_world = 0.0;
  double corner_y_world = 0.0;
  double center_z_m = 0.0;
  double spacing_m = 1.0;
  double inverse_spacing = 1.0;

  double z(int i, int j) const {
    return static_cast<double>(z_tile[j * row_stride + i * sample_stride]);
  }
  double x_world(int i) const { return corner_x_world + i * spacing_m; }  // exact
  double y_world(int j) const { return corner_y_world + j * spacing_m; }
  /// The cell that holds a place, or the nearest one.
  int column_at(double x_world) const;
  int row_at(double y_world) const;
  /// Height above center_z_m at a place of the tile.
  double z_at(double x_world, double y_world) const;
};

/// A ray of the world with what the walk divides by. A component of the direction too small to be
/// divided by is 0.
struct WalkRay {
  Eigen::Vector3d origin_world;
  Eigen::Vector3d direction_world;
  double inverse_x = 0.0;  ///< of the direction's components; 0 where they are 0
  double inverse_y = 0.0;
};

/// What part of a ray is walked.
struct WalkSpan {
  double t_entry = 0.0;  ///< where the ray starts or enters the tile
  /// Whether the ray may lie on the surface at t_entry: it starts there, or has kept to the surface
  /// since its start.
  bool may_be_on_surface = false;
  double t_exit = 0.0;  ///< where it ends or leaves the tile; at t_entry or later
  double t_from = 0.0;  ///< where the walk begins: known to be above the surface, or t_entry
  /// The walk may end here or later when it is clear_m above the surface.
  double t_clear = 0.0;
  double clear_m = 0.0;
};

struct WalkResult {
  enum class End { Crossed, Left, Clear };
  End end = End::Left;
  double t = 0.0;              ///< of the crossing, or where the ray is clear
  bool is_on_surface = false;  ///< of a ray that left: it has kept to the surface all the way
  int cell_x = 0;
  int cell_y = 0;
  bool is_upper = false;
  double slope_x = 0.0;  ///< rise of the triangle crossed, m/m
  double slope_y = 0.0;
};

/// The first crossing of a ray with a tile's true triangles, by walking cell by cell in double.
///
/// In each triangle the clearance g(t) = z of the ray - z of the plane is linear; the first
/// triangle at whose end g <= 0 holds the crossing, at the root of g. Each triangle's verdict
/// depends on the ray, the triangle and t_entry alone, never on t_from: wherever a walk begins, it
/// finds the same crossing to the last bit.
///
/// A ray that is on or under the surface at t_entry crosses it there. But one that may lie on the
/// surface crosses there only when it is more than kOnSurface_m below, and, as long as it keeps
/// within kOnSurface_m, only where it sinks deeper.
/// result   written in place: copies on the way out would cost as much as a step of the walk
void walk_terrain(const TerrainGrid& grid, const WalkRay& ray, const WalkSpan& span,
                  WalkResult& result);

}  // namespace terracast::world
