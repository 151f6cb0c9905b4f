#pragma once

#include <cstdint>
#include <span>
#include <string>

/// Masks as COCO writes them.
namespace terracast::exporters {

/// Runs (capture/segments.h) as text: each, from the fourth on less that before the one before, in groups of 5 bits,
/// the lowest first, each with a sixth bit where more follow, as characters from '0' on.
/// source    cocodataset/cocoapi, common/maskApi.c
std::string text_of_runs(std::span<const std::uint32_t> runs);

}  // namespace terracast::exporters
