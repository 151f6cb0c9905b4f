#include "world/box_tree.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include <limits>
#include <numeric>
#include <utility>

#include "core/packet_code.h"
#include "world/lane_vectors.h"

namespace terracast::world {
namespace {

using core::larger;
using core::smaller;

constexpr int kWidth = BoxTree::kWidth;
// What float arithmetic on a ray and a box errs by as a position, in units of u M, where u = 2^-24
// is half a float's last place and M the largest coordinate about the centre:
//   origin and box rounded to float          2
//   direction rounded, over a path <= 4 M    4
//   box minus origin, <= 2 M                 2
//   inverse rounded, product rounded         4
// so 12 u M; the margin is five times that.
constexpr double kMarginPerExtent = 0x1.0p-18;
// A ray that is turned into the tree's frame in float starts at most 3.3 R from its centre, R being
// how far boxes reach from the frame's origin, and goes at most 5 R on. Rounded are its start and the
// matrix (23 u R), its direction and again the matrix (72), the inverse and its product (27), centre
// and box (10): 132 u R, of 2^9.
constexpr double kMarginPerReach = 0x1.0p-15;
/// More than doubles err by anywhere in a world.
constexpr double kLeastMargin_m = 0x1.0p-20;
/// Stands for a box that is not there: no ray comes so far.
constexpr float kNowhere = 1e30F;
constexpr int kBins = 16;
/// Below it ranges are halved by number, so that the tree's depth is bounded for any boxes.
constexpr int kFreeDepth = 24;

double half_area(const geo::Box3d& box) {
  const Eigen::Vector3d size = box.sizes();
  return size.x() * size.y() + size.y() * size.z() + size.z() * size.x();
}

}  // namespace

struct BoxTree::Builder {
  std::span<const geo::Box3d> boxes;
  std::uint32_t most_in_leaf;
  const Eigen::Vector3d center;
  const double margin_m;
  std::vector<Node>& nodes;
  Leaves& leaves;

  struct Range {
    std::uint32_t begin;
    std::uint32_t end;
    geo::Box3d bounds;
    std::uint32_t size() const { return end - begin; }
  };

  Range range(std::uint32_t begin, std::uint32_t end) const {
    Range result{begin, end, {}};
    for (std::uint32_t i = begin; i < end; ++i) result.bounds.extend(boxes[leaves.order[i]]);
    return result;
  }

  /// Where a range is best cut by the area of the parts' boxes, as many boxes in each as count.
  std::uint32_t cut(const Range& all, int depth) {
    geo::Box3d centers;
    for (std::uint32_t i = all.begin; i < all.end; ++i)
      centers.extend(boxes[leaves.order[i]].center());
    Eigen::Index axis = 0;
    const double spread = centers.sizes().maxCoeff(&axis);
    const auto first = leaves.order.begin() + all.begin;
    const auto last = leaves.order.begin() + all.end;
    const std::uint32_t middle = all.begin + all.size() / 2;
    const auto center_of = [&](std::uint32_t box) { return boxes[box].center()[axis]; };
    if (depth < kFreeDepth && spread > 0.0) {
      const double low = centers.min()[axis];
      const auto bin_of = [&](std::uint32_t box) {
        return std::min(static_cast<int>((center_of(box) - low) / spread * kBins), kBins - 1);
      };
      std::array<geo::Box3d, kBins> bounds;
      std::array<std::uint32_t, kBins> counts = {};
      for (auto box = first; box != last; ++box) {
        const auto bin = static_cast<std::size_t>(bin_of(*box));
        bounds[bin].extend(boxes[*box]);
        ++counts[bin];
      }
      std::array<double, kBins> cost_above = {};
      geo::Box3d above;
      std::uint32_t num_above = 0;
      for (std::size_t bin = kBins - 1; bin > 0; --bin) {
        above.extend(bounds[bin]);
        num_above += counts[bin];
        cost_above[bin] = num_above == 0 ? 0.0 : half_area(above) * num_above;
      }
      double best_cost = std::numeric_limits<double>::infinity();
      int best_bin = -1;
      geo::Box3d below;
      std::uint32_t num_below = 0;
      for (std::size_t bin = 0; bin + 1 < kBins; ++bin) {
        below.extend(bounds[bin]);
        num_below += counts[bin];
        if (num_below == 0 || num_below == all.size()) continue;
        const double cost = half_area(below) * num_below + cost_above[bin + 1];
        if (cost >= best_cost) continue;
        best_cost = cost;
        best_bin = static_cast<int>(bin);
      }
      if (best_bin >= 0) {
        const auto parted =
            std::partition(first, last, [&](std::uint32_t box) { return bin_of(box) <= best_bin; });
        return static_cast<std::uint32_t>(parted - leaves.order.begin());
      }
    }
    std::nth_element(first, leaves.order.begin() + middle, last,
                     [&](std::uint32_t a, std::uint32_t b) {
                       return std::pair(center_of(a), a) < std::pair(center_of(b), b);
                     });
    return middle;
  }

