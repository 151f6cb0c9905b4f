#pragma once

#include <string>
#include <vector>

#include "tests/jobs/draws.h"

namespace terracast::test {

/// A rig of a job, and which formats it can be exported to.
struct JobRig {
  std::string name;
  std::string text;  ///< of its file
  int num_cameras = 0;
  double pixels_per_camera = 0.0;
  bool is_rectified_pair =
      false;  ///< of cameras called left and right, without errors of their mounts
  bool has_lenses_of_colmap = true;
  bool has_lenses_of_euroc = false;
  bool has_sensors = false;  ///< beside cameras and IMUs
  bool is_of_tartanair = false;
  bool is_of_tartanair_v1 = false;
  bool has_errors = false;
  bool has_rolling_shutter = false;
};

/// The rendering budget of a job, and its frame rate.
struct JobSize {
  double rays = 1e6;  ///< of colour, in all images together, about
  int num_frames = 4;
  int color_samples = 4;
  double frame_s = 0.1;  ///< from frame to frame
};

JobRig draw_rig(const std::string& name, Draws draws, const JobSize& size);

}  // namespace terracast::test
