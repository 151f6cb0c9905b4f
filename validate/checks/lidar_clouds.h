#pragma once

#include <vector>

#include "validate/check.h"
#include "validate/checks/contradictions.h"
#include "validate/dataset.h"
#include "validate/readers/clouds.h"
#include "validate/readers/sensors.h"

namespace terracast::validate {

/// A row of scans as clouds should have it: the place that is shown in the sequence's frame.
std::vector<CloudRow> shown_rows(const NpyTable& scans, const std::string& name);

/// Holds the clouds of a lidar (PLY, PCD, LAS) against its scans, row by row.
/// undulation_m   EGM96's; without it heights of LAS are left out
void compare_clouds(const Dataset& dataset, const Sequence& sequence, const SensorRecord& lidar,
                    const Undulation& undulation_m, FileContradictions& found);

}  // namespace terracast::validate
