#include "export/world/region.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <sstream>

#include "core/error.h"

namespace terracast::world_export {
namespace {

using core::ErrorKind;
using core::fail;
using world::TileId;
using world::TileStore;

/// The region's bounds in the world's x-y plane. Its sides are bent there by less than a cell a kilometre, so
/// that points along them bound it when a margin is added.
struct Bounds {
  Eigen::Vector2d lowest = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d highest = Eigen::Vector2d::Constant(-std::numeric_limits<double>::infinity());

  bool overlaps(const TileId& id) const {
    const Eigen::Vector2d corner = id.corner_world();
    return corner.x() < highest.x() && corner.x() + id.side_m() > lowest.x() &&
           corner.y() < highest.y() && corner.y() + id.side_m() > lowest.y();
  }
};

Bounds bounds_of(const TileStore& store, const Region& region) {
  constexpr int kSteps = 64;
  const geo::WorldFrame frame(store.manifest().origin);
  Bounds bounds;
  for (int k = 0; k <= kSteps; ++k) {
    const double share = static_cast<double>(k) / kSteps;
    const double lat_deg = region.south_deg + share * (region.north_deg - region.south_deg);
    const double lon_deg = region.west_deg + share * (region.east_deg - region.west_deg);
    for (const geo::Geodetic& place : {geo::Geodetic{lat_deg, region.west_deg, 0.0},
                                       geo::Geodetic{lat_deg, region.east_deg, 0.0},
                                       geo::Geodetic{region.south_deg, lon_deg, 0.0},
                                       geo::Geodetic{region.north_deg, lon_deg, 0.0}}) {
      const Eigen::Vector2d at = frame.world_from_geodetic(place).head<2>();
      bounds.lowest = bounds.lowest.cwiseMin(at);
      bounds.highest = bounds.highest.cwiseMax(at);
    }
  }
  // Heights move places outward by 1e-4 of their distance from the origin at most, bends between the
  // points by less.
  const double margin_m = 1e-3 * (bounds.highest - bounds.lowest).maxCoeff();
  bounds.lowest.array() -= margin_m;
  bounds.highest.array() += margin_m;
  return bounds;
}

}  // namespace

Region region_from_text(const std::string& text) {
  std::array<double, 4> values{};
  std::istringstream in(text);
  bool is_good = true;
  for (std::size_t i = 0; i < values.size() && is_good; ++i) {
    char comma = ',';
    if (i > 0) in >> comma;
    is_good = static_cast<bool>(in >> values[i]) && comma == ',' && std::isfinite(values[i]);
  }
  std::string rest;
  if (!is_good || in >> rest)
    fail(ErrorKind::Usage,
         "--region {}: four numbers in degrees are wanted, SOUTH,WEST,NORTH,EAST, such as "
         "42.50,1.51,42.52,1.54",
         text);
  const Region region{
      .south_deg = values[0], .west_deg = values[1], .north_deg = values[2], .east_deg = values[3]};
  if (!(region.south_deg < region.north_deg) || !(region.west_deg < region.east_deg) ||
      region.south_deg < -90.0 || region.north_deg > 90.0)
    fail(ErrorKind::Usage,
         "--region {}: encloses nothing; SOUTH must be less than NORTH and WEST less than EAST",
         text);
  return region;
}

bool overlaps(const TileStore& store, const Region& region, const TileId& id) {
  return bounds_of(store, region).overlaps(id);
}

std::vector<world::CutTile> cut_of_region(const TileStore& store, const Region& region,
                                          double finest_spacing_m) {
  const Bounds bounds = bounds_of(store, region);
  const double half_size_m = store.manifest().size_m / 2.0;
  if (bounds.lowest.maxCoeff() > half_size_m || bounds.highest.minCoeff() < -half_size_m)
    fail(ErrorKind::Input,
         "the region lies outside the world's square, which is {:.0f} km wide round latitude "
         "{:.4f}, "
         "longitude {:.4f}",
         2e-3 * half_size_m, store.manifest().origin.lat_deg, store.manifest().origin.lon_deg);
  std::vector<TileId> leaves;
  const std::function<void(const TileId&)> collect = [&](const TileId& id) {
    if (!bounds.overlaps(id)) return;
    const bool is_split = id.spacing_m() > finest_spacing_m && store.find(id.child(0)) != nullptr;
    if (!is_split) {
      leaves.push_back(id);
      return;
    }
    for (int quadrant = 0; quadrant < 4; ++quadrant) collect(id.child(quadrant));
  };
  for (const world::TileInfo& tile : store.manifest().tiles)
    if (tile.id.level == store.manifest().coarsest_level) collect(tile.id);
  std::vector<world::CutTile> cut = world::with_coarser_sides(world::balance(leaves));
  std::erase_if(cut, [&](const world::CutTile& tile) { return !bounds.overlaps(tile.id); });
  return cut;
}

geo::Rigid3d enu_from_world(const geo::WorldFrame& frame, const geo::Geodetic& place) {
  const Eigen::Vector3d at_world = frame.world_from_geodetic(place);
  const geo::Rigid3d world_from_enu{Eigen::Quaterniond(frame.world_from_enu(at_world)), at_world};
  return world_from_enu.inverse();
}

}  // namespace terracast::world_export
