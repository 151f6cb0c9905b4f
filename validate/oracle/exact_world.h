#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "validate/oracle/exact_objects.h"
#include "validate/oracle/exact_paint.h"
#include "validate/oracle/tile_key.h"
#include "validate/oracle/world_folder.h"

namespace terracast::oracle {

/// A ray from a point through another one, both as they stand in binary: the ray is exactly that.
struct ExactRay {
  Eigen::Vector3d origin_world;
  Eigen::Vector3d through_world;
};

/// What covers the ground at a sample of a tile; land of several kinds is one. Seabed: where the water of the
/// sea, of a lake or of a river is left out.
enum class Ground : std::uint8_t { Land, Sea, Outside, Lake, River, Seabed };

/// Where those who look at a world stand. In water they see its bed, what stands on and in it, and the water's
/// surface from below, where a ray leaves it; above it the surface alone.
enum class Viewers : std::uint8_t { AboveWater, InWater };

/// What of an object a ray meets.
struct ObjectHit {
  std::uint32_t instance_id = 0;
  std::uint8_t semantic_class = 0;
};

/// The first point that a ray shares with the ground or an object.
struct ExactHit {
  double t = 0.0;               ///< origin + t (through - origin), within 1 ulp of the exact value
  Eigen::Vector3d point_world;  ///< each coordinate within 1 ulp of the exact point's
  Eigen::Vector3d
      normal_world;  ///< of the triangle, unit, upward; of an object's towards the ray's origin
  std::optional<ObjectHit> object;  ///< nothing: the ground
  // Of the ground.
  TileKey tile;
  int cell_x = 0;
  int cell_y = 0;
  bool is_upper = false;  ///< the triangle at the cell's north-eastern corner
  /// Of the ground at the right angle, then beside it along x, then along y; exact.
  std::array<Eigen::Vector3d, 3> corners_world;
  std::array<Ground, 3> grounds;  ///< of the corners
  Paint paint;                    ///< at the point

  /// Of a place over the triangle: how much each corner counts, barycentric; they sum up to 1.
  std::array<double, 3> weights_at(double x_world, double y_world) const;
};

/// A tile's heights, borders stitched. Exact: whole half steps of 2^-11 m about a whole metre.
struct TileSurface {
  static constexpr int kCells = 256;
  static constexpr int kSamples = kCells + 1;

  TileKey key;
  double spacing_m = 0.0;
  double west_world = 0.0;  ///< of sample (0, 0)
  double south_world = 0.0;
  double center_z_m = 0.0;
  std::vector<std::int32_t> half_steps;  ///< row by row from the south, each from the west
  std::vector<Ground> grounds;

  static std::size_t sample(int i, int j) {
    return static_cast<std::size_t>(j) * kSamples + static_cast<std::size_t>(i);
  }
  Eigen::Vector3d vertex_world(int i, int j) const {
    return {west_world + i * spacing_m, south_world + j * spacing_m,
            center_z_m + half_steps[sample(i, j)] * 0x1.0p-11};
  }
};

/// The ground of a world and what stands on it as exact triangles, without Embree, without any float, and without the code
/// that renders: tiles are read and stitched by docs/world.md alone. On a side with a coarser
/// neighbour each odd sample is the mean of its two neighbours; a cell is cut from (x+1, y) to (x,
/// y+1).
///
/// Boxes of tiles, and of 16 x 16 cells in them, are passed in double with a margin; the triangles of
/// each such block that a ray may meet lie in a CGAL AABB tree, made when first needed, and are met or
/// not by exact predicates. Of those met the first is found by rational arithmetic where double
/// cannot tell. Objects: exact_objects.h.
///
/// Of viewers in water the ground is the bed: each sample lower by the depth that the tile states there, stitched as
/// all ground is. Beside it they meet the triangles of the surface from below, where the corner that counts most is
/// water.
///
/// accuracy   a ray meets exactly those closed triangles that it meets; one that lies within the
///            plane of a triangle meets its neighbours instead
/// memory     tiles with their trees up to `memory_bytes`, and one more for each thread
/// threads    safe; the result depends on the ray and the tiles alone. Works in the default floating
///            mode whatever the thread's is, and leaves that as it was
class ExactWorld {
 public:
  /// tiles           sorted or not; where a side has no neighbour the ground ends
  /// world_from_enu  how instances stand
  /// throws   Input: the world has no such tile
  ExactWorld(const WorldFolder& world, std::span<const TileKey> tiles, WorldFromEnu world_from_enu,
             Viewers viewers = Viewers::AboveWater,
             std::size_t memory_bytes = kDefaultMemory_bytes);
  ~ExactWorld();
  ExactWorld(const ExactWorld&) = delete;
  ExactWorld& operator=(const ExactWorld&) = delete;

  static constexpr std::size_t kDefaultMemory_bytes = std::size_t{512} << 20;

  /// The first crossing with t in [0, t_max]; nothing where there is none.
  /// throws   Input, Io: a tile is damaged or not the one that the world lists
  std::optional<ExactHit> first_hit(const ExactRay& ray,
                                    double t_max = std::numeric_limits<double>::infinity()) const;

  /// The heights of a tile; of its bed for viewers in water.
  std::shared_ptr<const TileSurface> surface(const TileKey& tile) const;

  /// Whether a place lies below the surface of the sea, of a lake or of a river.
  static bool is_in_water(const WorldFolder& world, std::span<const TileKey> tiles,
                          const Eigen::Vector3d& place_world);

  /// Levels of the tiles beyond the sides west, east, south and north, less the tile's own: 1
  /// coarser, 0 equal or none, -1 finer.
  std::array<int, 4> neighbour_levels(const TileKey& tile) const;

  struct Stats {
    std::uint64_t num_rays = 0;
    std::uint64_t num_tiles_read = 0;
    std::uint64_t num_trees = 0;
    std::size_t peak_bytes = 0;
  };
  Stats stats() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  std::unique_ptr<Impl> surface_of_water_;  ///< null: viewers stand above it
};

}  // namespace terracast::oracle