  /// Of two or more boxes than fit a leaf, or of the root.
  std::uint32_t build(const Range& all, int depth) {
    std::vector<Range> parts = {all};
    while (parts.size() < kWidth) {
      std::size_t largest = parts.size();
      double largest_area = -1.0;
      for (std::size_t i = 0; i < parts.size(); ++i) {
        // Deep down by number alone, see kFreeDepth.
        const double weight =
            depth < kFreeDepth ? half_area(parts[i].bounds) : static_cast<double>(parts[i].size());
        if (parts[i].size() <= most_in_leaf || weight <= largest_area) continue;
        largest = i;
        largest_area = weight;
      }
      if (largest == parts.size()) break;
      const Range part = parts[largest];
      const std::uint32_t at = cut(part, depth);
      parts[largest] = range(part.begin, at);
      parts.push_back(range(at, part.end));
    }
    const auto index = static_cast<std::uint32_t>(nodes.size());
    nodes.emplace_back();
    for (std::size_t i = 0; i < kWidth; ++i) {
      const bool is_there = i < parts.size();
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        const auto place = [&](double x, double outward) {
          return is_there ? static_cast<float>(x - center[axis] + outward) : kNowhere;
        };
        nodes[index].low[axis][i] = place(is_there ? parts[i].bounds.min()[axis] : 0.0, -margin_m);
        nodes[index].high[axis][i] = place(is_there ? parts[i].bounds.max()[axis] : 0.0, margin_m);
      }
      nodes[index].child[i] = 0;
    }
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (parts[i].size() <= most_in_leaf) {
        nodes[index].child[i] = kLeaf + static_cast<std::uint32_t>(leaves.leaves.size());
        leaves.leaves.push_back({parts[i].begin, parts[i].end});
      } else {
        const std::uint32_t child = build(parts[i], depth + 1);  // nodes moves
        nodes[index].child[i] = child;
      }
    }
    return index;
  }
};

BoxTree::BoxTree(std::span<const geo::Box3d> boxes, std::uint32_t most_in_leaf, Leaves& leaves,
                 double reach_m) {
  leaves.order.resize(boxes.size());
  leaves.leaves.clear();
  std::iota(leaves.order.begin(), leaves.order.end(), 0U);
  if (boxes.empty()) return;
  for (const geo::Box3d& box : boxes) bounds_.extend(box);
  center_ = bounds_.center();
  margin_m_ = std::max({bounds_.sizes().maxCoeff() / 2.0 * kMarginPerExtent,
                        reach_m * kMarginPerReach, kLeastMargin_m});
  Builder builder{boxes, most_in_leaf, center_, margin_m_, nodes_, leaves};
  builder.build(builder.range(0, static_cast<std::uint32_t>(boxes.size())), 0);
  nodes_.shrink_to_fit();
  bounds_.min().array() -= margin_m_;
  bounds_.max().array() += margin_m_;
}

bool BoxTree::enter(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                    const Eigen::Vector3d& inverse, double length_m, double t_from, double t_until,
                    Ray& ray) const {
  double t_in = t_from;
  double t_out = t_until;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double a = (bounds_.min()[axis] - origin[axis]) * inverse[axis];
    const double b = (bounds_.max()[axis] - origin[axis]) * inverse[axis];
    t_in = std::max(t_in, std::min(a, b));
    t_out = std::min(t_out, std::max(a, b));
  }
  if (!(t_in <= t_out)) return false;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<Eigen::Index>(axis);
    ray.origin[axis] = static_cast<float>(origin[k] + t_in * direction[k] - center_[k]);
    ray.inverse[axis] = static_cast<float>(inverse[k] * length_m);
  }
  ray.t_origin = t_in;
  ray.length_m = length_m;
  ray.margin_m = margin_m_;
  ray.reach_m = std::numeric_limits<float>::infinity();
  ray.end_at(t_out);
  return true;
}

