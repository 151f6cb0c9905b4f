#pragma once

#include <string>

#include "capture/frame_reader.h"
#include "core/json.h"

/// What a dataset says of cameras whose lines are exposed one after the other, and so each from a place of its
/// own: formats hold one pose an image, that of the frame's time.
namespace terracast::exporters {

/// File of ours in the folder of a sequence that has rolling shutters.
inline constexpr const char* kMotionFile = "motion.csv";

/// motion.csv: one row a frame, how the body moves at the frame's time: velocity (m/s) and acceleration (m/s²)
/// of its reference point and its angular velocity (rad/s), all against the Earth and along the axes that the
/// body has then (x forward, y left, z up). So much later, dt, the body stands in those axes at
/// v dt + a dt² / 2 and is turned by exp(w dt); a negative dt is earlier. 17 digits.
std::string motion_csv(const capture::SequenceReader& sequence);

/// A camera's `shutter` in dataset.json: exposure_s, line_time_s and readout.
core::Json describe_shutter(const geo::Shutter& shutter);

/// The convention of shutters and of what is true in their images, for dataset.json.
std::string shutter_convention();

}  // namespace terracast::exporters
