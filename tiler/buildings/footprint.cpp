#include "tiler/buildings/footprint.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "core/error.h"
#include "tiler/buildings/setback.h"
#include "tiler/country/plan_geometry.h"
#include "tiler/roofs/inner_polygons.h"
#include "tiler/roofs/triangulation.h"
#include "world/tile.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2i;
using world::kHeightStep_m;

/// Corners lie on a lattice so wide, that nothing smaller than its own rounding is left of a
/// footprint.
constexpr int kSnap_steps = 16;
/// A corner that is so near the line between its neighbours is none, m.
constexpr double kStraight_m = 0.04;
/// Corners keep so far from edges: more than twice of what the world's lattice moves them by.
constexpr int kClearance_steps = 8;
constexpr std::size_t kMostRead = 20'000;
constexpr std::size_t kMostKept = 400;
constexpr double kSmallest_m2 = 4.0;
constexpr double kSmallestHole_m2 = 2.0;
constexpr double kWidest_m = 4000.0;
/// Corners that move farther than so many times their edges are too sharp.
constexpr double kSharpest = 8.0;
constexpr double kMostInset_steps = steps(kMostInset_m);
/// Of the sharpest ones: those that are rounded may be a little sharper.
constexpr double kBlunt = 1.1;
constexpr double kCut_steps = 64.0;
/// In which what cannot move is looked for farther inside, at last 2 m.
constexpr int kMostRounds = 7;

double to_line(const Vector2d& at, const Vector2d& a, const Vector2d& b) {
  const Vector2d along = b - a;
  const double length = along.norm();
  if (length == 0.0) return (at - a).norm();
  const double t = std::clamp((at - a).dot(along) / (length * length), 0.0, 1.0);
  return (at - a - t * along).norm();
}

/// Without points that are nearly on the line between those kept before and after them, and without
/// spikes; what is kept strays from the ring by little more than the tolerance.
std::vector<Vector2d> simplified(const std::vector<Vector2d>& ring, double tolerance_m) {
  std::vector<Vector2d> kept;
  for (const Vector2d& point : ring) {
    while (!kept.empty() && (point - kept.back()).norm() < tolerance_m) kept.pop_back();
    while (kept.size() >= 2 && to_line(kept.back(), kept[kept.size() - 2], point) < tolerance_m)
      kept.pop_back();
    // Back along the edge on which it came: a spike.
    while (kept.size() >= 2 && to_line(point, kept[kept.size() - 2], kept.back()) < tolerance_m)
      kept.pop_back();
    kept.push_back(point);
  }
  bool changed = true;
  while (changed && kept.size() >= 3) {
    changed = false;
    const std::size_t n = kept.size();
    if ((kept.front() - kept.back()).norm() < tolerance_m ||
        to_line(kept.back(), kept[n - 2], kept.front()) < tolerance_m) {
      kept.pop_back();
      changed = true;
    } else if (to_line(kept.front(), kept.back(), kept[1]) < tolerance_m) {
      kept.erase(kept.begin());
      changed = true;
    }
  }
  return kept;
}

/// A ring of very many points with fewer, none of the others farther from it than the tolerance:
/// where steps are finer than the tolerance, to go from point to point strays.
std::vector<Vector2d> coarser(const std::vector<Vector2d>& ring, double tolerance_m) {
  std::vector<Vector2d> closed = ring;
  closed.push_back(ring.front());
  std::size_t farthest = 0;
  for (std::size_t i = 1; i < ring.size(); ++i)
    if ((ring[i] - ring[0]).squaredNorm() > (ring[farthest] - ring[0]).squaredNorm()) farthest = i;
  const std::span<const Vector2d> all(closed);
  std::vector<Vector2d> kept = country::simplified(all.first(farthest + 1), tolerance_m);
  const std::vector<Vector2d> back = country::simplified(all.subspan(farthest), tolerance_m);
  kept.insert(kept.end(), back.begin() + 1, back.end() - 1);
  return kept;
}

int snapped(double value_m) {
  return kSnap_steps * static_cast<int>(std::lround(value_m / (kSnap_steps * kHeightStep_m)));
}

std::vector<Vector2i> turned(std::vector<Vector2i> ring, bool anticlockwise) {
  if ((doubled_area(ring) > 0.0) != anticlockwise) std::reverse(ring.begin(), ring.end());
  // From its first corner by place, so that where a source begins a ring does not matter.
  const auto first =
      std::min_element(ring.begin(), ring.end(), [](const Vector2i& a, const Vector2i& b) {
        return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
      });
  std::rotate(ring.begin(), first, ring.end());
  return ring;
}

