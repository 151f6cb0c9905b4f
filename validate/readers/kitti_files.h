#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "validate/dataset.h"

/// What KITTI's formats share.
namespace terracast::validate {

using Projection = Eigen::Matrix<double, 3, 4>;

/// Twelve numbers, row by row.
Projection projection_from_numbers(const std::vector<double>& numbers);

/// Camera k from camera 0: P = K [I | t].
Pose camera_from_camera0(const Projection& projection);

/// Intrinsics of P; pixel centres at whole numbers, so that half a pixel is added.
/// throws  Input: P is not K [I | t]; `name` is its word in the file
void set_intrinsics(const Projection& projection, const std::string& name, Intrinsics& intrinsics);

/// Width and height as the image's own header says; every other image is held against it.
void read_size(const Dataset& dataset, const std::string& path, Intrinsics& intrinsics);

/// Cameras whose folders are there though dataset.json does not speak of them are read all the
/// same.
void add_unlisted_cameras(const Dataset& dataset, const std::vector<std::string>& names,
                          Sequence& sequence);

/// Poses of camera 0 relative to its first frame; another number of rows than frames is a finding.
std::vector<Pose> read_relative_poses(const Dataset& dataset, const std::string& path,
                                      int num_frames, Findings& findings);

}  // namespace terracast::validate
