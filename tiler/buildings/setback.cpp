#include "tiler/buildings/setback.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/parallel.h"
#include "tiler/buildings/building_mesh.h"
#include "world/tile.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using world::kHeightStep_m;

/// Earlier ones over which a building lies that are kept apart from it: more than there are ranks,
/// four times.
constexpr std::size_t kMostOverlaps = 64;
/// Earlier ones with boxes that meet a building's of which the edges are looked at.
constexpr int kMostPairs = 1024;
/// Lines so near to each other are kept apart: two roundings of walls to steps, with room.
constexpr double kClear_steps = 4.0;
/// Walls that run so near to each other for less are left, such as those that meet at a corner, and
/// those that cross at 10 degrees and more.
constexpr double kLeastRun_steps = 48.0;
/// Walls of blocks that cross so flatly that they are near each other for so long, or longer, are
/// told of where no rank parts them.
constexpr double kToldRun_steps = 1024.0;

/// Two edges along each other.
struct NearLines {
  double first_steps, last_steps;  ///< how far the second one lies inside the first, at both ends
  double run_steps;                ///< for how long
  bool are_opposed;                ///< what is built lies to the other side of the second one
};
/// Of a building and an earlier one.
struct Overlap {
  std::uint32_t earlier;
  /// Bit kMostRank + d: with a rank that is higher by d than the earlier one's, faces lie in one
  /// plane.
  std::uint32_t blocked = 0;
  /// Bit s: so do they where both ranks together are s.
  std::uint32_t blocked_sums = 0;
  /// A wall of a block, of the one or the other, runs near one of the other: how blocks move with
  /// ranks no rule tells.
  bool are_blocks_near = false;
};
static_assert(2 * kMostRank < 32);

struct Overlaps {
  std::vector<Overlap> kept;
  bool are_more = false;       ///< than were looked at
  std::int64_t num_pairs = 0;  ///< that were looked at
};

/// Corners about the place of another building.
RingsSteps about(const RingsSteps& rings, const Eigen::Vector2i& from_m,
                 const Eigen::Vector2i& to_m) {
  RingsSteps moved = rings;
  const Eigen::Vector2i by = (from_m - to_m) * static_cast<int>(1.0 / kHeightStep_m);
  for (auto& ring : moved)
    for (Eigen::Vector2i& corner : ring) corner += by;
  return moved;
}

/// Whether any edge passes; the first that does is the last that is looked at.
template <class Test>
bool any_edge(const RingsSteps& rings, const Test& test) {
  for (const auto& ring : rings)
    for (std::size_t i = 0; i < ring.size(); ++i)
      if (test(Vector2d(ring[i].cast<double>()),
               Vector2d(ring[(i + 1) % ring.size()].cast<double>())))
        return true;
  return false;
}

template <class Use>
void for_each_edge(const RingsSteps& rings, const Use& use) {
  any_edge(rings, [&](const Vector2d& a, const Vector2d& b) {
    use(a, b);
    return false;
  });
}

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// For how long lines run within kClear_steps of each other, once the second one has moved farther
/// inside.
double near_run_steps(const NearLines& lines, double farther_steps) {
  const auto [low, high] = std::minmax({lines.first_steps, lines.last_steps});
  const double from = std::max(low + farther_steps, -kClear_steps);
  const double to = std::min(high + farther_steps, kClear_steps);
  if (to < from) return 0.0;
  return high - low < 1e-6 ? lines.run_steps : lines.run_steps * (to - from) / (high - low);
}

/// By how much farther inside the first line ranks move the second one which differ by d; of
/// opposed lines ranks that are d together.
double moved_by_steps(const NearLines& lines, int d) {
  return lines.are_opposed ? -steps(2.0 * kInset_m + d * kSetback_m) : steps(d * kSetback_m);
}

bool is_blocked(const NearLines& lines, int d) {
  return near_run_steps(lines, moved_by_steps(lines, d)) >= kLeastRun_steps;
}

