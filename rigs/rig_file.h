#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "rigs/rig.h"

namespace terracast::rigs {

/// A rig file: the TOML of one `[[rigs]]` of a job.
/// throws   as core::read_toml
rigs::RigOptions read_rig(const std::filesystem::path& file);

/// The rig as TOML: what is not as by default. Reads back to an equal rig.
std::string rig_toml(const rigs::RigOptions& rig);

/// A rig of cameras that are known by their calibration, in FLU.
rigs::RigOptions rig_of_cameras(const std::string& name,
                                const std::vector<capture::CameraCalibration>& cameras);

/// A name that a rig or camera may bear, from any text: what it may not hold becomes _.
std::string safe_name(const std::string& text);

/// The model `opencv` for what is one of its cases, `simple_radial` and `radial`; else the same. For formats that
/// have no shorter name.
geo::CameraIntrinsics as_opencv(geo::CameraIntrinsics intrinsics);

/// For formats that count pixels from the first one's centre, at (0, 0) there and (0.5, 0.5) here.
inline constexpr double kCentreOfFirstPixel_px = 0.5;

}  // namespace terracast::rigs