double ring_area_m2(const std::vector<Vector2i>& ring) {
  return 0.5 * std::abs(doubled_area(ring)) * kHeightStep_m * kHeightStep_m;
}

bool ring_contains(const std::vector<Vector2i>& ring, const Vector2d& at) {
  bool is_in = false;
  for (std::size_t i = 0, j = ring.size() - 1; i < ring.size(); j = i++) {
    const Vector2d a = ring[i].cast<double>();
    const Vector2d b = ring[j].cast<double>();
    if ((a.y() > at.y()) != (b.y() > at.y()) &&
        at.x() < (b.x() - a.x()) * (at.y() - a.y()) / (b.y() - a.y()) + a.x())
      is_in = !is_in;
  }
  return is_in;
}

/// Whether no corner is nearer to an edge, other than its own, than what rounding in the world may
/// move.
bool has_clearance(const RingsSteps& rings) {
  for (std::size_t r = 0; r < rings.size(); ++r)
    for (std::size_t c = 0; c < rings[r].size(); ++c)
      for (std::size_t s = 0; s < rings.size(); ++s)
        for (std::size_t i = 0; i < rings[s].size(); ++i) {
          const std::size_t j = (i + 1) % rings[s].size();
          if (r == s && (c == i || c == j)) continue;
          const Vector2i& at = rings[r][c];
          const Vector2i& a = rings[s][i];
          const Vector2i& b = rings[s][j];
          if ((at.array() < a.array().min(b.array()) - kClearance_steps).any() ||
              (at.array() > a.array().max(b.array()) + kClearance_steps).any())
            continue;
          if (to_line(at.cast<double>(), a.cast<double>(), b.cast<double>()) < kClearance_steps)
            return false;
        }
  return true;
}

bool can_stand_back(const RingsSteps& rings) {
  return has_clearance(rings) && moved_edges(rings, -kMostInset_steps).has_value();
}

/// Without points that are nearly on the line between others; a hole that has none left is none.
RingsSteps simplified(const RingsSteps& rings, double tolerance_steps) {
  RingsSteps kept;
  for (const auto& ring : rings) {
    std::vector<Vector2d> points;
    for (const Vector2i& corner : ring) points.push_back(corner.cast<double>());
    points = simplified(points, tolerance_steps);
    if (points.size() < 3 && kept.empty()) return {};
    if (points.size() < 3) continue;
    kept.emplace_back();
    for (const Vector2d& point : points) kept.back().push_back(point.cast<int>());
  }
  return kept;
}

/// Corners too sharp to move are cut off where they are kCut_steps wide; of one whose edges end
/// before, nothing is left.
RingsSteps blunted(const RingsSteps& rings) {
  RingsSteps blunt;
  for (const auto& ring : rings) {
    blunt.emplace_back();
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Vector2d at = ring[i].cast<double>();
      const Vector2d back = ring[(i + ring.size() - 1) % ring.size()].cast<double>() - at;
      const Vector2d on = ring[(i + 1) % ring.size()].cast<double>() - at;
      const double half_sine =
          std::sqrt(std::max(0.5 - 0.5 * back.normalized().dot(on.normalized()), 0.0));
      if (half_sine * kSharpest >= kBlunt) {
        blunt.back().push_back(ring[i]);
        continue;
      }
      const double cut = 0.5 * kCut_steps / half_sine;
      if (!(cut < 0.5 * std::min(back.norm(), on.norm()))) continue;
      for (const Vector2d& edge : {back, on})
        blunt.back().push_back((at + cut * edge.normalized()).array().round().cast<int>());
    }
    if (blunt.back().size() >= 3) continue;
    if (blunt.size() == 1) return {};
    blunt.pop_back();
  }
  return blunt;
}

/// Of what has moved inward all that can move out again by kMostInset_steps; of the rest what is
/// farther inside.
void move_out(const RingsSteps& inner, int round, std::vector<RingsSteps>& polygons) {
  const double finer_steps = kSnap_steps << round;
  const RingsSteps few = blunted(simplified(inner, finer_steps));
  if (few.empty()) return;
  if (is_valid(few))
    if (const auto moved = moved_edges(few, kMostInset_steps); moved && can_stand_back(*moved)) {
      polygons.push_back(*moved);
      return;
    }
  if (round == kMostRounds) return;
  for (const RingsSteps& farther : polygons_within(inner, finer_steps))
    move_out(farther, round + 1, polygons);
}

