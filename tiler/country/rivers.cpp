#include "tiler/country/rivers.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace terracast::tiler::country {
namespace {

constexpr double kStream_m2 = 3e6;
constexpr double kRiver_m2 = 1.8e7;
constexpr double kLakeDepth_m = 4.0;
constexpr double kLakeArea_m2 = 60000.0;
constexpr double kPiece_m = 1800.0;

/// A river of the temperate zone: 4 m at 10 km2, 13 m at 100 km2, 45 m at 1000 km2.
double width_m(double catchment_m2) {
  return std::clamp(1.3 * std::sqrt(catchment_m2 * 1e-6), 2.0, 60.0);
}

}  // namespace

Grid<std::uint8_t> river_nodes(const PlanGround& ground) {
  const double cell_m2 = ground.spacing_m() * ground.spacing_m();
  Grid<std::uint8_t> nodes(ground.side(), ground.side());
  for (std::size_t node = 0; node < nodes.values.size(); ++node)
    nodes.values[node] =
        static_cast<double>(ground.flow().area[node]) * cell_m2 >= kRiver_m2 ? 1 : 0;
  return nodes;
}

std::vector<River> find_rivers(const PlanGround& ground) {
  const FlowRouting& flow = ground.flow();
  const double cell_m2 = ground.spacing_m() * ground.spacing_m();
  const auto catchment_m2 = [&](std::int32_t cell) {
    return static_cast<double>(flow.area[static_cast<std::size_t>(cell)]) * cell_m2;
  };
  const auto is_sea = [&](std::int32_t cell) {
    return ground.is_sea().values[static_cast<std::size_t>(cell)] != 0;
  };
  const int side = ground.side();
  // The largest of the cells that drain into one goes on its river.
  const std::size_t count = flow.receiver.size();
  std::vector<std::int32_t> main_above(count, -1);
  for (std::size_t k = 0; k < count; ++k) {
    const auto cell = static_cast<std::int32_t>(k);
    const std::int32_t below = flow.receiver[k];
    if (below == cell || is_sea(cell) || catchment_m2(cell) < kStream_m2) continue;
    std::int32_t& known = main_above[static_cast<std::size_t>(below)];
    if (known < 0 || flow.area[k] > flow.area[static_cast<std::size_t>(known)]) known = cell;
  }
  std::vector<River> rivers;
  std::vector<std::int32_t> place_of(count, -1);
  PointsWorld places;
  // Cells after those they drain to: mouths first, then tributaries.
  for (const std::int32_t mouth : flow.order) {
    if (is_sea(mouth) || catchment_m2(mouth) < kStream_m2 ||
        place_of[static_cast<std::size_t>(mouth)] >= 0)
      continue;
    const std::int32_t below = flow.receiver[static_cast<std::size_t>(mouth)];
    std::vector<std::int32_t> cells;  // upstream
    if (below != mouth) cells.push_back(below);
    for (std::int32_t cell = mouth; cell >= 0; cell = main_above[static_cast<std::size_t>(cell)])
      cells.push_back(cell);
    if (cells.size() < 8) continue;
    PointsWorld line;
    for (const std::int32_t cell : cells) line.push_back(ground.place(cell % side, cell / side));
    if (below != mouth && place_of[static_cast<std::size_t>(below)] >= 0)
      line.front() = places[static_cast<std::size_t>(place_of[static_cast<std::size_t>(below)])];
    for (int round = 0; round < 3; ++round) {
      PointsWorld moved = line;
      for (std::size_t k = 1; k + 1 < line.size(); ++k)
        moved[k] = 0.25 * line[k - 1] + 0.5 * line[k] + 0.25 * line[k + 1];
      line = std::move(moved);
    }
    for (std::size_t k = 0; k < line.size(); ++k) {
      line[k] = snapped(line[k]);
      std::int32_t& place = place_of[static_cast<std::size_t>(cells[k])];
      if (place < 0) {
        place = static_cast<std::int32_t>(places.size());
        places.push_back(line[k]);
      }
    }
    std::reverse(line.begin(), line.end());
    std::reverse(cells.begin(), cells.end());
    // Pieces of one width each.
    std::size_t begin = 0;
    while (begin + 1 < line.size()) {
      std::size_t end = begin + 1;
      double length = (line[end] - line[begin]).norm();
      const bool is_stream = catchment_m2(cells[begin]) < kRiver_m2;
      while (end + 1 < line.size() && (length < kPiece_m || end + 12 > line.size()) &&
             (is_stream == (catchment_m2(cells[end]) < kRiver_m2) || end + 12 > line.size())) {
        length += (line[end + 1] - line[end]).norm();
        ++end;
      }
      River river;
      river.line = splined(std::span<const Point>(line.data() + begin, end - begin + 1), 1);
      river.width_m = std::round(2.0 * width_m(catchment_m2(cells[begin]))) / 2.0;
      river.is_stream = is_stream;
      rivers.push_back(std::move(river));
      begin = end;
    }
  }
  return rivers;
}

