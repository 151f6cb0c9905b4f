#pragma once

#include "tiler/mosaic_draft.h"

namespace terracast::tiler {

/// Gives every sample a height that no raster gave one: small regions are voids and filled from
/// their surroundings; the rest is missing coverage, and becomes what options.outside says (a
/// patch's stays missing). The sea is known by then.
/// throws   Input: coverage is missing in the square while outside = "error" (names the area); no
///          height at all
void fill_gaps(MosaicDraft& draft);

}  // namespace terracast::tiler
