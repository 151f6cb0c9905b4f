#pragma once

#include <span>
#include <string>

#include "core/json.h"

namespace terracast::validate {

/// What a report.json says, in one sentence: what is wrong, what was proved, and what this dataset could not have shown.
std::string head_sentence(const core::Json& report);

/// Names of checks in the order in which they come, with the formats of a report of several behind each:
/// "flow_masks (kitti, kitti_raw), reprojection".
std::string by_check(std::span<const std::string> names);

}  // namespace terracast::validate
