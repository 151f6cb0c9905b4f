#pragma once

#include "tiler/mosaic_draft.h"

namespace terracast::tiler {

/// Whether a height is as low as the sea of its raster: sea = "auto" holds it as exact zeros above
/// a geoid, "below" as all that lies at 0 and below.
bool is_low(double height_m, const MosaicDraft::Raster& raster);

/// Of the sea's surface above the mosaic's datum: 0 above a geoid, EGM96's undulation above the
/// ellipsoid.
double sea_level_m(const MosaicDraft& draft, const geo::Geodetic& place);

/// Large regions without a height, of rasters that hold the sea so, become sea. Before gaps are
/// filled.
void take_sea_from_gaps(MosaicDraft& draft);

/// Large regions of samples that are low become sea, at one level whatever geoids their rasters
/// stand on. Measured floors keep their depth below it; others get a shelf.
void find_sea(MosaicDraft& draft);

}  // namespace terracast::tiler
