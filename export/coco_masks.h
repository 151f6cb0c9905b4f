#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "core/image.h"

/// Masks as COCO writes them.
namespace terracast::exporters {

/// Lengths of runs along the columns, from the top left pixel down and then to the right: first of pixels that
/// are not in the mask (0 where the first one is), then of those that are, and so on.
using MaskRuns = std::vector<std::uint32_t>;

/// A part of an image whose pixels bear one number.
struct Segment {
  std::int64_t area = 0;                         ///< pixels
  int left = 0, top = 0, right = 0, bottom = 0;  ///< of its pixels, the last ones included
  MaskRuns runs;
};

/// All segments of an image of numbers, by number; 0 is none.
std::map<std::uint32_t, Segment> segments_of(const core::ImageU32& numbers);

/// Runs as text: each, from the fourth on less that before the one before, in groups of 5 bits, the lowest
/// first, each with a sixth bit where more follow, as characters from '0' on.
/// source    cocodataset/cocoapi, common/maskApi.c
std::string text_of_runs(std::span<const std::uint32_t> runs);

}  // namespace terracast::exporters
