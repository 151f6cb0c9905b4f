#pragma once

#include "core/ledger.h"
#include "core/schema.h"
#include "geo/geoid.h"

namespace terracast::tiler {

/// Reads a grid of offsets: one band in latitude and longitude, north up.
/// Offsets are in metres, by the unit, scale and offset that its band declares.
/// throws   Io: no such file; Input: cannot be opened, another system or georeference, an unknown unit
geo::OffsetGrid read_offset_grid(const core::Path& file);

/// What such a file says beside its samples.
/// throws   Io, Input: it cannot be opened
core::Ledger ledger_of_offset_grid(const core::Path& file);

}  // namespace terracast::tiler