/// What of a polygon is wide enough for walls that stand back: necks and corners that are narrower
/// are gone, and slits are wider.
std::vector<RingsSteps> with_room(const RingsSteps& polygon, FootprintCounts& counts) {
  if (can_stand_back(polygon)) return {polygon};
  ++counts.num_narrow;
  std::vector<RingsSteps> polygons;
  try {
    for (const RingsSteps& inner : polygons_within(polygon, kMostInset_steps))
      move_out(inner, 0, polygons);
  } catch (const core::Error& error) {
    // What CGAL cannot order has no area that counts, as in repaired().
    if (error.kind() != core::ErrorKind::Internal) throw;
    return {};
  }
  return polygons;
}

}  // namespace

std::vector<Footprint> footprints_of(const std::vector<PointsWorld>& rings_world,
                                     FootprintCounts& counts) {
  if (rings_world.empty() || rings_world.front().size() < 3) {
    ++counts.num_too_small;
    return {};
  }
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Vector2d lowest = Vector2d::Constant(kInfinity);
  Vector2d highest = -lowest;
  for (const Vector2d& point : rings_world.front()) {
    lowest = lowest.cwiseMin(point);
    highest = highest.cwiseMax(point);
  }
  if (!((highest - lowest).maxCoeff() <= kWidest_m)) {
    ++counts.num_too_large;
    return {};
  }
  Footprint whole;
  whole.place_m = (0.5 * (lowest + highest)).array().floor().cast<int>();
  std::vector<std::vector<Vector2d>> rings;
  std::size_t num_read = 0;
  for (const PointsWorld& ring : rings_world) num_read += ring.size();
  const std::size_t stride = num_read / kMostRead + 1;
  for (const PointsWorld& ring : rings_world) {
    rings.emplace_back();
    for (std::size_t i = 0; i < ring.size(); i += stride)
      // A hole may lie anywhere.
      if ((ring[i].array() >= lowest.array() - kWidest_m).all() &&
          (ring[i].array() <= highest.array() + kWidest_m).all())
        rings.back().push_back(ring[i] - whole.place_m.cast<double>());
  }
  std::size_t num_kept = 0;
  for (double tolerance_m = kStraight_m;; tolerance_m *= 1.6) {
    num_kept = 0;
    for (auto& ring : rings) {
      if (ring.size() > kMostKept) ring = coarser(ring, tolerance_m);
      if (ring.size() <= kMostKept) ring = simplified(ring, tolerance_m);
      num_kept += ring.size() < 3 ? 0 : ring.size();
    }
    if (num_kept <= kMostKept) break;
    if (tolerance_m == kStraight_m) ++counts.num_simplified;
  }
  for (std::size_t k = 0; k < rings.size(); ++k) {
    std::vector<Vector2i> ring;
    for (const Vector2d& point : rings[k]) {
      const Vector2i at(snapped(point.x()), snapped(point.y()));
      if (ring.empty() || ring.back() != at) ring.push_back(at);
    }
    while (ring.size() > 1 && ring.front() == ring.back()) ring.pop_back();
    if (k == 0 && ring.size() < 3) {
      ++counts.num_too_small;
      return {};
    }
    if (ring.size() >= 3 && (k == 0 || ring_area_m2(ring) >= kSmallestHole_m2))
      whole.rings.push_back(turned(std::move(ring), k == 0));
  }
  std::vector<RingsSteps> polygons;
  if (is_valid(whole.rings)) {
    polygons.push_back(std::move(whole.rings));
  } else {
    polygons = repaired(whole.rings);
    ++counts.num_repaired;
  }
  std::vector<Footprint> footprints;
  for (const RingsSteps& polygon : polygons)
    for (RingsSteps& roomy : with_room(polygon, counts)) {
      Footprint footprint{whole.place_m, {}};
      for (std::size_t k = 0; k < roomy.size(); ++k)
        if (k == 0 || ring_area_m2(roomy[k]) >= kSmallestHole_m2)
          footprint.rings.push_back(turned(std::move(roomy[k]), k == 0));
      if (area_m2(footprint.rings) >= kSmallest_m2) footprints.push_back(std::move(footprint));
    }
  std::stable_sort(footprints.begin(), footprints.end(), [](const auto& one, const auto& other) {
    return area_m2(one.rings) > area_m2(other.rings);
  });
  if (footprints.empty()) ++counts.num_too_small;
  return footprints;
}