namespace {

/// Eight lanes of a packet, from `first` on.
/// returns   whether any of them comes near the boxes
template <int kLanes>
TERRACAST_PACKET_INLINE bool enter_bounds(const geo::Box3d& bounds, const Eigen::Vector3d& center,
                                          double margin_m, const RayLanes& rays,
                                          const double* t_until, LaneMask asked, int first,
                                          RayPacket<kLanes>& packet) {
  using Doubles = LaneVectors<RayLanes::kLanes>::Doubles;
  using Floats = LaneVectors<RayLanes::kLanes>::Floats;
  using Integers = LaneVectors<RayLanes::kLanes>::Integers;
  constexpr double kLargestInverse = 0x1.0p60;
  constexpr double kRounding = 1.0 + 0x1.0p-20;
  const double* origins[3] = {rays.origin_x, rays.origin_y, rays.origin_z};
  const double* directions[3] = {rays.direction_x, rays.direction_y, rays.direction_z};
  const double* inverses[3] = {rays.inverse_x, rays.inverse_y, rays.inverse_z};
  const float* units[3] = {rays.unit_x, rays.unit_y, rays.unit_z};
  Doubles t_in, t_out, length_m, inverse_length;
  std::memcpy(&t_in, rays.t_entry, sizeof t_in);
  std::memcpy(&t_out, t_until, sizeof t_out);
  std::memcpy(&length_m, rays.length_m, sizeof length_m);
  std::memcpy(&inverse_length, rays.inverse_length, sizeof inverse_length);
  const Doubles largest = inverse_length * kLargestInverse;
  Doubles origin[3], safe[3];
  for (int axis = 0; axis < 3; ++axis) {
    Doubles inverse;
    std::memcpy(&origin[axis], origins[axis], sizeof(Doubles));
    std::memcpy(&inverse, inverses[axis], sizeof(Doubles));
    safe[axis] = inverse != 0.0 ? inverse : largest;
    const Doubles a = (bounds.min()[axis] - origin[axis]) * safe[axis];
    const Doubles b = (bounds.max()[axis] - origin[axis]) * safe[axis];
    const Doubles in = a < b ? a : b;
    const Doubles out = a > b ? a : b;
    t_in = t_in > in ? t_in : in;
    t_out = t_out < out ? t_out : out;
  }
  for (int axis = 0; axis < 3; ++axis) {
    Doubles direction;
    std::memcpy(&direction, directions[axis], sizeof direction);
    const Floats start =
        __builtin_convertvector(origin[axis] + t_in * direction - center[axis], Floats);
    const Floats inverse = __builtin_convertvector(safe[axis] * length_m, Floats);
    std::memcpy(packet.origin[axis] + first, &start, sizeof start);
    std::memcpy(packet.inverse[axis] + first, &inverse, sizeof inverse);
    std::memcpy(packet.direction[axis] + first, units[axis], sizeof(Floats));
  }
  const Doubles way_m = (t_out - t_in) * length_m * kRounding + margin_m;
  const Doubles none = Doubles{} + static_cast<double>(RayPacket<kLanes>::kDone);
  const Floats met_m = __builtin_convertvector(t_in <= t_out ? way_m : none, Floats);
  const Integers bits = {1, 2, 4, 8, 16, 32, 64, 128};
  const Floats done = Floats{} + RayPacket<kLanes>::kDone;
  const Floats reach_m = (bits & static_cast<std::int32_t>(asked)) != 0 ? met_m : done;
  std::memcpy(packet.reach_m + first, &reach_m, sizeof reach_m);
  std::memcpy(packet.t_origin + first, &t_in, sizeof t_in);
  std::memcpy(packet.length_m + first, &length_m, sizeof length_m);
  LaneBytes<RayLanes::kLanes> reaches;
  bytes_of<RayLanes::kLanes>((reach_m >= 0.0F) & 1, reaches);
  return reaches.any() != 0;
}

TERRACAST_PACKET_CODE
bool enter_eight(const geo::Box3d& bounds, const Eigen::Vector3d& center, double margin_m,
                 const RayLanes& rays, const double* t_until, LaneMask asked, int first,
                 RayPacket<16>& packet) {
  return enter_bounds(bounds, center, margin_m, rays, t_until, asked, first, packet);
}
TERRACAST_PACKET_CODE
bool enter_eight(const geo::Box3d& bounds, const Eigen::Vector3d& center, double margin_m,
                 const RayLanes& rays, const double* t_until, LaneMask asked, int first,
                 RayPacket<8>& packet) {
  return enter_bounds(bounds, center, margin_m, rays, t_until, asked, first, packet);
}

}  // namespace

template <int kLanes>
bool BoxTree::enter(const RayGroups<kLanes>& groups, LaneMask lanes, const double* t_until,
                    RayPacket<kLanes>& packet) const {
  packet.margin_m = margin_m_;
  packet.direction_length = 1.0F;
  bool is_near = false;
  for (int first = 0; first < kLanes; first += RayLanes::kLanes)
    is_near |= enter_eight(bounds_, center_, margin_m_,
                           *groups[static_cast<std::size_t>(first / RayLanes::kLanes)],
                           t_until + first, lanes >> first, first, packet);
  if (is_near) make_ready(packet);
  return is_near;
}
template bool BoxTree::enter<8>(const RayGroups<8>&, LaneMask, const double*, RayPacket<8>&) const;
template bool BoxTree::enter<16>(const RayGroups<16>&, LaneMask, const double*,
                                 RayPacket<16>&) const;

