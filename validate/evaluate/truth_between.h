#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "validate/evaluate/trajectory_error.h"

/// The truth at times between frames.
namespace terracast::validate {

/// A time this near to a frame's is that frame's: stamps have six decimals at least.
constexpr double kSameTime_s = 1e-6;

struct TruthAtTimes {
  std::vector<std::optional<Pose>> poses;  ///< one a time; nothing: unmatched
  std::int64_t num_outside = 0;            ///< times before the first frame or after the last
  std::int64_t num_inexact = 0;            ///< times at which the truth is not known well enough
  double worst_left_out_m = 0.0;           ///< of the intervals that were used
  double worst_left_out_deg = 0.0;
};

/// Interpolates by cubics through the four frames around a time; turns as vectors of rotation.
/// Each frame between others is also predicted without itself, from the four frames 1 and 3 away
/// on both sides. That step is twice as long, so its error is about 16 times that of the cubic
/// used; an interval counts only if both its ends are predicted within the bounds. Motion that
/// repeats between frames (vibration) does not show in frames, nor here.
/// frame_times_s  as many as frames, increasing
/// throws         Input: two frames at one time
TruthAtTimes truth_at_times(PosePath frames, std::span<const double> frame_times_s,
                            std::span<const double> times_s, double most_left_out_m,
                            double most_left_out_deg);

}  // namespace terracast::validate
