#include "tiler/country/occupancy.h"

namespace terracast::tiler::country {
namespace {

using Bounds = Occupancy::Bounds;

Bounds bounds_of(const PointsWorld& points, double margin_m) {
  Bounds bounds;
  for (const Point& point : points) {
    bounds.lowest = bounds.lowest.cwiseMin(point);
    bounds.highest = bounds.highest.cwiseMax(point);
  }
  bounds.lowest.array() -= margin_m;
  bounds.highest.array() += margin_m;
  return bounds;
}

bool is_apart(const Bounds& a, const Bounds& b) {
  return a.lowest.x() > b.highest.x() || b.lowest.x() > a.highest.x() ||
         a.lowest.y() > b.highest.y() || b.lowest.y() > a.highest.y();
}

std::size_t num_edges(const PointsWorld& points) { return points.size() == 2 ? 1 : points.size(); }

/// Whether lines or rings come nearer than the distance; a point is a line of two equal ones.
/// bounds_b   of b, with so much beside it at least
bool is_near(const PointsWorld& a, const PointsWorld& b, const Bounds& bounds_b,
             double distance_m) {
  for (std::size_t i = 0; i < num_edges(a); ++i) {
    const Point &from = a[i], &to = a[(i + 1) % a.size()];
    // Of a large ring most edges are far from a small one.
    if (is_apart({from.cwiseMin(to), from.cwiseMax(to)}, bounds_b)) continue;
    for (std::size_t j = 0; j < num_edges(b); ++j)
      if (distance_of_segments(from, to, b[j], b[(j + 1) % b.size()]) < distance_m) return true;
  }
  return (a.size() > 2 && contains(a, b[0])) || (b.size() > 2 && contains(b, a[0]));
}

}  // namespace

void Occupancy::add_ring(const PointsWorld& ring, unsigned use) {
  if (ring.size() < 3) return;
  const Bounds bounds = bounds_of(ring, 0.0);
  index_.add(static_cast<std::int32_t>(items_.size()), bounds.lowest, bounds.highest);
  items_.push_back({ring, 0.0, use, bounds});
}

void Occupancy::add_line(const PointsWorld& line, double half_width_m, unsigned use) {
  for (std::size_t i = 1; i < line.size(); ++i) {
    const Bounds bounds = bounds_of({line[i - 1], line[i]}, half_width_m);
    index_.add(static_cast<std::int32_t>(items_.size()), bounds.lowest, bounds.highest);
    items_.push_back({{line[i - 1], line[i]}, half_width_m, use, bounds});
  }
}

bool Occupancy::is_free(const PointsWorld& ring, double margin_m, unsigned uses) const {
  const Bounds bounds = bounds_of(ring, margin_m);
  index_.find(bounds.lowest, bounds.highest, found_);
  for (const std::int32_t index : found_) {
    const Item& item = items_[static_cast<std::size_t>(index)];
    if ((item.use & uses) == 0 || is_apart(bounds, item.bounds)) continue;
    // What is added for roundings, and a little more.
    const double beside_m = margin_m + 2e-6;
    const Bounds near{item.bounds.lowest.array() - beside_m,
                      item.bounds.highest.array() + beside_m};
    if (is_near(ring, item.points, near, margin_m + item.half_width_m + 1e-6)) return false;
  }
  return true;
}

bool Occupancy::is_free(const Point& from, const Point& to, double margin_m, unsigned uses) const {
  return is_free(PointsWorld{from, to}, margin_m, uses);
}

}  // namespace terracast::tiler::country
