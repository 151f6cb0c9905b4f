#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "geo/box3.h"
#include "world/ray_lanes.h"

namespace terracast::world {

/// A tree of boxes, eight to a node, in floats about a centre. What it says of a ray is one-sided:
/// whatever the ray meets within a box that was put into it is proposed, at the price of some boxes
/// that the ray only passes closely. Immutable; threads: safe.
class BoxTree {
 public:
  static constexpr int kWidth = RayLanes::kLanes;
  struct alignas(32) Node {
    float low[3][kWidth];
    float high[3][kWidth];
    std::uint32_t child[kWidth];  ///< a node, or kLeaf + a leaf
  };
  static constexpr std::uint32_t kLeaf = 0x80000000U;

  /// What a leaf holds, of the order of boxes that the tree was built in.
  struct Leaf {
    std::uint32_t begin;
    std::uint32_t end;
  };
  struct Leaves {
    std::vector<std::uint32_t> order;  ///< of the boxes given
    std::vector<Leaf> leaves;
  };

  BoxTree() = default;
  /// leaves   set to what they hold, at most `most_in_leaf` boxes each
  BoxTree(std::span<const geo::Box3d> boxes, std::uint32_t most_in_leaf, Leaves& leaves);

  bool is_empty() const { return nodes_.empty(); }
  /// Around all of them, and what a ray may miss it by.
  const geo::Box3d& bounds() const { return bounds_; }
  std::size_t num_bytes() const { return nodes_.size() * sizeof(Node); }

  /// A ray as the tree sees it, from where it comes near the boxes.
  struct Ray {
    std::array<float, 3> origin;  ///< about the centre
    std::array<float, 3> inverse;
    double t_origin;
    double length_m;  ///< of the direction
    double margin_m;
    float reach_m;  ///< from the origin
    /// Leaves out what begins beyond t.
    void end_at(double t) {
      constexpr double kRounding = 1.0 + 0x1.0p-20;
      reach_m =
          std::min(reach_m, static_cast<float>((t - t_origin) * length_m * kRounding + margin_m));
    }
  };
  /// inverse    of the direction's components; where they are too small to be divided by, anything
  ///            as large
  /// returns    false where the ray passes all boxes between the two t
  bool enter(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
             const Eigen::Vector3d& inverse, double length_m, double t_from, double t_until,
             Ray& ray) const;

  /// Calls visit(leaf) for the leaves that the ray comes near, roughly in their order along it,
  /// until one returns true. visit may call ray.end_at().
  template <class Visit>
  void traverse(Ray& ray, const Visit& visit) const {
    struct Waiting {
      float near_m;
      std::uint32_t child;
    };
    std::array<Waiting, kMostWaiting> stack;
    std::size_t num_waiting = 1;
    stack[0] = {0.0F, 0};
    while (num_waiting > 0) {
      const Waiting next = stack[--num_waiting];
      if (next.near_m > ray.reach_m) continue;
      if (next.child >= kLeaf) {
        if (visit(next.child - kLeaf)) return;
        continue;
      }
      const Node& node = nodes_[next.child];
      alignas(32) RayLanes::Field<float> near_m;
      const LaneMask met = cross_boxes(node, ray, near_m);
      const std::size_t first = num_waiting;
      for_each_lane(met, [&](int lane) {
        // The nearest goes on top.
        std::size_t at = num_waiting++;
        for (; at > first && stack[at - 1].near_m < near_m[lane]; --at) stack[at] = stack[at - 1];
        stack[at] = {near_m[lane], node.child[lane]};
      });
    }
  }

 private:
  struct Builder;
  static constexpr int kMaxDepth = 64;
  static constexpr std::size_t kMostWaiting = std::size_t{kMaxDepth} * (kWidth - 1) + 1;

  static LaneMask cross_boxes(const Node& node, const Ray& ray, RayLanes::Field<float>& near_m);

  std::vector<Node> nodes_;  ///< the root first
  geo::Box3d bounds_;
  Eigen::Vector3d center_ = Eigen::Vector3d::Zero();
  double margin_m_ = 0.0;
};

/// 1 / x; of an x that is nothing beside `length`, that of a very small number of its sign.
inline double safe_inverse(double x, double length) {
  const double least = length * 0x1.0p-60;
  return 1.0 / (std::abs(x) >= least ? x : std::copysign(least, x));
}

}  // namespace terracast::world
