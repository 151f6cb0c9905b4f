#pragma once

#include <string>

#include "tests/jobs/draws.h"

namespace terracast::test {

/// How a multicopter is flown by hand: it hovers, starts, stops, turns on the spot, climbs and sinks.
struct HandFlight {
  double frame_s = 0.1;     ///< from frame to frame: what it does takes some of them
  double duration_s = 1.0;  ///< without what it hovers before and after
  double speed_mps = 5.0;   ///< where it goes
  double climb_m = 0.0;     ///< the most that it leaves its height
};

/// Its log: a table of time_s, x, y, z in metres about its start and yaw, pitch, roll in degrees, whose axes are forward,
/// right, down.
std::string draw_log(Draws& draws, const HandFlight& flight);

}  // namespace terracast::test
