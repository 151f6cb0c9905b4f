#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "world/box_tree.h"
#include "world/triangle_crossing.h"

namespace terracast::world {

/// Coordinates of corners in steps are smaller than this: their differences have exact products.
inline constexpr std::int32_t kMaxCornerSteps = 1 << 30;

/// A ray in the frame of a mesh, which may be smaller or larger than the world: t is the world's.
struct MeshRay {
  /// length_world_m   of the direction in the world frame
  MeshRay(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction_m,
          double length_world_m, double t_ray_start);

  Eigen::Vector3d origin;
  Eigen::Vector3d direction;
  Eigen::Vector3d inverse;
  double length_m;  ///< of the direction
  double length_world;
  /// Where the ray starts. A triangle in whose plane (within kOnSurface_m of the world) it starts does
  /// not stop it.
  double t_start;
  ShearedRay sheared;
};

/// The part of a ray in which a crossing counts, and the first one found in it so far.
struct FirstCrossing {
  double t_from = 0.0;  ///< not before
  /// Before this, or there by a smaller key: at first where the part ends, which it does not hold.
  double t = std::numeric_limits<double>::infinity();
  /// Of the triangle: what it belongs to, then its number. Among crossings at one t the smallest
  /// counts.
  std::uint64_t key = 0;
  bool is_found = false;

  bool takes(double t_crossing, std::uint64_t crossing_key) const {
    return t_crossing >= t_from && (t_crossing < t || (t_crossing == t && crossing_key < key));
  }
};

/// Triangles under a tree of boxes. Immutable; threads: safe.
class TriangleMesh {
 public:
  struct Triangle {
    TriangleCorners corners;
    std::uint32_t number;
  };

  TriangleMesh() = default;
  /// Triangles without area are left out.
  /// clip      what is wholly outside of it, m, is left out too
  /// reach_m   as BoxTree has it
  TriangleMesh(std::span<const Triangle> triangles, const geo::Box3d& clip, double reach_m = 0.0);

  /// Around what was not left out, m; empty where there is nothing.
  const geo::Box3d& bounds() const { return bounds_; }
  std::size_t num_bytes() const {
    return tree_.num_bytes() + blocks_.size() * sizeof(TriangleBlock);
  }

  /// Looks for a crossing before the one found so far.
  /// key      of a triangle: this + its number
  /// is_any   one is enough
  void cross(const MeshRay& ray, std::uint64_t key, bool is_any, FirstCrossing& first) const {
    BoxTree::Ray tree_ray;
    if (!tree_.is_empty() && tree_.enter(ray.origin, ray.direction, ray.inverse, ray.length_m,
                                         first.t_from, first.t, tree_ray))
      cross(
          tree_ray, [&]() -> const MeshRay& { return ray; }, key, is_any, first);
  }
  /// The same for a ray that the tree sees already; the exact one is asked for where it comes near
  /// triangles.
  template <class ExactRay>
  void cross(BoxTree::Ray& tree_ray, const ExactRay& exact_ray, std::uint64_t key, bool is_any,
             FirstCrossing& first) const {
    tree_.traverse(tree_ray, [&](std::uint32_t leaf, float) {
      return cross_leaf(exact_ray(), leaf, key, is_any, tree_ray, first);
    });
  }
  const BoxTree& tree() const { return tree_; }

 private:
  /// True when there is nothing more to look for.
  bool cross_leaf(const MeshRay& ray, std::uint32_t leaf, std::uint64_t key, bool is_any,
                  BoxTree::Ray& tree_ray, FirstCrossing& first) const;

  BoxTree tree_;
  std::vector<TriangleBlock> blocks_;  ///< by leaf
  geo::Box3d bounds_;
};

}  // namespace terracast::world
