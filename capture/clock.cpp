#include "capture/clock.h"

#include "capture/camera_draws.h"

namespace terracast::capture {

double stamp_s(const CameraClock& clock, const CameraCalibration& camera, std::int64_t seed,
               const std::string& sequence, int frame, double time_s) {
  const double clock_s = time_s + clock.offset_s + clock.drift * time_s;
  if (clock.jitter_sd_s == 0.0) return clock_s;
  return clock_s + clock.jitter_sd_s * CameraDraws(seed, sequence, camera).jitter(frame);
}

}  // namespace terracast::capture
