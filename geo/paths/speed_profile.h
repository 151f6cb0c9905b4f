#pragma once

#include <vector>

#include "geo/paths/continuity.h"

namespace terracast::geo {

/// The speed wanted at a length along the path.
struct SpeedAt {
  double length_m;
  double speed_mps;
};

/// Length travelled over time. Between two speeds the speed follows the smooth step 3 x^2 - 2 x^3
/// of the time between them, so that the length is twice continuously differentiable, or
/// 35 x^4 - 84 x^5 + 70 x^6 - 20 x^7, four times; equal speeds give constant speed.
class SpeedProfile {
 public:
  struct Value {
    double length_m;
    double speed_mps;
    double acceleration_mps2;
    double jerk_mps3;  ///< where it jumps, that of the leg that follows
  };

  /// speeds   lengths increasing from 0, two or more; speeds positive
  explicit SpeedProfile(const std::vector<SpeedAt>& speeds,
                        Continuity continuity = Continuity::Second);

  double duration_s() const { return legs_.back().start_s + legs_.back().duration_s; }
  /// First time at which a length has been travelled, by bisection to the last digit or two.
  double time_at(double length_m) const;
  /// Times from 0 to the end between which all derivatives are continuous.
  std::vector<double> knots_s() const;
  Value at(double time_s) const;

 private:
  struct Leg {
    double start_s, duration_s, start_m, start_mps, end_mps;
  };
  std::vector<Leg> legs_;
  Continuity continuity_;
};

}  // namespace terracast::geo
