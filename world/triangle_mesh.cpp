#include "world/triangle_mesh.h"

#include <cmath>

#include "world/terrain_walk.h"
#include "world/tile_id.h"

namespace terracast::world {
namespace {

geo::Box3d box_of(const TriangleCorners& corners) {
  geo::Box3d box;
  for (const Eigen::Vector3i& corner : corners) box.extend(corner.cast<double>() * kHeightStep_m);
  return box;
}

bool has_area(const TriangleCorners& corners) {
  const Eigen::Matrix<std::int64_t, 3, 1> along =
      (corners[1].cast<std::int64_t>() - corners[0].cast<std::int64_t>());
  const Eigen::Matrix<std::int64_t, 3, 1> across =
      (corners[2].cast<std::int64_t>() - corners[0].cast<std::int64_t>());
  return !along.cross(across).isZero();
}

/// Whether the plane of a triangle that the ray crosses at t holds its start.
bool starts_on(const MeshRay& ray, const TriangleBlock& block, int lane, double t) {
  const double way_m = (t - ray.t_start) * ray.length_world;
  const auto corner = [&](int k) {
    return Eigen::Vector3d(block.steps[0][k][lane], block.steps[1][k][lane],
                           block.steps[2][k][lane]);
  };
  const Eigen::Vector3d normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
  return way_m * std::abs(normal.dot(ray.direction)) <=
         kOnSurface_m * normal.norm() * ray.direction.norm();
}

}  // namespace

TriangleMesh::TriangleMesh(std::span<const Triangle> triangles, const geo::Box3d& clip,
                           double reach_m) {
  std::vector<geo::Box3d> boxes;
  std::vector<std::uint32_t> kept;
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    const geo::Box3d box = box_of(triangles[i].corners).intersection(clip);
    if (box.isEmpty() || !has_area(triangles[i].corners)) continue;
    boxes.push_back(box);
    kept.push_back(i);
    bounds_.extend(box);
  }
  BoxTree::Leaves leaves;
  tree_ = BoxTree(boxes, TriangleBlock::kTriangles, leaves, reach_m);
  blocks_.resize(leaves.leaves.size());
  for (std::size_t leaf = 0; leaf < blocks_.size(); ++leaf) {
    const auto [begin, end] = leaves.leaves[leaf];
    TriangleBlock& block = blocks_[leaf];
    block.count = end - begin;
    set_block(block, [&, begin = begin](std::uint32_t lane) {
      return triangles[kept[leaves.order[begin + lane]]];
    });
  }
}

TriangleMesh::Packed TriangleMesh::packed() const {
  Packed packed{.tree = tree_, .numbers = {}, .counts = {}, .bounds = bounds_};
  packed.counts.reserve(blocks_.size());
  for (const TriangleBlock& block : blocks_) {
    packed.counts.push_back(static_cast<std::uint8_t>(block.count));
    packed.numbers.insert(packed.numbers.end(), block.number, block.number + block.count);
  }
  packed.numbers.shrink_to_fit();
  return packed;
}

void TriangleMesh::cross(const MeshRay& ray, std::uint64_t key, bool is_any,
                         FirstCrossing& first) const {
  if (tree_.is_empty()) return;
  const double length = ray.direction.norm();
  const Eigen::Vector3d inverse(safe_inverse(ray.direction.x(), length),
                                safe_inverse(ray.direction.y(), length),
                                safe_inverse(ray.direction.z(), length));
  BoxTree::Ray in_tree;
  if (!tree_.enter(ray.origin, ray.direction, inverse, length, first.t_from, first.t, in_tree))
    return;
  tree_.traverse(in_tree, [&](std::uint32_t leaf, float) {
    if (!cross_leaf(ray, leaf, key, is_any, first)) return false;
    in_tree.end_at(first.t);
    return is_any;
  });
}

bool TriangleMesh::cross_leaf(const MeshRay& ray, std::uint32_t leaf, std::uint64_t key,
                              bool is_any, FirstCrossing& first) const {
  const TriangleBlock& block = blocks_[leaf];
  BlockCrossings crossings;
  cross_block(ray.sheared, block, crossings);
  bool has_found = false;
  for (; crossings.crossed != 0; crossings.crossed &= crossings.crossed - 1) {
    const int lane = __builtin_ctz(crossings.crossed);
    const double t = crossings.t[lane];
    const std::uint64_t own_key = key + block.number[lane];
    if (!first.takes(t, own_key) || starts_on(ray, block, lane, t)) continue;
    first.t = t;
    first.key = own_key;
    first.is_found = true;
    has_found = true;
    if (is_any) break;
  }
  return has_found;
}

}  // namespace terracast::world
