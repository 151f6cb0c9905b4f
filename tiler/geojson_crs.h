#pragma once

#include "core/schema.h"

namespace terracast::tiler {

/// Looks at the member "crs" of a GeoJSON. Where GDAL does not know what it names it takes the file
/// for WGS84, of some without a word. Without the member, and where it is null, it is in WGS84. Of
/// several the last counts that is spelt as the first, as for GDAL; one of a feature or a geometry,
/// or written with escapes, is not seen.
/// file     of gdal_path()
/// throws   Input: it names a system that is not known, or none, or cannot be read
/// cost     reads the file, once
void check_geojson_crs(const core::Path& file);

}  // namespace terracast::tiler
