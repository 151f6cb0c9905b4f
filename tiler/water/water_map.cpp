#include "tiler/water/water_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using world::Cover;

constexpr double kCell_m = 128.0;
/// A river's area takes the level of a line that is no farther from a place.
constexpr int kRiverSearchCells = 6;

std::uint64_t cell_key(std::int64_t x, std::int64_t y) {
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(x)) << 32 |
         static_cast<std::uint32_t>(y);
}
std::int64_t cell_of(double coordinate) {
  return static_cast<std::int64_t>(std::floor(coordinate / kCell_m));
}

}  // namespace

OnPiece nearest_on(const Vector2d& a, const Vector2d& b, const Vector2d& place) {
  const Vector2d way = b - a;
  const double square = way.squaredNorm();
  const double along = square > 0.0 ? std::clamp((place - a).dot(way) / square, 0.0, 1.0) : 0.0;
  return {(place - a - along * way).norm(), along};
}

WaterMap::WaterMap(std::vector<WaterArea> areas, std::vector<RiverPiece> rivers, double half_size_m)
    : areas_(std::move(areas)), rivers_(std::move(rivers)), half_size_m_(half_size_m) {
  for (std::uint32_t k = 0; k < rivers_.size(); ++k) {
    const RiverPiece& river = rivers_[k];
    const double reach_m = kReach_m + river.half_width_m;
    each_cell(river.from_world.cwiseMin(river.to_world).array() - reach_m,
              river.from_world.cwiseMax(river.to_world).array() + reach_m,
              [&](Cell& cell) { cell.rivers.push_back(k); });
  }
  for (std::uint32_t area = 0; area < areas_.size(); ++area) add_area(area);
}

template <class Add>
void WaterMap::each_cell(const Vector2d& low, const Vector2d& high, const Add& add) {
  const double border_m = half_size_m_ + 2.0 * kReach_m;
  const std::int64_t x1 = cell_of(std::min(high.x(), border_m));
  const std::int64_t y1 = cell_of(std::min(high.y(), border_m));
  for (std::int64_t y = cell_of(std::max(low.y(), -border_m)); y <= y1; ++y)
    for (std::int64_t x = cell_of(std::max(low.x(), -border_m)); x <= x1; ++x)
      add(cells_[cell_key(x, y)]);
}

void WaterMap::add_area(std::uint32_t area) {
  AreaIndex index;
  index.low = Vector2d::Constant(std::numeric_limits<double>::infinity());
  index.high = -index.low;
  const auto first = static_cast<std::uint32_t>(edges_.size());
  for (const std::vector<Vector2d>& ring : areas_[area].rings_world)
    for (std::size_t i = 0; i < ring.size(); ++i) {
      edges_.push_back({ring[i], ring[(i + 1) % ring.size()], area});
      index.low = index.low.cwiseMin(ring[i]);
      index.high = index.high.cwiseMax(ring[i]);
    }
  const auto num_edges = static_cast<double>(edges_.size() - first);
  const double height_m = std::max(index.high.y() - index.low.y(), 1e-3);
  const auto num_bands =
      static_cast<std::size_t>(std::clamp(std::sqrt(num_edges) * 4.0, 1.0, 4096.0));
  index.band_m = height_m / static_cast<double>(num_bands);
  index.bands.resize(num_bands);
  const auto band_of = [&](double y) {
    return std::min(static_cast<std::size_t>(std::max((y - index.low.y()) / index.band_m, 0.0)),
                    num_bands - 1);
  };
  for (std::uint32_t k = first; k < edges_.size(); ++k) {
    const Edge& edge = edges_[k];
    const std::size_t last = band_of(std::max(edge.a.y(), edge.b.y()));
    for (std::size_t band = band_of(std::min(edge.a.y(), edge.b.y())); band <= last; ++band)
      index.bands[band].push_back(k);
    each_cell(edge.a.cwiseMin(edge.b).array() - kReach_m,
              edge.a.cwiseMax(edge.b).array() + kReach_m,
              [&](Cell& cell) { cell.edges.push_back(k); });
  }
  each_cell(index.low.array() - kReach_m, index.high.array() + kReach_m,
            [&](Cell& cell) { cell.areas.push_back(area); });
  indices_.push_back(std::move(index));
}

bool WaterMap::is_inside(std::uint32_t area, const Vector2d& place) const {
  const AreaIndex& index = indices_[area];
  if ((place.array() < index.low.array()).any() || (place.array() > index.high.array()).any())
    return false;
  const auto band =
      std::min(static_cast<std::size_t>(std::max((place.y() - index.low.y()) / index.band_m, 0.0)),
               index.bands.size() - 1);
  bool is_inside = false;
  for (const std::uint32_t k : index.bands[band]) {
    const Edge& edge = edges_[k];
    if ((edge.a.y() > place.y()) == (edge.b.y() > place.y())) continue;
    const double x = edge.a.x() + (edge.b.x() - edge.a.x()) * (place.y() - edge.a.y()) /
                                      (edge.b.y() - edge.a.y());
    if (x < place.x()) is_inside = !is_inside;
  }
  return is_inside;
}

