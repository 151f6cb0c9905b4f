#pragma once

#include <memory>

#include "tiler/height_field.h"
#include "tiler/raster_mosaic.h"

namespace terracast::tiler {

/// A mosaic as a field: Catmull-Rom splines through its samples. A place's map coordinates are
/// samples of the mosaic, in the first raster's own projection.
std::unique_ptr<HeightField> make_raster_field(RasterMosaic mosaic);

}  // namespace terracast::tiler
