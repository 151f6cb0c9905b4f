#pragma once

#include <filesystem>
#include <string>
#include <utility>
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
/// throws   Config: a focal length that is not above 0
rigs::RigOptions rig_of_cameras(const std::string& name,
                                const std::vector<capture::CameraCalibration>& cameras);

/// A name that a rig or camera may bear, from any text: what it may not hold becomes _.
std::string safe_name(const std::string& text);

/// A rig's and a camera's name in the topic of its images: "/rig/camera/image_raw"; other topics hold the camera's
/// alone, or "".
std::pair<std::string, std::string> names_of_topic(std::string topic);

/// Gives cameras whose names are not all their own the others, of as many.
void name_apart(std::vector<capture::CameraCalibration>& cameras,
                const std::vector<std::string>& others);

/// The rig's axes from x right, y down, z forward: those of a camera that looks forward from the rig's origin.
geo::Rigid3d rig_from_rdf();

/// The model `opencv` for what is one of its cases, `simple_radial` and `radial`; else the same. For formats that
/// have no shorter name.
geo::CameraIntrinsics as_opencv(geo::CameraIntrinsics intrinsics);

/// For formats that count pixels from the first one's centre, at (0, 0) there and (0.5, 0.5) here.
inline constexpr double kCentreOfFirstPixel_px = 0.5;

}  // namespace terracast::rigs
