#pragma once

#include <Eigen/Core>
#include <vector>

#include "geo/paths/least_snap.h"

namespace terracast::geo {

/// The sizes that velocity, acceleration and jerk do not pass.
struct MotionLimits {
  double speed_mps;
  double acceleration_mps2;
  double jerk_mps3;
};

/// The largest speed, acceleration or jerk of a piece, and when it is reached.
struct Peak {
  double size;
  double time_s;
};
struct PiecePeaks {
  Peak speed_mps, acceleration_mps2, jerk_mps3;
};

/// Peaks at the true extrema of a piece: at the roots of the derivatives of the squared sizes.
PiecePeaks peaks_of(const LeastSnapCurve& curve, std::size_t piece);

/// How much slower a piece would have to be flown to be within limits; below 1: it could be faster.
double slowing_of(const PiecePeaks& peaks, const MotionLimits& limits);

/// How the time of a flight is dealt to the pieces between its points.
enum class Timing {
  Shortest,  ///< each piece as fast as the limits let it
  Smoothest  ///< the least snap that any dealing of the flight's time gives
};

/// The curve of least snap through points whose durations are chosen so that it reaches one of the limits and passes
/// none. Smoothest: by gradient descent on log(cost) + 7 log(duration), which does not depend on how fast the whole is
/// flown. Shortest: from there on, pieces are shortened by what they fall short of the limits, as long as
/// the whole becomes shorter.
/// points     as LeastSnapCurve
/// accuracy   limits are kept to 1e-9 of them, at true extrema
/// cost       2 ms a point
LeastSnapCurve fit_within(const std::vector<Eigen::Vector3d>& points, bool is_closed,
                          const MotionLimits& limits, Timing timing);

}  // namespace terracast::geo
