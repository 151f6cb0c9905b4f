#pragma once

#include <vector>

#include "tiler/mosaic_draft.h"

namespace terracast::tiler {

/// Whether a height is as low as the sea of its raster: sea = "auto" holds it as exact zeros above
/// a geoid, "below" as all that lies at 0 and below.
bool is_low(double height_m, const MosaicDraft::Raster& raster);

/// Height of the sea's surface above the mosaic's datum at each sample of a row: 0 above a geoid, EGM96's
/// undulation above the ellipsoid.
std::vector<double> sea_levels_of_row_m(const MosaicDraft& draft, int row);

/// Finds the sea that rasters hold: large regions of samples that are low, or that have no height where
/// sea = "nodata". It has one level whatever geoids its rasters stand on; measured floors keep their depth
/// below it. Before gaps are filled.
void find_sea(MosaicDraft& draft);

/// Depth of the floor that is laid where no source knows it: 1 in 50, down to the edge of a shelf.
/// from_land_m   to the nearest sample of land
double shelf_depth_m(float from_land_m, const Eigen::Vector2d& sample_size_m);

/// Lays a shelf where no source knows the sea's floor. After gaps are filled.
void lay_floor(MosaicDraft& draft);

}  // namespace terracast::tiler
