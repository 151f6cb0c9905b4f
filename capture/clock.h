#pragma once

#include <cstdint>
#include <string>

#include "capture/frame.h"

namespace terracast::capture {

/// The reading of a camera's clock at a frame's time, s.
/// time_s   true time since the sequence's start
double stamp_s(const CameraClock& clock, const CameraCalibration& camera, std::int64_t seed,
               const std::string& sequence, int frame, double time_s);

}  // namespace terracast::capture
