#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "world/box_tree.h"
#include "world/triangle_crossing.h"
#include "world/triangle_packet.h"

namespace terracast::world {

/// Coordinates of corners in steps are smaller than this: their differences have exact products.
inline constexpr std::int32_t kMaxCornerSteps = 1 << 30;

/// A ray in the frame of a mesh, which may be smaller or larger than the world: t is the world's.
struct MeshRay {
  /// length_world_m   of the direction in the world frame
  MeshRay(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction_m,
          double length_world_m, double t_ray_start)
      : origin(origin_m),
        direction(direction_m),
        length_world(length_world_m),
        t_start(t_ray_start),
        sheared(origin_m, direction_m) {}

  Eigen::Vector3d origin;
  Eigen::Vector3d direction;
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

  /// The mesh without its corners: what it is made from again with them.
  struct Packed {
    BoxTree tree;
    std::vector<std::uint32_t> numbers;  ///< of the triangles, leaf by leaf
    std::vector<std::uint8_t> counts;    ///< of the leaves' triangles
    geo::Box3d bounds;

    std::size_t num_bytes() const {
      return tree.num_bytes() + numbers.size() * sizeof(std::uint32_t) + counts.size();
    }
  };
  Packed packed() const;
  /// corners_of   (number) -> TriangleCorners
  template <class CornersOf>
  TriangleMesh(const Packed& packed, const CornersOf& corners_of)
      : tree_(packed.tree), bounds_(packed.bounds) {
    blocks_.resize(packed.counts.size());
    const std::uint32_t* number = packed.numbers.data();
    for (std::size_t leaf = 0; leaf < blocks_.size(); ++leaf) {
      blocks_[leaf].count = packed.counts[leaf];
      set_block(blocks_[leaf], [&](std::uint32_t lane) {
        return Triangle{corners_of(number[lane]), number[lane]};
      });
      number += packed.counts[leaf];
    }
  }

  /// Around what was not left out, m; empty where there is nothing.
  const geo::Box3d& bounds() const { return bounds_; }
  std::size_t num_bytes() const {
    return tree_.num_bytes() + blocks_.size() * sizeof(TriangleBlock);
  }

  /// Looks for crossings of a packet's rays before those found so far.
  /// rays        as the tree sees them; their lanes end where something is found
  /// exact_ray   (lane) -> const MeshRay&: asked for where a ray comes near triangles
  /// key         of a triangle: this + its number
  /// is_any      one is enough for each
  template <int kLanes, class ExactRay>
  void cross(RayPacket<kLanes>& rays, const ExactRay& exact_ray, std::uint64_t key, bool is_any,
             std::span<FirstCrossing> first) const {
    const auto cross_exactly = [&](int lane, std::uint32_t leaf) {
      FirstCrossing& found = first[static_cast<std::size_t>(lane)];
      if (!cross_leaf(exact_ray(lane), leaf, key, is_any, found)) return false;
      if (is_any)
        rays.end(lane);
      else
        rays.end_at(lane, found.t);
      return true;
    };
    tree_.traverse(
        rays,
        [&](std::uint32_t leaf, const float* near_m) {
          LaneBytes<kLanes> near;
          find_near(blocks_[leaf], tree_.center(), tree_.margin_m(), rays, near_m, near);
          near.for_each([&](int lane, std::uint32_t) { cross_exactly(lane, leaf); });
        },
        [&](int lane, std::uint32_t leaf, float, BoxTree::Ray& ray) {
          if (cross_exactly(lane, leaf)) ray.reach_m = rays.reach_m[lane];
          return rays.reach_m[lane] < 0.0F;
        });
  }
  /// The same of a single ray.
  void cross(const MeshRay& ray, std::uint64_t key, bool is_any, FirstCrossing& first) const;
  const BoxTree& tree() const { return tree_; }

 private:
  /// True where a crossing is found that counts.
  bool cross_leaf(const MeshRay& ray, std::uint32_t leaf, std::uint64_t key, bool is_any,
                  FirstCrossing& first) const;
  /// Sets a block of so many triangles as it counts; the last one fills the lanes that are left.
  template <class TriangleAt>
  static void set_block(TriangleBlock& block, const TriangleAt& triangle_at) {
    for (std::uint32_t lane = 0; lane < TriangleBlock::kTriangles; ++lane) {
      const Triangle triangle = triangle_at(std::min(lane, block.count - 1));
      block.set(static_cast<int>(lane), triangle.corners, triangle.number);
    }
  }

  BoxTree tree_;
  std::vector<TriangleBlock> blocks_;  ///< by leaf
  geo::Box3d bounds_;
};

}  // namespace terracast::world
