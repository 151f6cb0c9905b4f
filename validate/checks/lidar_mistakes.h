#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "validate/check.h"
#include "validate/checks/lidar_files.h"

/// Mistakes in a format's lidar files that are known by name.
namespace terracast::validate {

/// To the digits of a format's files.
bool is_same_mount(const Pose& mount, const Pose& right);
std::optional<CheckResult::Mistake> mistake_of_mount(const Pose& mount, const Pose& right);

/// other     rows of another frame; nothing: there is none
/// pose_at   of the camera that places the points
std::optional<CheckResult::Mistake> mistake_of_points(
    const Dataset& dataset, const Sequence& sequence, int frame, const std::vector<ScanRow>& rows,
    const std::vector<ScanPoint>& points,
    const std::function<std::optional<std::vector<ScanRow>>(int)>& other,
    const std::function<std::optional<Pose>(int)>& pose_at);

std::optional<CheckResult::Mistake> mistake_of_labels(DealtScans& dealt, int frame,
                                                      const std::vector<ScanLabel>& labels);

}  // namespace terracast::validate
