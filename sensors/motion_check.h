#pragma once

#include "geo/trajectory.h"

namespace terracast::sensors {

/// A second base of those sensors for which not every motion will do. Threads: safe.
class MotionCheck {
 public:
  virtual ~MotionCheck() = default;
  /// Whether the sensor can measure on a motion, which is asked before anything is rendered.
  /// throws   Config: it cannot, and why
  virtual void check_motion(const geo::Trajectory& motion) const = 0;
};

}  // namespace terracast::sensors
