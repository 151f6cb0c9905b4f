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
/// body has then (x forward, y left, z up), and the terms of its motion. So much later, dt, the body stands in those
/// axes at v dt + a dt² / 2 + p3 dt³ + p4 dt⁴ + p5 dt⁵ and is turned by exp((w - s) dt + r2 dt² + … + r5 dt⁵) exp(s dt);
/// a negative dt is earlier. 17 digits.
std::string motion_csv(const capture::SequenceReader& sequence);

/// The terms of a motion (geo::MotionTerms) along the axes that the body has at t = 0.
inline constexpr const char* kTermColumns =
    "p3x_mps3,p3y_mps3,p3z_mps3,p4x_mps4,p4y_mps4,p4z_mps4,p5x_mps5,p5y_mps5,p5z_mps5,r2x_radps2,"
    "r2y_radps2,r2z_radps2,r3x_radps3,r3y_radps3,r3z_radps3,r4x_radps4,r4y_radps4,r4z_radps4,"
    "r5x_radps5,r5y_radps5,r5z_radps5,sx_radps,sy_radps,sz_radps,reach_s";
/// Their values, each after a comma.
std::string terms_csv(const geo::BodyState& state);

/// A camera's `shutter` in dataset.json: exposure_s, line_time_s and readout.
core::Json describe_shutter(const geo::Shutter& shutter);

/// The convention of shutters and of what is true in their images, for dataset.json.
std::string shutter_convention();

}  // namespace terracast::exporters
