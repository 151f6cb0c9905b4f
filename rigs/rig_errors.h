#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "rigs/rig.h"

/// The errors of rigs: what a config says of cameras is what their users believe, and here it is drawn what
/// they are. A draw is a function of the seed and of the names of sequence, rig and camera alone.
namespace terracast::rigs {

/// The cameras of a sequence as they are.
struct TrueRigs {
  std::vector<capture::CameraCalibration> cameras;
  std::vector<capture::CameraClock> clocks;  ///< one a camera; empty: no rig's clocks err
};

/// believed   as build_cameras(rigs) gives them; what does not err comes out the same to the last bit
/// throws     Config: a draw leaves no focal length, or a camera that its model cannot hold
TrueRigs draw_true_rigs(const std::vector<RigOptions>& rigs,
                        const std::vector<capture::CameraCalibration>& believed, std::int64_t seed,
                        const std::string& sequence);

}  // namespace terracast::rigs
