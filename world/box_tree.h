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
  static constexpr int kMaxDepth = 64;
  static constexpr std::size_t kMostWaiting = std::size_t{kMaxDepth} * (kWidth - 1) + 1;
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
  /// leaves    set to what they hold, at most `most_in_leaf` boxes each
  /// reach_m   how far from the centre floats of rays' origins may lie beside what enter() gives
  BoxTree(std::span<const geo::Box3d> boxes, std::uint32_t most_in_leaf, Leaves& leaves,
          double reach_m = 0.0);

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

  /// What a ray still has to look at.
  class Way {
   public:
    Way() {}  // NOLINT(modernize-use-equals-default): the stack is not cleared

   private:
    friend class BoxTree;
    struct Waiting {
      float near_m;
      std::uint32_t child;
    };
    std::array<Waiting, kMostWaiting> stack_;
    std::size_t num_waiting_ = 0;
  };
  static constexpr std::uint32_t kNoLeaf = 0xffffffffU;

  /// Calls visit(leaf, near_m) for the leaves that the ray comes near, roughly in their order along it,
  /// until one returns true: near_m from the ray's origin, not behind where it comes into the leaf's
  /// box. visit may call ray.end_at().
  template <class Visit>
  void traverse(Ray& ray, const Visit& visit) const {
    Way way;
    begin(way);
    float near_m = 0.0F;
    for (std::uint32_t leaf; (leaf = next_leaf(ray, way, near_m)) != kNoLeaf;)
      if (visit(leaf, near_m)) return;
  }

  /// About which a ray's origin is given.
  const Eigen::Vector3d& center() const { return center_; }
  double margin_m() const { return margin_m_; }

 private:
  struct Builder;
  static void begin(Way& way) {
    way.stack_[0] = {0.0F, 0};
    way.num_waiting_ = 1;
  }
  std::uint32_t next_leaf(const Ray& ray, Way& way, float& near_m) const;
  std::uint32_t next_leaf_plainly(const Ray& ray, Way& way, float& leaf_near_m) const;
  std::uint32_t next_leaf_by_avx2(const Ray& ray, Way& way, float& leaf_near_m) const;
  std::uint32_t take(const Ray& ray, Way& way, float& near_m, const Node*& node) const;
  static void put(const Node& node, const float* near_m, std::uint32_t met, Way& way);

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