std::optional<RingsSteps> moved_edges(const RingsSteps& rings,
                                      const std::vector<double>& by_steps) {
  RingsSteps moved = rings;
  std::size_t first = 0;
  for (std::size_t r = 0; r < rings.size(); ++r) {
    const auto& ring = rings[r];
    const std::size_t n = ring.size();
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t before = (i + n - 1) % n;
      const Vector2d at = ring[i].cast<double>();
      const Vector2d in = (at - ring[before].cast<double>()).normalized();
      const Vector2d out = (ring[(i + 1) % n].cast<double>() - at).normalized();
      // Outside is on the right, in holes too.
      const Vector2d normal_in(in.y(), -in.x());
      const Vector2d normal_out(out.y(), -out.x());
      const double by_in = by_steps[first + before];
      const double by_out = by_steps[first + i];
      const double sine = in.x() * out.y() - in.y() * out.x();
      Vector2d offset;
      if (std::abs(sine) < 0.02) {
        if (in.dot(out) < 0.0 || std::abs(by_in - by_out) > 1.0) return std::nullopt;
        offset = by_in * normal_in;
      } else {
        // normal_in . offset = by_in, normal_out . offset = by_out.
        offset = (by_out * in - by_in * out) / sine;
      }
      const double most = std::max(std::abs(by_in), std::abs(by_out));
      if (!(offset.norm() <= kSharpest * most + 1e-9)) return std::nullopt;
      moved[r][i] = (at + offset).array().round().cast<int>();
    }
    for (std::size_t i = 0; i < n; ++i) {
      const Vector2d was = (ring[(i + 1) % n] - ring[i]).cast<double>();
      const Vector2d is = (moved[r][(i + 1) % n] - moved[r][i]).cast<double>();
      if (is.dot(was) <= 0.0 || is.norm() < kSnap_steps) return std::nullopt;
    }
    first += n;
  }
  if (!is_valid(moved)) return std::nullopt;
  return moved;
}

std::optional<RingsSteps> moved_edges(const RingsSteps& rings, double by_steps) {
  return moved_edges(rings, std::vector<double>(num_corners(rings), by_steps));
}

std::size_t num_corners(const RingsSteps& rings) {
  std::size_t sum = 0;
  for (const auto& ring : rings) sum += ring.size();
  return sum;
}

double area_m2(const RingsSteps& rings) {
  double sum = 0.0;
  for (std::size_t k = 0; k < rings.size(); ++k)
    sum += (k == 0 ? 1.0 : -1.0) * ring_area_m2(rings[k]);
  return sum;
}

bool contains(const RingsSteps& rings, const Vector2d& at_steps) {
  if (!ring_contains(rings.front(), at_steps)) return false;
  for (std::size_t k = 1; k < rings.size(); ++k)
    if (ring_contains(rings[k], at_steps)) return false;
  return true;
}

double distance_to_edges(const RingsSteps& rings, const Vector2d& at_steps) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& ring : rings)
    for (std::size_t i = 0; i < ring.size(); ++i)
      nearest = std::min(nearest, to_line(at_steps, ring[i].cast<double>(),
                                          ring[(i + 1) % ring.size()].cast<double>()));
  return nearest;
}

Rectangle rectangle_round(const std::vector<Vector2i>& ring) {
  Rectangle best{{0, 0}, {1, 0}, 0, 0};
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Vector2d along = (ring[(i + 1) % ring.size()] - ring[i]).cast<double>().normalized();
    const Vector2d across(-along.y(), along.x());
    Vector2d low = Vector2d::Constant(std::numeric_limits<double>::infinity());
    Vector2d high = -low;
    for (const Vector2i& point : ring) {
      const Vector2d at(along.dot(point.cast<double>()), across.dot(point.cast<double>()));
      low = low.cwiseMin(at);
      high = high.cwiseMax(at);
    }
    const Vector2d size = high - low;
    if (size.prod() >= least * (1.0 - 1e-9)) continue;
    least = size.prod();
    const Vector2d middle = 0.5 * (low + high);
    best.middle_steps = middle.x() * along + middle.y() * across;
    best.along = size.x() >= size.y() ? along : across;
    best.length_steps = size.maxCoeff();
    best.width_steps = size.minCoeff();
  }
  return best;
}

RingsSteps block_of(const RingsSteps& rings) {
  if (num_corners(rings) <= 6) return rings;
  const Rectangle box = rectangle_round(rings.front());
  const double area = area_m2({rings.front()}) / (kHeightStep_m * kHeightStep_m);
  const double shrink = std::sqrt(area / (box.length_steps * box.width_steps));
  const Vector2d along = 0.5 * shrink * box.length_steps * box.along;
  const Vector2d across = 0.5 * shrink * box.width_steps * Vector2d(-box.along.y(), box.along.x());
  RingsSteps block = {{}};
  for (const auto& [a, b] : {std::pair(-1, -1), {1, -1}, {1, 1}, {-1, 1}})
    block[0].push_back((box.middle_steps + a * along + b * across).array().round().cast<int>());
  return block;
}

}  // namespace terracast::tiler
