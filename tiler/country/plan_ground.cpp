#include "tiler/country/plan_ground.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "geo/geodesy.h"
#include "tiler/surface.h"
#include "tiler/void_filling.h"

namespace terracast::tiler::country {
namespace {

constexpr double kSpacing_m = 32.0;
constexpr double kMostNodes = 2048.0;  ///< along a side
constexpr double kHeightLattice_m = 0x1.0p-6;

}  // namespace

PlanGround::PlanGround(const WorldSurface& surface)
    : surface_(surface), half_size_m_(surface.options().size_m / 2.0) {
  spacing_m_ = kSpacing_m;
  while (2.0 * half_size_m_ / spacing_m_ > kMostNodes) spacing_m_ *= 2.0;
  const int reach = std::max(static_cast<int>(std::floor(half_size_m_ / spacing_m_)), 2);
  half_grid_m_ = reach * spacing_m_;
  const int nodes = 2 * reach + 1;
  heights_m_ = Grid<float>(nodes, nodes);
  is_sea_ = Grid<std::uint8_t>(nodes, nodes);
  core::parallel_for(nodes, [&](std::int64_t row) {
    const int j = static_cast<int>(row);
    for (int i = 0; i < nodes; ++i) {
      const Point at = place(i, j);
      const SurfaceSample ground = surface_.sample(at.x(), at.y());
      const double height_m =
          ground.z_world + at.squaredNorm() / (2.0 * geo::kWgs84SemiMajorAxis_m);
      heights_m_(i, j) =
          static_cast<float>(std::round(height_m / kHeightLattice_m) * kHeightLattice_m);
      is_sea_(i, j) = ground.cover == world::Cover::Sea ? 1 : 0;
    }
  });
  slope_ = Grid<float>(nodes, nodes);
  for (int j = 0; j < nodes; ++j)
    for (int i = 0; i < nodes; ++i) {
      const auto rise = [&](int di, int dj) {
        return static_cast<double>(heights_m_.clamped(i + di, j + dj) -
                                   heights_m_.clamped(i - di, j - dj)) /
               (2.0 * spacing_m_);
      };
      slope_(i, j) =
          static_cast<float>(std::sqrt(rise(1, 0) * rise(1, 0) + rise(0, 1) * rise(0, 1)));
    }
  Grid<std::uint8_t> is_land(nodes, nodes);
  bool has_sea = false;
  bool has_land = false;
  for (std::size_t node = 0; node < is_land.values.size(); ++node) {
    is_land.values[node] = is_sea_.values[node] == 0 ? 1 : 0;
    (is_land.values[node] != 0 ? has_land : has_sea) = true;
  }
  sea_m_ = has_sea ? distance_to_others(is_land, {spacing_m_, spacing_m_})
                   : Grid<float>(nodes, nodes, 1e9F);
  land_m_ = has_land ? distance_to_others(is_sea_, {spacing_m_, spacing_m_})
                     : Grid<float>(nodes, nodes, 1e9F);
  std::vector<std::uint8_t> is_outlet = is_sea_.values;
  for (int k = 0; k < nodes; ++k)
    for (const std::size_t node : {heights_m_.index(k, 0), heights_m_.index(k, nodes - 1),
                                   heights_m_.index(0, k), heights_m_.index(nodes - 1, k)})
      is_outlet[node] = 1;
  flow_ = route_flow(heights_m_, is_outlet);
}

Point PlanGround::gradient(const Point& at) const {
  const double reach = spacing_m_;
  return Point(height_m(at + Point(reach, 0)) - height_m(at - Point(reach, 0)),
               height_m(at + Point(0, reach)) - height_m(at - Point(0, reach))) /
         (2.0 * reach);
}

bool PlanGround::is_sea_at(const Point& at) const {
  return surface_.sample(at.x(), at.y()).cover == world::Cover::Sea;
}

bool PlanGround::is_dry(const PointsWorld& ring) const {
  Point middle = Point::Zero();
  bool is_far_inland = true;
  for (const Point& corner : ring) {
    if (!is_in_square(corner, 2.0)) return false;
    middle += corner / static_cast<double>(ring.size());
    is_far_inland = is_far_inland && sea_distance_m(corner) > 6.0 * spacing_m_;
  }
  if (is_far_inland) return true;
  for (std::size_t i = 0; i < ring.size(); ++i)
    if (is_sea_at(ring[i]) || is_sea_at(0.5 * (ring[i] + ring[(i + 1) % ring.size()])))
      return false;
  return !is_sea_at(middle);
}

double PlanGround::rise_m(const PointsWorld& ring) const {
  double lowest = 1e9;
  double highest = -1e9;
  for (const Point& corner : ring) {
    const double height = height_m(corner);
    lowest = std::min(lowest, height);
    highest = std::max(highest, height);
  }
  return highest - lowest;
}

}  // namespace terracast::tiler::country
