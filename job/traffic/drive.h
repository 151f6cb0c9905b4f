#pragma once

#include <vector>

#include "job/traffic/lane_path.h"

namespace terracast::job {

/// How fast one goes: what the way allows, slower in bends, at bounded acceleration.
struct DriveStyle {
  double lateral_mps2 = 2.0;  ///< in bends
  double accelerate_mps2 = 1.2;
  double brake_mps2 = 1.8;
  double length_m =
      0.0;  ///< behind the place that is driven: limits hold until all of it has passed
};

/// The speed along a curve: v^2 is linear between places a metre apart. It is the same for all of one style on one curve,
/// but for what comes after: who turns off is slower before than who does not.
class Drive {
 public:
  Drive(const PathCurve& curve, const DriveStyle& style);

  double duration_s() const { return times_s_.back(); }
  /// When one that begins at the curve's start is there.
  double time_s(double at_m) const;
  struct Progress {
    double at_m = 0.0;
    double speed_mps = 0.0;
    double acceleration_mps2 = 0.0;
  };
  /// time_s   in [0, duration_s]
  Progress at(double time_s) const;

 private:
  /// No place is passed faster than those up to so far before it.
  void hold_limits(double length_m);

  double step_m_ = 1.0;
  std::vector<double> speeds_mps_;  ///< at each step
  std::vector<double> times_s_;
};

}  // namespace terracast::job
