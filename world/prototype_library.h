#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include "world/tile_store.h"
#include "world/triangle_mesh.h"

namespace terracast::world {

/// The prototypes of a world as rays meet them: of each those shapes that tiles of some levels show.
/// Immutable; threads: safe.
class PrototypeLibrary {
 public:
  struct Shown {
    Shape shape;
    TriangleMesh mesh;  ///< a triangle's number is its place in the shape
    double radius_m;    ///< of the upright cylinder about its foot that holds it
    explicit Shown(Shape shown_shape);
  };

  /// Reads all prototypes of the store.
  /// finest_level, coarsest_level   of the tiles by which instances are shown
  /// throws   Input: a damaged prototype; Io
  PrototypeLibrary(const TileStore& store, int finest_level, int coarsest_level);

  std::size_t size() const { return levels_.size(); }
  /// What is shown of a prototype by a tile's level; null: nothing.
  const Shown* shown_at(std::size_t prototype, int tile_level) const;
  /// All that they keep in memory.
  std::size_t num_bytes() const { return num_bytes_; }

 private:
  struct Level {
    int coarsest_level;
    Shown shown;
  };
  std::vector<std::vector<Level>> levels_;
  std::size_t num_bytes_ = 0;
};

/// What a shape keeps in memory.
std::size_t num_bytes_of(const Shape& shape);

/// The corners of a shape's triangle.
/// origin_steps   of the shape
TriangleCorners corners_of(const Shape& shape, std::size_t triangle,
                           const Eigen::Vector3i& origin_steps = Eigen::Vector3i::Zero());

/// throws Input: a corner farther from the origin than kMaxCornerSteps; names `what`
void check_corners(const Shape& shape, const Eigen::Vector3i& origin_steps,
                   const std::string& what);

}  // namespace terracast::world
