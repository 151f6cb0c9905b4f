#pragma once

#include "core/schema.h"
#include "geo/geoid.h"

namespace terracast::tiler {

/// Reads a grid of offsets: one band in latitude and longitude, north up.
/// throws   Io: no such file; Input: cannot be opened, another system or georeference
geo::OffsetGrid read_offset_grid(const core::Path& file);

}  // namespace terracast::tiler
