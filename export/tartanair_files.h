#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "capture/frame_reader.h"
#include "capture/labels.h"
#include "core/image.h"
#include "export/georeference.h"

/// What TartanAir's versions share: world NED about the sequence's local origin, cameras FRD (x
/// forward, y right, z down), numbers that readers have written into their code.
namespace terracast::exporters {

/// Axes of a camera that are x forward, y right, z down, in those x right, y down, z forward.
Eigen::Matrix3d rdf_from_frd();

/// The right camera's distance from the left one.
inline constexpr double kTartanAirBaseline_m = 0.25;

/// throws   Config: the camera is no pinhole of the format's size with f = 320 px and its principal
///          point in the middle (pixel centres at +0.5)
void check_tartanair_camera(const capture::CameraCalibration& camera, int width_px, int height_px,
                            const char* format);
/// throws   Config: the two are no rectified pair, or not 0.25 m apart, or have other shutters than a pair may
void check_tartanair_pair(const capture::CameraCalibration& left,
                          const capture::CameraCalibration& right, const char* format);
/// throws   Config: a word that is no folder's name; empty is right: the world's name
void check_environment(const std::string& environment, const char* format);
std::string environment_of(const std::string& environment,
                           const std::vector<capture::SequenceReader>& sequences);

/// Camera to world, `tx ty tz qx qy qz qw`, a line a frame; 9 and 15 decimals.
std::string ned_poses(const capture::SequenceReader& sequence, const LocalFrame& local,
                      int camera_index);

/// {"name_map": {"sky": 0, …}}
std::string seg_label_map();
core::Image8 segmentation(const core::ImageU32& semantic_id);

/// Planar depth with a finite sky.
/// where    begins the message
/// throws   Input: ground as deep as the sky, with the pixel
core::ImageF depth_before_sky(core::ImageF depth_m, double sky_depth_m, const std::string& where);

/// Flow in one direction with its two masks.
struct MaskedFlow {
  core::ImageF motion_px;  ///< 2 channels, finite; 0 for what comes to lie behind the camera
  core::Image8 is_in_view;
  core::Image8 is_covisible;

  /// 0 valid, 1 occluded or sky, 100 out of view.
  std::uint16_t mask(int x, int y) const {
    return is_in_view(x, y) == 0 ? 100 : is_covisible(x, y) == 0 ? 1 : 0;
  }
};
/// motions        of what moves, from the frame of `from` to that of `to`
/// visible_flag   the fact that says whether `to` sees the point
MaskedFlow masked_flow(const capture::CameraView& from, const capture::CameraView& to,
                       const capture::BodyMotions& motions, const capture::CameraFrame& facts,
                       std::uint32_t visible_flag);

/// Forward flow of a camera, from a frame to the next.
MaskedFlow forward_flow(const capture::SequenceReader& sequence, int frame, int camera_index);
/// Backward flow, from the frame after `frame` to it.
MaskedFlow backward_flow(const capture::SequenceReader& sequence, int frame, int camera_index);

}  // namespace terracast::exporters