// A ray's way through the tree is written for baseline x86-64 and for AVX2. Both do the same IEEE
// operations.

/// The next leaf on the way; kNoLeaf where none is left but boxes to be crossed, or nothing.
/// node   set to these boxes, null: nothing
TERRACAST_PACKET_INLINE std::uint32_t BoxTree::take(const Ray& ray, Way& way, float& near_m,
                                                    const Node*& node) const {
  node = nullptr;
  while (way.num_waiting_ > 0) {
    const Way::Waiting next = way.stack_[--way.num_waiting_];
    if (next.near_m > ray.reach_m) continue;
    if (next.child >= kLeaf) {
      near_m = next.near_m;
      return next.child - kLeaf;
    }
    node = &nodes_[next.child];
    return kNoLeaf;
  }
  return kNoLeaf;
}

/// Puts what is met of a node on the way, the nearest on top.
TERRACAST_PACKET_INLINE void BoxTree::put(const Node& node, const float* near_m, std::uint32_t met,
                                          Way& way) {
  const std::size_t first = way.num_waiting_;
  for (; met != 0; met &= met - 1) {
    const int lane = __builtin_ctz(met);
    const float near = near_m[lane];
    std::size_t at = way.num_waiting_++;
    for (; at > first && way.stack_[at - 1].near_m < near; --at)
      way.stack_[at] = way.stack_[at - 1];
    way.stack_[at] = {near, node.child[lane]};
  }
}

std::uint32_t BoxTree::next_leaf_plainly(const Ray& ray, Way& way, float& leaf_near_m) const {
  for (;;) {
    const Node* node = nullptr;
    const std::uint32_t leaf = take(ray, way, leaf_near_m, node);
    if (node == nullptr) return leaf;
    float near_m[kWidth];
    std::uint32_t met = 0;
    for (int i = 0; i < kWidth; ++i) {
      float enters = 0.0F;
      float leaves = ray.reach_m;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float a = (node->low[axis][i] - ray.origin[axis]) * ray.inverse[axis];
        const float b = (node->high[axis][i] - ray.origin[axis]) * ray.inverse[axis];
        enters = larger(enters, smaller(a, b));
        leaves = smaller(leaves, larger(a, b));
      }
      near_m[i] = enters;
      met |= static_cast<std::uint32_t>(enters <= leaves) << i;
    }
    put(*node, near_m, met, way);
  }
}

#if defined(__x86_64__) && !defined(TERRACAST_BASELINE_PACKETS)
__attribute__((target("avx2"))) std::uint32_t BoxTree::next_leaf_by_avx2(const Ray& ray, Way& way,
                                                                         float& leaf_near_m) const {
  const __m256 origin[3] = {_mm256_set1_ps(ray.origin[0]), _mm256_set1_ps(ray.origin[1]),
                            _mm256_set1_ps(ray.origin[2])};
  const __m256 inverse[3] = {_mm256_set1_ps(ray.inverse[0]), _mm256_set1_ps(ray.inverse[1]),
                             _mm256_set1_ps(ray.inverse[2])};
  for (;;) {
    const Node* node = nullptr;
    const std::uint32_t leaf = take(ray, way, leaf_near_m, node);
    if (node == nullptr) return leaf;
    __m256 enters = _mm256_setzero_ps();
    __m256 leaves = _mm256_set1_ps(ray.reach_m);
#pragma GCC unroll 3
    for (int axis = 0; axis < 3; ++axis) {
      const __m256 a = _mm256_mul_ps(_mm256_sub_ps(_mm256_load_ps(node->low[axis]), origin[axis]),
                                     inverse[axis]);
      const __m256 b = _mm256_mul_ps(_mm256_sub_ps(_mm256_load_ps(node->high[axis]), origin[axis]),
                                     inverse[axis]);
      enters = _mm256_max_ps(enters, _mm256_min_ps(a, b));
      leaves = _mm256_min_ps(leaves, _mm256_max_ps(a, b));
    }
    alignas(32) float near_m[kWidth];
    _mm256_store_ps(near_m, enters);
    put(*node, near_m,
        static_cast<std::uint32_t>(_mm256_movemask_ps(_mm256_cmp_ps(enters, leaves, _CMP_LE_OQ))),
        way);
  }
}

std::uint32_t BoxTree::next_leaf(const Ray& ray, Way& way, float& near_m) const {
  static const bool has_avx2 = __builtin_cpu_supports("avx2") != 0;
  return has_avx2 ? next_leaf_by_avx2(ray, way, near_m) : next_leaf_plainly(ray, way, near_m);
}
#else
std::uint32_t BoxTree::next_leaf(const Ray& ray, Way& way, float& near_m) const {
  return next_leaf_plainly(ray, way, near_m);
}
#endif

}  // namespace terracast::world