std::vector<PointsWorld> find_lakes(const PlanGround& ground) {
  const FlowRouting& flow = ground.flow();
  const Grid<float>& heights = ground.heights_m();
  const int side = ground.side();
  const double cell_m2 = ground.spacing_m() * ground.spacing_m();
  const auto depth_of = [&](int i, int j) {
    const std::size_t node = heights.index(i, j);
    return ground.is_sea().values[node] != 0 ? 0.0F
                                             : flow.filled_m.values[node] - heights.values[node];
  };
  // Regions that are deep enough somewhere.
  std::vector<std::int32_t> region(heights.values.size(), -1);
  std::vector<PointsWorld> outlines;
  for (int j0 = 1; j0 + 1 < side; ++j0)
    for (int i0 = 1; i0 + 1 < side; ++i0) {
      if (region[heights.index(i0, j0)] >= 0 || depth_of(i0, j0) < 0.3F) continue;
      const auto number = static_cast<std::int32_t>(heights.index(i0, j0));
      std::vector<std::pair<int, int>> open{{i0, j0}}, members;
      region[heights.index(i0, j0)] = number;
      double deepest = 0.0;
      while (!open.empty()) {
        const auto [i, j] = open.back();
        open.pop_back();
        members.emplace_back(i, j);
        deepest = std::max(deepest, static_cast<double>(depth_of(i, j)));
        for (const auto& [di, dj] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
          const int ni = i + di, nj = j + dj;
          if (ni < 1 || nj < 1 || ni + 1 >= side || nj + 1 >= side ||
              region[heights.index(ni, nj)] >= 0 || depth_of(ni, nj) < 0.3F)
            continue;
          region[heights.index(ni, nj)] = number;
          open.emplace_back(ni, nj);
        }
      }
      if (deepest < kLakeDepth_m || static_cast<double>(members.size()) * cell_m2 < kLakeArea_m2)
        continue;
      // Its border, cell by cell, then smoothed: edges of the nodes' squares with the lake on their left.
      std::map<std::pair<int, int>, std::vector<std::pair<int, int>>> next;
      const auto is_member = [&](int i, int j) { return region[heights.index(i, j)] == number; };
      for (const auto& [i, j] : members) {
        if (!is_member(i, j - 1)) next[{i, j}].push_back({i + 1, j});
        if (!is_member(i + 1, j)) next[{i + 1, j}].push_back({i + 1, j + 1});
        if (!is_member(i, j + 1)) next[{i + 1, j + 1}].push_back({i, j + 1});
        if (!is_member(i - 1, j)) next[{i, j + 1}].push_back({i, j});
      }
      PointsWorld longest;
      while (!next.empty()) {
        PointsWorld ring;
        std::pair<int, int> at = next.begin()->first;
        while (true) {
          const auto found = next.find(at);
          if (found == next.end()) break;
          ring.push_back(ground.place(0, 0) +
                         ground.spacing_m() * Point(at.first - 0.5, at.second - 0.5));
          at = found->second.back();
          found->second.pop_back();
          if (found->second.empty()) next.erase(found);
        }
        if (signed_area(ring) > (longest.empty() ? 0.0 : signed_area(longest)))
          longest = std::move(ring);
      }
      for (int round = 0; round < 3; ++round) {
        PointsWorld moved = longest;
        for (std::size_t k = 0; k < longest.size(); ++k)
          moved[k] = 0.25 * longest[(k + longest.size() - 1) % longest.size()] + 0.5 * longest[k] +
                     0.25 * longest[(k + 1) % longest.size()];
        longest = std::move(moved);
      }
      for (Point& corner : longest) corner = snapped(corner);
      if (longest.size() >= 8 && is_simple(longest)) outlines.push_back(std::move(longest));
    }
  return outlines;
}

}  // namespace terracast::tiler::country
