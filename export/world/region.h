#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/semantic_class.h"
#include "geo/geodesy.h"
#include "geo/rigid3.h"
#include "world/lod.h"
#include "world/tile_store.h"

namespace terracast::world_export {

/// A part of a world: the places between these latitudes and longitudes.
struct Region {
  double south_deg = 0.0;
  double west_deg = 0.0;
  double north_deg = 0.0;
  double east_deg = 0.0;

  bool contains(const geo::Geodetic& place) const {
    return place.lat_deg >= south_deg && place.lat_deg <= north_deg && place.lon_deg >= west_deg &&
           place.lon_deg <= east_deg;
  }
  geo::Geodetic center() const {
    return {.lat_deg = 0.5 * (south_deg + north_deg), .lon_deg = 0.5 * (west_deg + east_deg)};
  }
};

/// "SOUTH,WEST,NORTH,EAST" in degrees.
/// throws Usage: other text, or limits that enclose nothing
Region region_from_text(const std::string& text);

/// The tiles that cover a region, none finer than asked for, balanced so that their borders meet.
/// finest_spacing_m   of terrain samples
/// throws             Input: the region lies outside the world's square
std::vector<world::CutTile> cut_of_region(const world::TileStore& store, const Region& region,
                                          double finest_spacing_m);

/// Whether any place of a tile may lie in a region: by the places of its corners and centre lines.
bool overlaps(const world::TileStore& store, const Region& region, const world::TileId& id);

/// East-north-up at a place of the ellipsoid, as a frame for what is written.
/// returns   enu_from_world
geo::Rigid3d enu_from_world(const geo::WorldFrame& frame, const geo::Geodetic& place);

}  // namespace terracast::world_export
