#pragma once

#include <gdal_priv.h>

#include <span>
#include <string_view>
#include <vector>

#include "core/ledger.h"

namespace terracast::tiler {

/// What was made of those statements of a raster that are not always used.
struct RasterUse {
  std::string_view what;  ///< "heights", for reasons
  int band = 1;           ///< whose samples are used
  bool uses_unit = true;
  bool uses_scale = true;
  bool uses_nodata = true;
  bool uses_mask = true;
  bool uses_colours = false;  ///< colour interpretations of bands tell what they are
};

/// What a raster says beside its samples: statements of bands and of the whole by names of ours, "band unit", and
/// items of metadata by GDAL's, "AREA_OR_POINT", those of a domain behind its name, "IMAGE_STRUCTURE:COMPRESSION".
core::Ledger ledger_of(GDALDataset& dataset, const RasterUse& use);

/// What the readers of rasters know, for the documentation.
std::vector<core::KnownTable> raster_tables();

}  // namespace terracast::tiler
