#pragma once

#include <vector>

#include "tiler/roads/road_bed.h"
#include "tiler/roads/road_paint.h"

namespace terracast::tiler {

/// Areas that are made even: planes of little slope as near the ground as may be, as high as the ways that
/// lead there.
struct Pads {
  std::vector<Pad> pads;
  std::int64_t num_too_steep = 0;  ///< painted on the ground as it is
};
Pads make_pads(const std::vector<PaintedArea>& areas, const RoadNetwork& network,
               const RoadHeights& heights, const RoadGroundFunction& ground);

}  // namespace terracast::tiler
