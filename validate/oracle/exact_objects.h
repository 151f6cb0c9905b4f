#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "validate/oracle/box_tree.h"
#include "world/tile.h"
#include "world/tile_store.h"

namespace terracast::oracle {

/// A triangle of an object, where it stands.
struct ObjectFacet {
  std::uint32_t instance_id = 0;
  std::uint32_t triangle = 0;  ///< of the shape that is shown
  std::uint8_t semantic_class = 0;
  std::array<Eigen::Vector3d, 3> corners_world;
};

/// A shape's vertices in metres and its triangles in a tree.
struct TreedShape {
  explicit TreedShape(const world::Shape& shape);

  std::vector<Eigen::Vector3d> vertices_m;  ///< exact
  std::vector<world::Shape::Triangle> triangles;
  std::vector<std::uint8_t> classes;  ///< of the finishes
  BoxTree tree;
};

/// The prototypes of a world, each level of detail in a tree of its own.
class PrototypeShapes {
 public:
  /// throws   Input, Io: a prototype is damaged or not the one that the world lists
  explicit PrototypeShapes(const world::TileStore& store);
  /// What a prototype shows on tiles of a level; null: nothing.
  const TreedShape* at(std::size_t prototype, int level) const;
  std::size_t size() const { return levels_.size(); }

 private:
  struct Level {
    int coarsest_level;
    std::unique_ptr<TreedShape> shape;
  };
  std::vector<std::vector<Level>> levels_;
};

/// Columns: east, north and up of WGS84 at a place of the world, in the world's frame.
using WorldFromEnu = std::function<Eigen::Matrix3d(const Eigen::Vector3d& place_world)>;

/// The objects that stand on a tile, or reach over its square, by docs/world.md alone: each in the
/// level of detail that the tile of its place has.
///
/// Solids are exact; the corners of an instance's triangles are those of its prototype, turned, scaled
/// and shifted in double, good to 1e-10 m within 100 km.
/// threads   safe
class ExactObjects {
 public:
  /// Level of the tile that holds a place of the world's x-y plane; none: no tile does.
  using LevelAt = std::function<std::optional<int>(double x_world, double y_world)>;

  /// prototypes   must outlive it
  /// throws       Input: an instance of a prototype that is not there
  ExactObjects(const world::Tile& tile, const PrototypeShapes& prototypes, const LevelAt& level_at,
               const WorldFromEnu& world_from_enu);

  bool is_empty() const { return objects_.empty(); }
  std::size_t num_bytes() const;

  /// Calls meet(facet) for each triangle whose box a ray enters before t_max, and perhaps others.
  void visit(const Eigen::Vector3d& origin_world, const Eigen::Vector3d& direction_world,
             double t_max, const std::function<void(const ObjectFacet&)>& meet) const;

 private:
  struct Object {
    std::uint32_t instance_id;
    const TreedShape* shape;
    Eigen::Vector3d place_world;
    Eigen::Matrix3d world_from_shape;  ///< with its scale
    double scale;
  };

  std::vector<std::unique_ptr<TreedShape>> solids_;
  std::vector<Object> objects_;
  BoxTree tree_;
};

}  // namespace terracast::oracle
