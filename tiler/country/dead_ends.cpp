#include "tiler/country/dead_ends.h"

#include <algorithm>
#include <map>

namespace terracast::tiler::country {
namespace {

using Place = std::pair<double, double>;
constexpr double kStep_m = 4.0;
constexpr double kShore_m = 6.0;      ///< that is left between an end and the water
constexpr double kShortest_m = 25.0;  ///< what is shorter, and leads nowhere, is left out
/// A cut may leave other ways without their end: no country is known to take more than three.
constexpr int kMostRounds = 12;

Place place_of(const Point& at) { return {at.x(), at.y()}; }

/// By how much a way that ends at its last point must be shortened to end on land.
double cut_of(const PointsWorld& line, const WaterAtWays& water) {
  const double length_m = length_of(line);
  double cut_m = 0.0;
  const std::vector<StructureSpan> bridges = water.bridges(line);
  if (!bridges.empty() && bridges.back().to_m > length_m - 1.0)
    cut_m = length_m - bridges.back().from_m + kShore_m;
  double wet_m = 0.0;
  while (wet_m < length_m && water.is_wet(station_at(line, length_m - wet_m).at)) wet_m += kStep_m;
  if (wet_m > 0.0) cut_m = std::max(cut_m, wet_m + kShore_m);
  return std::min(cut_m, length_m);
}

/// Shortens a line at its end, but not beyond its last point at which another way is; empty: all of it goes.
PointsWorld shortened(const PointsWorld& line, double cut_m, const std::map<Place, int>& ways_at) {
  const double length_m = length_of(line);
  double back_m = 0.0;
  for (std::size_t k = line.size() - 1; k-- > 0;) {
    back_m += (line[k + 1] - line[k]).norm();
    if (back_m >= cut_m) break;
    if (ways_at.at(place_of(line[k])) > 1)
      return k > 0 ? PointsWorld(line.begin(), line.begin() + static_cast<std::ptrdiff_t>(k) + 1)
                   : PointsWorld{};
  }
  if (length_m - cut_m < kShortest_m) return {};
  PointsWorld kept = part_of(line, 0.0, length_m - cut_m);
  kept.back() = snapped(kept.back());
  return kept;
}

}  // namespace

void drop_unreached(std::vector<Way>& ways) {
  std::map<Place, std::size_t> first_at;
  std::vector<std::size_t> root(ways.size());
  for (std::size_t w = 0; w < ways.size(); ++w) root[w] = w;
  const auto find = [&](std::size_t w) {
    while (root[w] != w) w = root[w] = root[root[w]];
    return w;
  };
  for (std::size_t w = 0; w < ways.size(); ++w)
    for (const Point& point : ways[w].line) {
      const auto [known, is_new] = first_at.emplace(place_of(point), w);
      if (!is_new) root[find(w)] = find(known->second);
    }
  std::vector<std::uint8_t> is_reached(ways.size(), 0);
  for (std::size_t w = 0; w < ways.size(); ++w)
    if (ways[w].kind < RoadKind::Residential) is_reached[find(w)] = 1;
  std::vector<Way> kept;
  for (std::size_t w = 0; w < ways.size(); ++w)
    if (is_reached[find(w)] != 0) kept.push_back(std::move(ways[w]));
  ways = std::move(kept);
}

void retreat_from_water(std::vector<Way>& ways, const WaterAtWays& water) {
  bool is_changed = true;
  for (int round = 0; is_changed && round < kMostRounds; ++round) {
    is_changed = false;
    std::map<Place, int> ways_at;
    for (const Way& way : ways)
      for (const Point& point : way.line) ++ways_at[place_of(point)];
    for (Way& way : ways)
      for (int end = 0; end < 2 && way.line.size() > 1; ++end) {
        std::reverse(way.line.begin(), way.line.end());
        if (ways_at.at(place_of(way.line.back())) > 1) continue;
        const double cut_m = cut_of(way.line, water);
        if (cut_m == 0.0) continue;
        is_changed = true;
        PointsWorld kept = shortened(way.line, cut_m, ways_at);
        for (const Point& point : way.line) --ways_at[place_of(point)];
        for (const Point& point : kept) ++ways_at[place_of(point)];
        way.line = std::move(kept);
      }
    std::erase_if(ways, [](const Way& way) { return way.line.size() < 2; });
  }
}

}  // namespace terracast::tiler::country
