#pragma once

#include <Eigen/Core>
#include <string>

#include "capture/frame_reader.h"
#include "core/image.h"
#include "export/dataset_writer.h"
#include "export/georeference.h"

/// What KITTI's formats share.
namespace terracast::exporters {

/// ITU-R BT.601 luma, as OpenCV's.
core::Image8 grey_of(const core::Image8& color);

/// A matrix row by row: 13 significant digits, single blanks, none at the end (evo insists).
std::string number_line(const Eigen::Ref<const Eigen::MatrixXd>& matrix);

/// K of a pinhole with pixel centres at whole numbers, as those who read the format take them: c is
/// ours less 0.5.
Eigen::Matrix3d kitti_camera_matrix(const capture::CameraCalibration& camera);

/// K [I | t] of a rectified camera that stands `offset_m` to the right of camera 0.
Eigen::Matrix<double, 3, 4> kitti_projection(const capture::CameraCalibration& camera,
                                             double offset_m);

/// Poses of a camera: frame i to frame 0, a row of 3 x 4 numbers each; the first is the identity.
std::string relative_poses(const capture::SequenceReader& sequence, const LocalFrame& local,
                           int camera_index);

/// A frame's colour image twice, in grey and in colour.
void write_grey_and_color(const capture::SequenceReader& sequence, int frame, int camera_index,
                          const std::string& grey_file, const std::string& color_file,
                          DatasetWriter& writer);

/// Planar depth, m, float32; sky 0.
core::ImageF depth_with_empty_sky(const capture::SequenceReader& sequence, int frame,
                                  int camera_index);

}  // namespace terracast::exporters