/// Edges of two rings that run along each other, wherever they lie. Rings go round with what is
/// built to their left.
template <class Use>
void for_each_run(const RingsSteps& earlier, const RingsSteps& own, const Use& use) {
  for_each_edge(earlier, [&](const Vector2d& a, const Vector2d& b) {
    const double length = (b - a).norm();
    const Vector2d along = (b - a) / length;
    for_each_edge(own, [&](const Vector2d& c, const Vector2d& d) {
      const double from = along.dot(c - a), to = along.dot(d - a);
      const double first = std::max(std::min(from, to), 0.0);
      const double last = std::min(std::max(from, to), length);
      if (last - first < kLeastRun_steps) return;
      const auto inside_at = [&](double at) {
        return cross(along, c + (at - from) / (to - from) * (d - c) - a);
      };
      use(NearLines{.first_steps = inside_at(first),
                    .last_steps = inside_at(last),
                    .run_steps = last - first,
                    .are_opposed = to < from});
    });
  });
}

/// Ranks move no lines farther against each other.
constexpr double kFarthest_steps =
    steps(2.0 * kInset_m + 2 * kMostRank * kSetback_m) + kClear_steps;

bool are_near(const NearLines& lines) {
  return std::min(lines.first_steps, lines.last_steps) <= kFarthest_steps &&
         std::max(lines.first_steps, lines.last_steps) >= -kFarthest_steps;
}

/// All that ranks may bring into one plane. Walls are left that cross whatever the ranks are.
std::vector<NearLines> lines_along(const RingsSteps& earlier, const RingsSteps& own) {
  std::vector<NearLines> lines;
  for_each_run(earlier, own, [&](const NearLines& near) {
    if (!are_near(near)) return;
    const int least = near.are_opposed ? 0 : -kMostRank;
    int num_blocked = 0;
    for (int k = 0; k <= 2 * kMostRank; ++k) num_blocked += is_blocked(near, least + k) ? 1 : 0;
    if (num_blocked > 0 && num_blocked <= 2 * kMostRank) lines.push_back(near);
  });
  return lines;
}

bool has_corner_in(const RingsSteps& rings, const RingsSteps& other) {
  for (const auto& ring : rings)
    for (const Eigen::Vector2i& corner : ring)
      if (contains(other, corner.cast<double>())) return true;
  return false;
}

bool edges_cross(const RingsSteps& one, const RingsSteps& other) {
  return any_edge(one, [&](const Vector2d& a, const Vector2d& b) {
    return any_edge(other, [&](const Vector2d& c, const Vector2d& d) {
      return cross(b - a, c - a) * cross(b - a, d - a) < 0.0 &&
             cross(d - c, a - c) * cross(d - c, b - c) < 0.0;
    });
  });
}

Overlap overlap_of(std::uint32_t earlier, const std::vector<NearLines>& lines) {
  Overlap overlap{.earlier = earlier, .blocked = 1U << kMostRank};  // tops and bottoms, of one rank
  for (const NearLines& near : lines)
    for (int k = 0; k <= 2 * kMostRank; ++k) {
      if (near.are_opposed && is_blocked(near, k)) overlap.blocked_sums |= 1U << k;
      if (!near.are_opposed && is_blocked(near, k - kMostRank)) overlap.blocked |= 1U << k;
    }
  return overlap;
}

bool is_blocked_by(const Overlap& overlap, int earlier_rank, int rank) {
  return (overlap.blocked >> (kMostRank + rank - earlier_rank) & 1U) != 0 ||
         (overlap.blocked_sums >> (rank + earlier_rank) & 1U) != 0;
}

/// What is shown of a building.
struct Shown {
  RingsSteps walls;
  RingsSteps block;  ///< empty: as its walls
  Vector2d lowest_world;
  Vector2d highest_world;
};

Shown shown_of(const Building& building, int rank) {
  Shown shown{walls_of(building, rank), {}, building.lowest_world, building.highest_world};
  RingsSteps block = block_of(shown.walls);
  if (block == shown.walls) return shown;
  for (const Eigen::Vector2i& corner : block.front()) {
    const Vector2d at =
        building.footprint.place_m.cast<double>() + kHeightStep_m * corner.cast<double>();
    shown.lowest_world = shown.lowest_world.cwiseMin(at);
    shown.highest_world = shown.highest_world.cwiseMax(at);
  }
  shown.block = std::move(block);
  return shown;
}

/// Walls near each other, of which the one or the other is a block's.
struct BlockRuns {
  /// Whole kLeastRun_steps, of each two: those that cross steeply have as many at all ranks.
  int num = 0;
  double longest_steps = 0.0;
};

