#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
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

  bool operator==(const Region&) const = default;

  /// Longitudes count as well as those a turn from them.
  bool contains(const geo::Geodetic& place) const;
  /// Its longitude lies in [-180, 180].
  geo::Geodetic center() const;
};

/// "SOUTH,WEST,NORTH,EAST" in degrees.
/// throws Usage: other text, or limits that enclose nothing
Region region_from_text(const std::string& text);

/// The least latitudes and longitudes that hold the world's square on the ellipsoid. Longitudes count on from the
/// origin's; of a square that holds a pole they are all.
Region region_of_square(const world::WorldManifest& manifest);

/// What of a region lies in region_of_square(). Where that is two parts, at both ends of longitudes that reach round
/// the Earth, it is the least region that holds both.
/// throws   Input: nothing
Region clipped_to_square(const world::WorldManifest& manifest, const Region& region);

/// Whether a place lies in the world's square, and not in its apron.
bool is_in_square(const world::WorldManifest& manifest, const Eigen::Vector2d& place_world);

/// The tiles that cover what of a region lies in the world's square, none finer than asked for, balanced so that their borders meet.
/// finest_spacing_m   of terrain samples
/// throws             Input: none of it does
std::vector<world::CutTile> cut_of_region(const world::TileStore& store, const Region& region,
                                          double finest_spacing_m);

/// Whether any place of a tile may lie in a region and in the world's square.
bool overlaps(const world::TileStore& store, const Region& region, const world::TileId& id);

/// East-north-up at a place of the ellipsoid, as a frame for what is written.
/// returns   enu_from_world
geo::Rigid3d enu_from_world(const geo::WorldFrame& frame, const geo::Geodetic& place);

/// Where a file's frame has its origin, as files tell it; numbers read back to the same bits.
/// axes      such as "x east, y north, z up"
std::string frame_text(std::string_view axes, const geo::Geodetic& origin);

}  // namespace terracast::world_export
