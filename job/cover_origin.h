#pragma once

#include <optional>
#include <vector>

#include "geo/geodesy.h"
#include "world/raster_info.h"
#include "world/tile.h"
#include "world/tile_store.h"

namespace terracast::job {

/// A layer that may have said what covers a place.
struct CoverOrigin {
  std::size_t layer = 0;  ///< row of the manifest
  /// Of WorldRasters::land_cover; none: no raster said it, or several may have.
  std::optional<std::size_t> raster;
};

/// The layers that may have said a cover, in the order in which they were asked: one, where that can be told.
/// Layers that never say such a cover are not among them, nor rasters that say another thing, or nothing, in all
/// pixels from which the place may have it, nor what comes after a raster that speaks in all of these, or after derived
/// cover in a world without a sea.
/// Empty where the cover is the elevation's word.
/// rasters   as read_rasters() gives them; what land cover says is read into it
/// place     of the tile's sample that held the cover
/// throws    as read_covers() and pixel_from_geodetic()
std::vector<CoverOrigin> origins_of_cover(const world::TileStore& store,
                                          std::optional<world::WorldRasters>& rasters,
                                          world::Cover cover, const geo::Geodetic& place);

}  // namespace terracast::job