/// What is asked of a pair.
class Pair {
 public:
  Pair(const Building& earlier, const Shown& shown_earlier, const Building& own,
       const Shown& shown_own)
      : earlier_(earlier), own_(own), shown_earlier_(shown_earlier), shown_own_(shown_own) {}

  std::vector<NearLines> lines() const {
    return lines_along(earlier_.footprint.rings, by_earlier(own_.footprint.rings));
  }
  /// Walls of neighbours that only touch are apart.
  bool lie_over_each_other() const {
    return any_shown([](const RingsSteps& earlier, const RingsSteps& own, bool) {
      return has_corner_in(own, earlier) || has_corner_in(earlier, own) ||
             edges_cross(own, earlier);
    });
  }
  bool are_blocks_near() const { return any_run_of_blocks(are_near); }
  void add_runs_of_blocks(BlockRuns& runs) const {
    any_run_of_blocks([&](const NearLines& near) {
      const double run_steps = near_run_steps(near, 0.0);
      runs.num += static_cast<int>(run_steps / kLeastRun_steps);
      runs.longest_steps = std::max(runs.longest_steps, run_steps);
      return false;
    });
  }

 private:
  /// test   of what is shown of the earlier one, of this one, and whether a block is among them
  template <class Test>
  bool any_shown(const Test& test) const {
    for (const RingsSteps* earlier : {&shown_earlier_.walls, &shown_earlier_.block})
      for (const RingsSteps* own : {&shown_own_.walls, &shown_own_.block})
        if (!earlier->empty() && !own->empty() &&
            test(*earlier, by_earlier(*own),
                 earlier == &shown_earlier_.block || own == &shown_own_.block))
          return true;
    return false;
  }
  template <class Test>
  bool any_run_of_blocks(const Test& test) const {
    return any_shown([&](const RingsSteps& earlier, const RingsSteps& own, bool has_block) {
      bool is_any = false;
      if (has_block)
        for_each_run(earlier, own, [&](const NearLines& near) { is_any = is_any || test(near); });
      return is_any;
    });
  }
  RingsSteps by_earlier(const RingsSteps& rings) const {
    return about(rings, own_.footprint.place_m, earlier_.footprint.place_m);
  }

  const Building& earlier_;
  const Building& own_;
  const Shown& shown_earlier_;
  const Shown& shown_own_;
};

/// Earlier ones with which a building of a rank has faces in one plane, whatever tiles show of them.
struct Clashes {
  std::ptrdiff_t num_levels = 0;  ///< tops and bottoms
  std::ptrdiff_t num_walls = 0;

  auto operator<=>(const Clashes&) const = default;
};

Clashes clashes_at(int rank, const std::vector<Overlap>& kept, const std::vector<int>& ranks) {
  Clashes clashes;
  for (const Overlap& overlap : kept) {
    const int before = ranks[overlap.earlier];
    if (rank == before)
      ++clashes.num_levels;
    else if (is_blocked_by(overlap, before, rank))
      ++clashes.num_walls;
  }
  return clashes;
}

Overlaps overlaps_of(std::uint32_t row, const std::vector<const Building*>& buildings,
                     const std::vector<Shown>& shown, const BoxIndex& index) {
  Overlaps overlaps;
  int num_met = 0;
  index.visit(shown[row].lowest_world, shown[row].highest_world, row, [&](std::uint32_t j) {
    ++overlaps.num_pairs;
    if ((shown[row].lowest_world.array() >= shown[j].highest_world.array()).any() ||
        (shown[row].highest_world.array() <= shown[j].lowest_world.array()).any())
      return true;
    if (num_met++ == kMostPairs || overlaps.kept.size() == kMostOverlaps) {
      overlaps.are_more = true;
      return false;
    }
    const Pair pair(*buildings[j], shown[j], *buildings[row], shown[row]);
    const std::vector<NearLines> lines = pair.lines();
    const bool are_blocks_near = pair.are_blocks_near();
    if (!lines.empty() || are_blocks_near || pair.lie_over_each_other()) {
      overlaps.kept.push_back(overlap_of(j, lines));
      overlaps.kept.back().are_blocks_near = are_blocks_near;
    }
    return true;
  });
  return overlaps;
}

}  // namespace

