#include "world/prototype_library.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"

namespace terracast::world {
namespace {

using core::ErrorKind;
using core::fail;

geo::Box3d everywhere() {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  return {Eigen::Vector3d::Constant(-kInfinity), Eigen::Vector3d::Constant(kInfinity)};
}

double radius_of(const Shape& shape) {
  double most_m2 = 0.0;
  for (const Eigen::Vector3i& vertex : shape.vertices_steps)
    most_m2 = std::max(most_m2, (vertex.head<2>().cast<double>() * kHeightStep_m).squaredNorm());
  return std::sqrt(most_m2);
}

TriangleMesh mesh_of(const Shape& shape) {
  double reach_m = 0.0;
  for (const Eigen::Vector3i& vertex : shape.vertices_steps)
    reach_m = std::max(reach_m, vertex.cast<double>().cwiseAbs().maxCoeff() * kHeightStep_m);
  std::vector<TriangleMesh::Triangle> triangles;
  triangles.reserve(shape.triangles.size());
  for (std::uint32_t i = 0; i < shape.triangles.size(); ++i)
    triangles.push_back({corners_of(shape, i), i});
  return TriangleMesh(triangles, everywhere(), reach_m);
}

}  // namespace

PrototypeLibrary::Shown::Shown(Shape shown_shape)
    : shape(std::move(shown_shape)), mesh(mesh_of(shape)), radius_m(radius_of(shape)) {}

PrototypeLibrary::PrototypeLibrary(const TileStore& store, int finest_level, int coarsest_level) {
  levels_.resize(store.manifest().prototypes.size());
  for (std::size_t row = 0; row < levels_.size(); ++row) {
    Prototype prototype = store.load_prototype(row);
    int finest_shown = finest_level;  // by this level of detail and coarser ones
    for (ShapeLevel& level : prototype.levels) {
      if (level.coarsest_level < finest_shown) continue;
      if (finest_shown > coarsest_level) break;
      finest_shown = level.coarsest_level + 1;
      check_corners(
          level.shape, Eigen::Vector3i::Zero(),
          fmt::format("{}: prototype {} (\"{}\")", store.folder().string(), row, prototype.name));
      levels_[row].push_back({level.coarsest_level, Shown(std::move(level.shape))});
      const Shown& shown = levels_[row].back().shown;
      num_bytes_ += sizeof(Level) + num_bytes_of(shown.shape) + shown.mesh.num_bytes();
    }
  }
}

const PrototypeLibrary::Shown* PrototypeLibrary::shown_at(std::size_t prototype,
                                                          int tile_level) const {
  for (const Level& level : levels_[prototype])
    if (tile_level <= level.coarsest_level) return &level.shown;
  return nullptr;
}

std::size_t num_bytes_of(const Shape& shape) {
  return shape.vertices_steps.size() * sizeof(Eigen::Vector3i) +
         shape.uv.size() * sizeof(Eigen::Vector2f) +
         shape.triangles.size() * sizeof(Shape::Triangle) + shape.finishes.size() * sizeof(Finish);
}

TriangleCorners corners_of(const Shape& shape, std::size_t triangle,
                           const Eigen::Vector3i& origin_steps) {
  const auto& corners = shape.triangles[triangle].corners;
  return {origin_steps + shape.vertices_steps[corners[0]],
          origin_steps + shape.vertices_steps[corners[1]],
          origin_steps + shape.vertices_steps[corners[2]]};
}

void check_corners(const Shape& shape, const Eigen::Vector3i& origin_steps,
                   const std::string& what) {
  for (const Eigen::Vector3i& vertex : shape.vertices_steps) {
    for (int axis = 0; axis < 3; ++axis) {
      const std::int64_t steps = std::int64_t{origin_steps[axis]} + vertex[axis];
      if (std::abs(steps) >= kMaxCornerSteps)
        fail(ErrorKind::Input,
             "{}: a corner {} m from the origin, {} m would do; tile the world again", what,
             static_cast<double>(steps) * kHeightStep_m, kMaxCornerSteps * kHeightStep_m);
    }
  }
}

}  // namespace terracast::world
