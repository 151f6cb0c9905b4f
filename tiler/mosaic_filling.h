#pragma once

#include <cstdint>

#include "tiler/grid.h"
#include "tiler/mosaic_draft.h"

namespace terracast::tiler {

/// The samples of a mosaic that no raster gives a height.
struct Gaps {
  Grid<std::uint8_t> is_void;
  Grid<std::uint8_t> is_missing;  ///< no raster covers them
};

/// Gives the samples of gaps heights, and decides which of them are sea.
///
/// A gap's sample is sea where a sample of the sea lies nearer than one of land, or as near, so that coasts
/// go straight on; and where it lies between sea and sea, so that no land stands in a strait. With
/// outside = "sea" missing samples are sea, too, out of reach of the land; it reaches the farther the higher
/// it is. Land is the membrane that the land around and the filled coasts hold; floors go on where rasters
/// measured them, and pass into the shelf of a sea that nobody measured.
/// draft   its sea is found, and lies at its level
void fill_heights(MosaicDraft& draft, const Gaps& gaps);

}  // namespace terracast::tiler
