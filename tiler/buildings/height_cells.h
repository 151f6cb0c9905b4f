#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>

#include "core/schema.h"
#include "tiler/grid.h"
#include "tiler/raster_source.h"
#include "tiler/surface.h"

namespace terracast::tiler {

/// Heights above the ground, cell by cell, of a raster of them or of a surface model and a ground
/// model.
struct HeightCells {
  Grid<float> heights_m;                 ///< above the ground; NaN: unknown
  std::unique_ptr<RasterSource> raster;  ///< whose cells they are
  Eigen::Vector2i first_cell;            ///< of the grid, among the raster's
  SampleSize cell;                       ///< on the ground
  std::string content_hash;
  core::Ledger ledger;  ///< what the files say beside their samples
};

/// Reads what lies in the world's square.
/// surface   heights above the ground; or, where terrain is given, of what is seen from above
/// terrain   heights of the bare ground on the same datum, interpolated bilinearly to the middles
///           of the surface's cells; may be empty
/// nodata    "declared" by the file, "none", or a number
/// throws    Io, Input: as RasterSource; a raster beside the world, or without a height in it; more
///           cells than 100 million; a height above the ground beyond 900 m; a surface most of
///           which lies below its terrain
HeightCells read_height_cells(const core::Path& surface, const core::Path& terrain,
                              const std::string& nodata, const WorldSurface& world, double size_m);

}  // namespace terracast::tiler