RingsSteps walls_of(const Building& building, int rank) {
  const RingsSteps& rings = building.footprint.rings;
  const auto inner = moved_edges(rings, -steps(kInset_m + kSetback_m * rank));
  return inner ? *inner : rings;
}

Setbacks setback_ranks(const std::vector<Building>& buildings,
                       const std::vector<RankedBuildings>& earlier) {
  std::vector<const Building*> all;  // the earlier ones, then those that are asked for
  std::vector<int> ranks;
  for (const RankedBuildings& others : earlier) {
    for (const Building& building : others.buildings) all.push_back(&building);
    ranks.insert(ranks.end(), others.ranks.begin(), others.ranks.end());
  }
  const std::size_t first = all.size();
  for (const Building& building : buildings) all.push_back(&building);
  ranks.resize(all.size(), 0);
  std::vector<Shown> shown(all.size());  // at ranks 0, then at those that are chosen
  std::vector<Overlaps> overlaps(all.size());
  const auto for_each = [&](std::size_t begin_row, std::size_t end_row, const auto& work) {
    core::parallel_for_blocks(
        static_cast<std::int64_t>(end_row - begin_row), 64,
        [&](std::int64_t begin, std::int64_t end) {
          for (std::int64_t i = begin; i < end; ++i)
            work(static_cast<std::uint32_t>(begin_row) + static_cast<std::uint32_t>(i));
        });
  };
  for_each(0, all.size(), [&](std::uint32_t row) { shown[row] = shown_of(*all[row], 0); });
  BoxIndex index;
  for (std::uint32_t row = 0; row < all.size(); ++row)
    index.add(row, shown[row].lowest_world, shown[row].highest_world);
  index.finish();
  for_each(first, all.size(),
           [&](std::uint32_t row) { overlaps[row] = overlaps_of(row, all, shown, index); });
  for_each(0, first, [&](std::uint32_t row) {
    if (ranks[row] > 0) shown[row] = shown_of(*all[row], ranks[row]);
  });
  Setbacks setbacks;
  std::int64_t num_crowded = 0;
  std::int64_t num_without = 0;
  for (std::size_t row = first; row < all.size(); ++row) {
    const std::vector<Overlap>& kept = overlaps[row].kept;
    // With earlier ones beside those of clashes_at().
    const auto block_runs_at = [&](int rank) {
      shown[row] = shown_of(*all[row], rank);
      BlockRuns runs;
      for (const Overlap& overlap : kept) {
        const std::uint32_t j = overlap.earlier;
        if (overlap.are_blocks_near && !is_blocked_by(overlap, ranks[j], rank))
          Pair(*all[j], shown[j], *all[row], shown[row]).add_runs_of_blocks(runs);
      }
      return runs;
    };
    if (!kept.empty()) {
      std::array<Clashes, kMostRank + 1> clashes;
      for (int rank = 0; rank <= kMostRank; ++rank)
        clashes[static_cast<std::size_t>(rank)] = clashes_at(rank, kept, ranks);
      const Clashes fewest = *std::min_element(clashes.begin(), clashes.end());
      BlockRuns least = {.num = std::numeric_limits<int>::max()};
      for (int rank = 0; rank <= kMostRank && least.num > 0; ++rank) {
        if (clashes[static_cast<std::size_t>(rank)] != fewest) continue;
        const BlockRuns runs = block_runs_at(rank);
        if (runs.num >= least.num) continue;
        least = runs;
        ranks[row] = rank;
      }
      shown[row] = shown_of(*all[row], ranks[row]);
      num_without += fewest != Clashes() || least.longest_steps >= kToldRun_steps ? 1 : 0;
    }
    num_crowded += overlaps[row].are_more ? 1 : 0;
    setbacks.num_pairs += overlaps[row].num_pairs;
  }
  setbacks.ranks.assign(ranks.begin() + static_cast<std::ptrdiff_t>(first), ranks.end());
  if (num_crowded > 0)
    setbacks.counts.emplace_back("footprints over more others than are looked at", num_crowded);
  if (num_without > 0)
    setbacks.counts.emplace_back("footprints without a free setback", num_without);
  return setbacks;
}

}  // namespace terracast::tiler
