#pragma once

#include <string>

#include "validate/dataset.h"

/// What TartanAir's versions share: world north, east, down; camera x forward, y right, z down.
namespace terracast::validate {

/// Axes of a camera that are x right, y down, z forward, in those x forward, y right, z down.
Eigen::Matrix3d frd_from_rdf();

/// Names and indices of classes from <environment>/seg_label_map.json.
void read_classes(const Dataset& dataset, Sequence& sequence, Findings& findings);

/// Rows `tx ty tz qx qy qz qw` of a camera, from <sequence>/pose_<camera>.txt.
void read_ned_poses(const Dataset& dataset, const Sequence& sequence, Camera& camera,
                    Findings& findings);

/// The rectified pair, where both are there.
void add_fixed_pair(const std::string& left, const std::string& right, Sequence& sequence);
/// It must stand as the format fixes it: 0.25 m apart.
void check_fixed_pair(const Sequence& sequence, Findings& findings);

/// Depth of a surface, or NaN for the sky's.
/// path, index, width   for the message
/// throws               Input: not more than 0, or more than the sky's
float depth_or_sky(float value_m, const Dataset& dataset, const std::string& path,
                   std::size_t index, int width);

}  // namespace terracast::validate
