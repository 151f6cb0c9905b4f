#include "export/world/region.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <sstream>

#include "core/error.h"

namespace terracast::world_export {
namespace {

constexpr double kTurn_deg = 360.0;

using core::ErrorKind;
using core::fail;
using world::TileId;
using world::TileStore;

/// The bounds in the world's x-y plane of what of a region lies in the world's square. The region's sides are bent
/// there by less than a cell a kilometre, so that points along them bound it when a margin is added.
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
  const double half_m = store.manifest().size_m / 2.0;
  bounds.lowest = bounds.lowest.cwiseMax(-half_m);
  bounds.highest = bounds.highest.cwiseMin(half_m);
  return bounds;
}

[[noreturn]] void fail_outside(const world::WorldManifest& manifest) {
  fail(ErrorKind::Input,
       "the region lies outside the world's square, which is {:.0f} km wide round latitude {:.4f}, "
       "longitude {:.4f}",
       1e-3 * manifest.size_m, manifest.origin.lat_deg, manifest.origin.lon_deg);
}

}  // namespace

bool Region::contains(const geo::Geodetic& place) const {
  const double middle_deg = 0.5 * (west_deg + east_deg);
  const double lon_deg =
      place.lon_deg + kTurn_deg * std::round((middle_deg - place.lon_deg) / kTurn_deg);
  return place.lat_deg >= south_deg && place.lat_deg <= north_deg && lon_deg >= west_deg &&
         lon_deg <= east_deg;
}

geo::Geodetic Region::center() const {
  return {.lat_deg = 0.5 * (south_deg + north_deg),
          .lon_deg = std::remainder(0.5 * (west_deg + east_deg), kTurn_deg)};
}

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

bool is_in_square(const world::WorldManifest& manifest, const Eigen::Vector2d& place_world) {
  return place_world.cwiseAbs().maxCoeff() <= 0.5 * manifest.size_m;
}

bool overlaps(const TileStore& store, const Region& region, const TileId& id) {
  return bounds_of(store, region).overlaps(id);
}

Region region_of_square(const world::WorldManifest& manifest) {
  constexpr int kSteps = 64;
  const geo::WorldFrame frame(manifest.origin);
  const double half_m = manifest.size_m / 2.0;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Region region{.south_deg = kInfinity,
                .west_deg = kInfinity,
                .north_deg = -kInfinity,
                .east_deg = -kInfinity};
  const auto add = [&](double x, double y) {
    // As high above the tangent plane's place as the ellipsoid lies below it, to a millimetre over 100 km.
    const double below_m = frame.geodetic_from_world({x, y, 0.0}).height_m;
    const geo::Geodetic place = frame.geodetic_from_world({x, y, -below_m});
    const double lon_deg = manifest.origin.lon_deg +
                           std::remainder(place.lon_deg - manifest.origin.lon_deg, kTurn_deg);
    region.south_deg = std::min(region.south_deg, place.lat_deg);
    region.north_deg = std::max(region.north_deg, place.lat_deg);
    region.west_deg = std::min(region.west_deg, lon_deg);
    region.east_deg = std::max(region.east_deg, lon_deg);
  };
  for (int k = 0; k <= kSteps; ++k) {
    const double along_m = half_m * (2.0 * k / kSteps - 1.0);
    for (const double side_m : {-half_m, half_m}) {
      add(along_m, side_m);
      add(side_m, along_m);
    }
  }
  const double pole_deg = manifest.origin.lat_deg < 0.0 ? -90.0 : 90.0;
  const Eigen::Vector3d pole_world = frame.world_from_geodetic({.lat_deg = pole_deg});
  if (pole_world.head<2>().cwiseAbs().maxCoeff() <= half_m) {
    (pole_deg < 0.0 ? region.south_deg : region.north_deg) = pole_deg;
    region.west_deg = manifest.origin.lon_deg - 0.5 * kTurn_deg;
    region.east_deg = manifest.origin.lon_deg + 0.5 * kTurn_deg;
  }
  return region;
}

Region clipped_to_square(const world::WorldManifest& manifest, const Region& region) {
  const Region square = region_of_square(manifest);
  Region clipped{.south_deg = std::max(region.south_deg, square.south_deg),
                 .west_deg = square.east_deg,
                 .north_deg = std::min(region.north_deg, square.north_deg),
                 .east_deg = square.west_deg};
  for (const double turn_deg : {-kTurn_deg, 0.0, kTurn_deg}) {
    const double west_deg = std::max(region.west_deg + turn_deg, square.west_deg);
    const double east_deg = std::min(region.east_deg + turn_deg, square.east_deg);
    if (!(west_deg < east_deg)) continue;
    clipped.west_deg = std::min(clipped.west_deg, west_deg);
    clipped.east_deg = std::max(clipped.east_deg, east_deg);
  }
  if (!(clipped.south_deg < clipped.north_deg) || !(clipped.west_deg < clipped.east_deg))
    fail_outside(manifest);
  return clipped;
}

std::vector<world::CutTile> cut_of_region(const TileStore& store, const Region& region,
                                          double finest_spacing_m) {
  const Bounds bounds = bounds_of(store, region);
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
  if (cut.empty()) fail_outside(store.manifest());
  return cut;
}

geo::Rigid3d enu_from_world(const geo::WorldFrame& frame, const geo::Geodetic& place) {
  const Eigen::Vector3d at_world = frame.world_from_geodetic(place);
  const geo::Rigid3d world_from_enu{Eigen::Quaterniond(frame.world_from_enu(at_world)), at_world};
  return world_from_enu.inverse();
}

std::string frame_text(std::string_view axes, const geo::Geodetic& origin) {
  return fmt::format("{}, m, at latitude {} longitude {} height {} of WGS84", axes, origin.lat_deg,
                     origin.lon_deg, origin.height_m);
}

}  // namespace terracast::world_export