const WaterMap::Cell* WaterMap::cell_at(const Vector2d& place) const {
  const auto cell = cells_.find(cell_key(cell_of(place.x()), cell_of(place.y())));
  return cell == cells_.end() ? nullptr : &cell->second;
}

double WaterMap::river_level(const Vector2d& place, double fallback_m) const {
  double nearest_m = std::numeric_limits<double>::infinity();
  double level_m = fallback_m;
  for (int ring = 0; ring <= kRiverSearchCells; ++ring) {
    // A river is in all cells within kReach_m of it.
    if (nearest_m < (ring - 1) * kCell_m + kReach_m) break;
    for (int dy = -ring; dy <= ring; ++dy)
      for (int dx = -ring; dx <= ring; ++dx) {
        if (std::max(std::abs(dx), std::abs(dy)) != ring) continue;
        const Cell* cell = cell_at(place + kCell_m * Vector2d(dx, dy));
        if (cell == nullptr) continue;
        for (const std::uint32_t k : cell->rivers) {
          const RiverPiece& river = rivers_[k];
          const OnPiece at = nearest_on(river.from_world, river.to_world, place);
          if (at.distance_m >= nearest_m) continue;
          nearest_m = at.distance_m;
          level_m = river.from_level_m + at.along * (river.to_level_m - river.from_level_m);
        }
      }
  }
  return level_m;
}

void WaterMap::find(const Vector2d& place_world, std::vector<Near>& found) const {
  found.clear();
  const Cell* cell = cell_at(place_world);
  if (cell == nullptr) return;
  for (const std::uint32_t area : cell->areas) {
    double distance_m = kReach_m;
    Vector2d nearest = place_world;
    for (const std::uint32_t k : cell->edges) {
      const Edge& edge = edges_[k];
      if (edge.area != area) continue;
      const OnPiece at = nearest_on(edge.a, edge.b, place_world);
      if (at.distance_m >= distance_m) continue;
      distance_m = at.distance_m;
      nearest = edge.a + at.along * (edge.b - edge.a);
    }
    const bool is_in = is_inside(area, place_world);
    if (!is_in && distance_m >= kReach_m) continue;
    const WaterArea& water = areas_[area];
    Near near;
    near.cover = water.is_river ? Cover::River : Cover::Lake;
    near.distance_m = is_in ? -distance_m : distance_m;
    const Vector2d& at = is_in ? place_world : nearest;
    near.level_m = water.is_river ? river_level(at, water.level_at(at)) : water.level_at(at);
    near.deepest_m = water.deepest_m;
    found.push_back(near);
  }
  const auto is_lake = [](const Near& near) { return near.cover == Cover::Lake; };
  std::stable_partition(found.begin(), found.end(), is_lake);
  // Of the rivers' pieces the nearest counts; where several hold the place, the lowest.
  std::optional<Near> river;
  for (const std::uint32_t k : cell->rivers) {
    const RiverPiece& piece = rivers_[k];
    if (!piece.is_carved) continue;
    const OnPiece at = nearest_on(piece.from_world, piece.to_world, place_world);
    const double distance_m = at.distance_m - piece.half_width_m;
    if (distance_m >= kReach_m) continue;
    const double level_m = piece.from_level_m + at.along * (piece.to_level_m - piece.from_level_m);
    if (!river || distance_m < river->distance_m) {
      river =
          Near{.cover = Cover::River,
               .distance_m = distance_m,
               .level_m = level_m,
               .deepest_m = std::clamp(0.25 * std::pow(2.0 * piece.half_width_m, 0.75), 0.3, 12.0),
               .half_width_m = piece.half_width_m};
    }
  }
  if (river) found.push_back(*river);
}

bool WaterMap::touches(const Vector2d& place_world, double radius_m) const {
  const std::int64_t x1 = cell_of(place_world.x() + radius_m);
  const std::int64_t y1 = cell_of(place_world.y() + radius_m);
  for (std::int64_t y = cell_of(place_world.y() - radius_m); y <= y1; ++y)
    for (std::int64_t x = cell_of(place_world.x() - radius_m); x <= x1; ++x) {
      const auto found = cells_.find(cell_key(x, y));
      if (found == cells_.end()) continue;
      const Cell& cell = found->second;
      for (const std::uint32_t area : cell.areas)
        if (is_inside(area, place_world)) return true;
      for (const std::uint32_t k : cell.edges)
        if (nearest_on(edges_[k].a, edges_[k].b, place_world).distance_m <= radius_m) return true;
      for (const std::uint32_t k : cell.rivers)
        if (rivers_[k].is_carved &&
            nearest_on(rivers_[k].from_world, rivers_[k].to_world, place_world).distance_m <=
                radius_m + rivers_[k].half_width_m)
          return true;
    }
  return false;
}

}  // namespace terracast::tiler
