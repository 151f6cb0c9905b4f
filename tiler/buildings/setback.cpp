#include "tiler/buildings/setback.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/parallel.h"
#include "world/tile.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using world::kHeightStep_m;

constexpr int kMostRank = 15;
/// Lines so near to each other are kept apart: two roundings of walls to steps, with room.
constexpr double kClear_steps = 4.0;
/// Walls that run along each other for less are left, such as those that meet at a corner.
constexpr double kLeastRun_steps = 64.0;

/// Two edges that run the same way, along each other.
struct NearLines {
  double low_steps, high_steps;  ///< how far the second one lies inside the first, from end to end
};
/// Of a building and an earlier one.
struct Overlap {
  std::uint32_t earlier;
  std::vector<NearLines> lines;
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

template <class Use>
void for_each_edge(const RingsSteps& rings, const Use& use) {
  for (const auto& ring : rings)
    for (std::size_t i = 0; i < ring.size(); ++i)
      use(Vector2d(ring[i].cast<double>()), Vector2d(ring[(i + 1) % ring.size()].cast<double>()));
}

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Rings go round with what is built to their left.
std::vector<NearLines> lines_along(const RingsSteps& earlier, const RingsSteps& own) {
  constexpr double kFarthest_steps =
      kMostRank * kSetback_m / kHeightStep_m + kClear_steps;  // ranks move no line farther
  std::vector<NearLines> lines;
  for_each_edge(earlier, [&](const Vector2d& a, const Vector2d& b) {
    const double length = (b - a).norm();
    const Vector2d along = (b - a) / length;
    for_each_edge(own, [&](const Vector2d& c, const Vector2d& d) {
      const double from = along.dot(c - a), to = along.dot(d - a);
      const double first = std::max(from, 0.0), last = std::min(to, length);
      if (last - first < kLeastRun_steps) return;  // also what runs the other way
      const auto inside_at = [&](double at) {
        return cross(along, c + (at - from) / (to - from) * (d - c) - a);
      };
      const auto [low, high] = std::minmax(inside_at(first), inside_at(last));
      if (low < kFarthest_steps && high > -kFarthest_steps) lines.push_back({low, high});
    });
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
  bool do_cross = false;
  for_each_edge(one, [&](const Vector2d& a, const Vector2d& b) {
    if (do_cross) return;
    for_each_edge(other, [&](const Vector2d& c, const Vector2d& d) {
      do_cross = do_cross || (cross(b - a, c - a) * cross(b - a, d - a) < 0.0 &&
                              cross(d - c, a - c) * cross(d - c, b - c) < 0.0);
    });
  });
  return do_cross;
}

std::vector<Overlap> overlaps_of(std::uint32_t row, const std::vector<Building>& buildings,
                                 const std::vector<RingsSteps>& walls, const BuildingIndex& index) {
  const Building& building = buildings[row];
  std::vector<Overlap> overlaps;
  for (const std::uint32_t j : index.rows_in(building.lowest_world, building.highest_world)) {
    if (j >= row) break;
    const Building& earlier = buildings[j];
    if ((building.lowest_world.array() >= earlier.highest_world.array()).any() ||
        (building.highest_world.array() <= earlier.lowest_world.array()).any())
      continue;
    const RingsSteps rings =
        about(building.footprint.rings, building.footprint.place_m, earlier.footprint.place_m);
    Overlap overlap{j, lines_along(earlier.footprint.rings, rings)};
    // Walls of neighbours that only touch are apart.
    const RingsSteps inner =
        about(walls[row], building.footprint.place_m, earlier.footprint.place_m);
    if (!overlap.lines.empty() || has_corner_in(inner, walls[j]) ||
        has_corner_in(walls[j], inner) || edges_cross(inner, walls[j]))
      overlaps.push_back(std::move(overlap));
  }
  return overlaps;
}

bool is_clear(const Overlap& overlap, int rank, int earlier_rank) {
  if (rank == earlier_rank) return false;
  const double apart_steps = (rank - earlier_rank) * kSetback_m / kHeightStep_m;
  return std::none_of(overlap.lines.begin(), overlap.lines.end(), [&](const NearLines& line) {
    return line.low_steps + apart_steps < kClear_steps &&
           line.high_steps + apart_steps > -kClear_steps;
  });
}

}  // namespace

std::vector<int> setback_ranks(const std::vector<Building>& buildings, const BuildingIndex& index) {
  std::vector<RingsSteps> walls(buildings.size());
  std::vector<std::vector<Overlap>> overlaps(buildings.size());
  const auto for_each = [&](const auto& work) {
    core::parallel_for_blocks(static_cast<std::int64_t>(buildings.size()), 64,
                              [&](std::int64_t begin, std::int64_t end) {
                                for (std::int64_t i = begin; i < end; ++i)
                                  work(static_cast<std::uint32_t>(i));
                              });
  };
  for_each([&](std::uint32_t row) {
    const RingsSteps& rings = buildings[row].footprint.rings;
    const auto inner = moved_edges(rings, -kInset_m / kHeightStep_m);
    walls[row] = inner ? *inner : rings;
  });
  for_each([&](std::uint32_t row) { overlaps[row] = overlaps_of(row, buildings, walls, index); });
  std::vector<int> ranks(buildings.size(), 0);
  for (std::size_t row = 0; row < ranks.size(); ++row) {
    const auto is_free = [&](int rank) {
      return std::all_of(overlaps[row].begin(), overlaps[row].end(), [&](const Overlap& overlap) {
        return is_clear(overlap, rank, ranks[overlap.earlier]);
      });
    };
    int& rank = ranks[row];
    while (rank < kMostRank && !is_free(rank)) ++rank;
  }
  return ranks;
}

}  // namespace terracast::tiler
