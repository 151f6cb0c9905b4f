#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <vector>

#include "geo/box3.h"
#include "world/box_packet.h"
#include "world/ray_lanes.h"

namespace terracast::world {

/// A tree of boxes, eight to a node, in floats about a centre. What it says of a ray is one-sided:
/// whatever the ray meets within a box that was put into it is proposed, at the price of some boxes
/// that the ray only passes closely. Immutable; threads: safe.
class BoxTree {
 public:
  using Node = BoxNode;
  static constexpr int kWidth = Node::kBoxes;
  static constexpr int kMaxDepth = 64;
  static constexpr std::size_t kMostWaiting = std::size_t{kMaxDepth} * (kWidth - 1) + 1;
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

  /// Rays of a packet from where they come into a tile (t_entry), eight a group.
  /// lanes     those that are asked, group after group; the others of `packet` are done
  /// t_until   of each lane
  /// returns   false where all pass the boxes: then `packet` is not made ready
  template <int kLanes>
  bool enter(const RayGroups<kLanes>& groups, LaneMask lanes, const double* t_until,
             RayPacket<kLanes>& packet) const;

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

  /// The same of a packet. Where few lanes are left on a way each goes on alone.
  /// visit(leaf, near_m)         near_m of each lane, +inf: it does not come there
  /// visit_one(lane, leaf, near_m, ray)   true: the lane is done; both may end lanes earlier, and rays
  template <int kLanes, class Visit, class VisitOne>
  void traverse(RayPacket<kLanes>& packet, const Visit& visit, const VisitOne& visit_one) const {
    struct Waiting {
      alignas(64) float near_m[kLanes];
      std::uint32_t child;
    };
    std::array<Waiting, kMostWaiting> stack;
    BoxMeetings<kLanes> meetings;
    std::array<int, kWidth> order;  // of those that are put on the stack, the nearest last
    std::size_t num_waiting = 1;
    std::fill_n(stack[0].near_m, kLanes, 0.0F);  // lanes that are done reach not even there
    stack[0].child = 0;
    while (num_waiting > 0) {
      const Waiting& next = stack[--num_waiting];
      const LaneMask lanes = packet.reaching(next.near_m);
      if (lanes == 0) continue;
      if (next.child >= kLeaf) {
        visit(next.child - kLeaf, next.near_m);
        continue;
      }
      if (has_few_lanes(lanes)) {
        for_each_lane(lanes, [&](int lane) {
          Ray ray = ray_of(packet, lane);
          Way way;
          begin(way, next.child, next.near_m[lane]);
          float near_m = 0.0F;
          for (std::uint32_t leaf; (leaf = next_leaf(ray, way, near_m)) != kNoLeaf;)
            if (visit_one(lane, leaf, near_m, ray)) break;
        });
        continue;
      }
      const Node& node = nodes_[next.child];
      meet_boxes(node, packet, next.near_m, meetings);
      const std::size_t first = num_waiting;
      for (std::uint32_t met = meetings.met.any(); met != 0; met &= met - 1) {
        const int box = __builtin_ctz(met);
        std::size_t at = num_waiting++;
        for (; at > first && meetings.order[order[at - 1 - first]] < meetings.order[box]; --at)
          order[at - first] = order[at - 1 - first];
        order[at - first] = box;
      }
      for (std::size_t i = first; i < num_waiting; ++i) {
        const int box = order[i - first];
        std::memcpy(stack[i].near_m, meetings.near_m[box], sizeof stack[i].near_m);
        stack[i].child = node.child[box];
      }
    }
  }

  /// About which a ray's origin is given.
  const Eigen::Vector3d& center() const { return center_; }
  double margin_m() const { return margin_m_; }

 private:
  struct Builder;
  /// Two at most.
  static bool has_few_lanes(LaneMask lanes) {
    lanes &= lanes - 1;
    return (lanes & (lanes - 1)) == 0;
  }
  static void begin(Way& way, std::uint32_t child = 0, float near_m = 0.0F) {
    way.stack_[0] = {near_m, child};
    way.num_waiting_ = 1;
  }
  template <int kLanes>
  static Ray ray_of(const RayPacket<kLanes>& packet, int lane) {
    Ray ray;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      ray.origin[axis] = packet.origin[axis][lane];
      ray.inverse[axis] = packet.inverse[axis][lane];
    }
    ray.t_origin = packet.t_origin[lane];
    ray.length_m = packet.length_m[lane];
    ray.margin_m = packet.margin_m;
    ray.reach_m = packet.reach_m[lane];
    return ray;
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
