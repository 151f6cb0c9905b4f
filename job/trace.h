#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>

#include "core/json.h"
#include "geo/geodesy.h"
#include "world/tile_store.h"

namespace terracast::job {

/// A pixel of a capture.
struct CapturedPixel {
  std::filesystem::path capture;  ///< folder of the captures
  std::string sequence;           ///< "": the only one
  std::string camera;             ///< RIG/NAME; "": the only one
  int frame = 0;
  int x = 0;
  int y = 0;
};

/// What is known of a place of a world and where that comes from: its coordinates, what is met there
/// with class and instance, and the source of it as the world's manifest states it.
///
///     place        latitude, longitude, height above the ellipsoid, altitude above the geoid (EGM96;
///                  null without its grid), world x, y, z
///     surface      ground, paint (on the ground), object, moving, or sky
///     class        name, id; instance_id is 0 for ground and sky
///     layer        of paint and objects: its row of the manifest, name, kind, source, licence,
///                  accuracy; and the feature's number in that source, and `element` beside it where that is an
///                  element of OpenStreetMap: way/123. `cell` where it is an outline made of the cells of a raster: column and
///                  row of its first cell, row by row
///     moving       of what moves: the body's name and what it is
///     elevation    of ground and paint: the source's row, name, kind, CRS, datum, spacing,
///                  licence, accuracy; of a raster the `cell`: column and row of the pixel that holds the place,
///                  counted from 0
///     cover        of ground: what covers it, and the layer that said so; several, in the order in which they are
///                  asked, where it cannot be told which (origins_of_cover()). Of rasters the `cells`
///     imagery      of ground where a picture is shown: its layer as above, the files that show in its
///                  tile, the cells of those that reach over the place, sides of its pixels, its colour there (sRGB
///                  of the albedo)
///     tile         name and spacing, where it was met
///
/// Members that do not apply are left out; `cell` is null, and `cells` are left out, where the store, of an older version, keeps no
/// geotransforms.
/// throws   Input: outside the world's tiles; the store lacks a tile that it lists
core::Json trace_place(const world::TileStore& store, double lat_deg, double lon_deg);

/// The same above a world x, y.
core::Json trace_world_place(const world::TileStore& store, const Eigen::Vector2d& place_world);

/// The same of what a pixel shows: the place by its captured range and pose, class and instance as
/// captured, and the rest from the world, along the pixel's ray through the tiles that the sequence
/// showed. Also `range_m`.
/// throws   Input: no such sequence, camera, frame or pixel (says which there are); the store is not
///          the world of the capture, or its ray meets something else
core::Json trace_pixel(const world::TileStore& store, const CapturedPixel& pixel);

/// A trace in lines for people.
std::string trace_text(const core::Json& trace);

}  // namespace terracast::job
