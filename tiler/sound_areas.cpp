#include "tiler/sound_areas.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "tiler/even_odd.h"
#include "tiler/roofs/triangulation.h"
#include "world/tile_id.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2i;
using world::kHeightStep_m;

constexpr std::size_t kManyCorners = 2000;
constexpr double kCrowded_m = 0.25;
/// Farther apart steps are no numbers of 32 bits whose products have 64.
constexpr double kWidest_m = 500'000.0;

using Edges = std::vector<std::array<Vector2i, 2>>;

Edges edges_of(const std::vector<Vector2i>& ring) {
  Edges edges;
  for (std::size_t i = 0; i < ring.size(); ++i)
    edges.push_back({ring[i], ring[(i + 1) % ring.size()]});
  return edges;
}

double ring_m2(const PointsWorld& ring) {
  double twice = 0.0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Vector2d a = ring[i] - ring.front();
    const Vector2d b = ring[(i + 1) % ring.size()] - ring.front();
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return 0.5 * std::abs(twice);
}

}  // namespace

PointsWorld without_crowded_corners(PointsWorld ring) {
  if (ring.size() < kManyCorners) return ring;
  PointsWorld kept;
  for (const Vector2d& at : ring)
    if (kept.empty() || (at - kept.back()).norm() >= kCrowded_m) kept.push_back(at);
  return kept;
}

std::optional<std::vector<std::vector<PointsWorld>>> repaired_area(
    const std::vector<PointsWorld>& rings) {
  if (rings.empty()) return std::nullopt;
  Vector2d low = Vector2d::Constant(std::numeric_limits<double>::infinity());
  Vector2d high = -low;
  for (const PointsWorld& ring : rings)
    for (const Vector2d& at : ring) {
      low = low.cwiseMin(at);
      high = high.cwiseMax(at);
    }
  if (!((high - low).maxCoeff() <= kWidest_m)) return std::nullopt;
  const Vector2d place = (0.5 * (low + high)).array().floor();
  RingsSteps sound;
  for (const PointsWorld& ring : rings) {
    std::vector<Vector2i> corners;
    for (const Vector2d& at : ring) {
      const Vector2i steps = ((at - place) / kHeightStep_m).array().round().cast<int>();
      if (corners.empty() || corners.back() != steps) corners.push_back(steps);
    }
    while (corners.size() > 1 && corners.front() == corners.back()) corners.pop_back();
    if (corners.size() < 3) {
      if (sound.empty()) return std::nullopt;
      continue;
    }
    if ((doubled_area(corners) > 0.0) != sound.empty())
      std::reverse(corners.begin(), corners.end());
    sound.push_back(std::move(corners));
  }
  if (is_valid(sound)) return std::nullopt;

  Edges edges;
  const Edges of_outer = edges_of(sound.front());
  std::vector<EvenOdd> holes;
  for (std::size_t k = 0; k < sound.size(); ++k) {
    const Edges own = edges_of(sound[k]);
    edges.insert(edges.end(), own.begin(), own.end());
    if (k > 0) holes.emplace_back(own);
  }
  const EvenOdd outer(of_outer);
  std::vector<std::vector<PointsWorld>> polygons;
  for (const RingsSteps& polygon : polygons_where(edges, [&](const Vector2d& at) {
         return outer.contains(at) &&
                std::none_of(holes.begin(), holes.end(),
                             [&](const EvenOdd& hole) { return hole.contains(at); });
       })) {
    polygons.emplace_back();
    for (const std::vector<Vector2i>& ring : polygon) {
      polygons.back().emplace_back();
      for (const Vector2i& at : ring)
        polygons.back().back().push_back(place + kHeightStep_m * at.cast<double>());
    }
  }
  return polygons;
}

double enclosed_m2(const std::vector<PointsWorld>& rings) {
  const auto area_of = [](const std::vector<PointsWorld>& polygon) {
    double sum_m2 = 0.0;
    for (std::size_t k = 0; k < polygon.size(); ++k)
      sum_m2 += (k == 0 ? 1.0 : -1.0) * ring_m2(polygon[k]);
    return sum_m2;
  };
  const auto repaired = repaired_area(rings);
  if (!repaired) return area_of(rings);
  double sum_m2 = 0.0;
  for (const auto& polygon : *repaired) sum_m2 += area_of(polygon);
  return sum_m2;
}

}  // namespace terracast::tiler
