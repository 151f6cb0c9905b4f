#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "tiler/country/lots.h"

namespace terracast::tiler::country {
namespace {

constexpr std::uint64_t kDrawStream = 0x6c6f7473 + 20;
constexpr double kSteepest = 0.24;  ///< of the ground under a house

}  // namespace

std::uint64_t Builder::core_draw(std::uint64_t count) const {
  return core::random_bits(seed_, kDrawStream, count);
}

bool Builder::build(const PointsWorld& footprint, HouseKind kind, int palette, double width_m,
                    double margin_m, Tags more) {
  PointsWorld ring;
  for (const Point& corner : footprint) ring.push_back(snapped(corner));
  double span_m = 0.0;
  for (const Point& corner : ring) span_m = std::max(span_m, (corner - ring.front()).norm());
  if (ground_.rise_m(ring) > kSteepest * span_m || !ground_.is_dry(ring)) return false;
  // Walls keep off carriageways even where houses may touch each other.
  if (!occupancy_.is_free(ring, margin_m) ||
      !occupancy_.is_free(ring, std::max(margin_m, 0.5), kRoad | kRail | kWater))
    return false;
  if (!is_simple(ring) || signed_area(ring) < 4.0) return false;
  const std::uint64_t chosen = draw();
  // Tags that are given come first: of two of a key FeatureTags keeps the first.
  Tags tags = std::move(more);
  for (auto& tag : building_tags(kind, manner_, palette, width_m, chosen))
    tags.push_back(std::move(tag));
  survey_.add_area(Theme::Building, ring, std::move(tags));
  occupancy_.add_ring(ring, kBuilding);
  ++num_buildings_;
  return true;
}

bool Builder::reserve(const PointsWorld& ring, double margin_m, Theme theme, Tags tags,
                      double steepest) {
  double span_m = 0.0;
  for (const Point& corner : ring) span_m = std::max(span_m, (corner - ring.front()).norm());
  if (ground_.rise_m(ring) > steepest * span_m || !ground_.is_dry(ring) ||
      !occupancy_.is_free(ring, margin_m))
    return false;
  survey_.add_area(theme, ring, std::move(tags));
  occupancy_.add_ring(ring, kReserved);
  return true;
}

std::optional<Rectangle> Builder::find_spot(const Point& near, const Point& along, double length_m,
                                            double depth_m, double farthest_m,
                                            double margin_m) const {
  const double step_m = std::max(0.22 * std::min(length_m, depth_m), 8.0);
  const int rings = std::min(static_cast<int>(farthest_m / step_m), 60);
  for (int ring = 0; ring <= rings; ++ring)
    for (int j = -ring; j <= ring; ++j)
      for (int i = -ring; i <= ring; ++i) {
        if (std::max(std::abs(i), std::abs(j)) != ring) continue;
        for (const Point& direction : {along, left_of(along)}) {
          const Rectangle box{near + step_m * Point(i, j), direction, 0.5 * length_m,
                              0.5 * depth_m};
          if (!ground_.is_in_square(box.center, 80.0) || !occupancy_.is_free(box.center, 1.0))
            continue;
          const PointsWorld corners = box.ring();
          if (ground_.rise_m(corners) < 0.1 * (length_m + depth_m) &&
              occupancy_.is_free(corners, margin_m) && ground_.is_dry(corners))
            return box;
        }
      }
  return std::nullopt;
}

}  // namespace terracast::tiler::country
