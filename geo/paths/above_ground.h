#pragma once

#include <functional>
#include <string>

#include "geo/trajectory.h"

namespace terracast::geo {

/// Height of a place on a path above the measured ground.
/// where    how far along the path the place is, for the message: "after 40 m, about t = 3.1 s"
/// throws   Input: the world has no ground there
double agl_on_path_m(const Geodetic& place, const TrajectoryContext& context,
                     const std::function<std::string()>& where);

/// The lowest place of a path.
struct LowestPlace {
  double agl_m;
  double time_s;
  Geodetic place;
};
/// That of a motion, seen every 5 m.
/// most_speed_mps   of the motion
/// throws   as agl_on_path_m()
LowestPlace lowest_place_of(const Trajectory& motion, double most_speed_mps,
                            const TrajectoryContext& context);
/// Refuses a path whose lowest place is below min_agl_m.
/// advice   what the user would change: "raise waypoint 3"
/// throws   Input: by how much, with the time and the place
void refuse_too_low(const LowestPlace& lowest, double min_agl_m, const std::string& advice);

}  // namespace terracast::geo
