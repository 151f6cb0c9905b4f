#include "geo/paths/above_ground.h"

#include <cmath>
#include <limits>

#include "core/error.h"
#include "geo/paths/place.h"

namespace terracast::geo {

double agl_on_path_m(const Geodetic& place, const TrajectoryContext& context,
                     const std::function<std::string()>& where) {
  const std::optional<double> ground_m = context.ground_height_m(place.lat_deg, place.lon_deg);
  if (!ground_m || !std::isfinite(*ground_m)) {
    core::fail(core::ErrorKind::Input,
               "the path leaves the world's ground {} ({}); shorten or move it, or make the world "
               "larger",
               where(), text_of(place));
  }
  return place.height_m - *ground_m;
}

LowestPlace lowest_place_of(const Trajectory& motion, double most_speed_mps,
                            const TrajectoryContext& context) {
  constexpr double kSpacing_m = 5.0;
  LowestPlace lowest{.agl_m = std::numeric_limits<double>::infinity(), .time_s = 0.0, .place = {}};
  const double count = std::ceil(motion.duration_s() * most_speed_mps / kSpacing_m) + 1.0;
  for (double k = 0.0; k <= count; k += 1.0) {
    const double time_s = motion.duration_s() * k / count;
    const Geodetic place =
        context.frame.geodetic_from_world(motion.at(time_s).world_from_body.translation);
    const double agl_m =
        agl_on_path_m(place, context, [&] { return fmt::format("at t = {:.1f} s", time_s); });
    if (agl_m < lowest.agl_m) lowest = {agl_m, time_s, place};
  }
  return lowest;
}

void refuse_too_low(const LowestPlace& lowest, double min_agl_m, const std::string& advice) {
  // A flight at just the least height is one: heights between waypoints are level to a centimetre.
  constexpr double kAglTolerance_m = 0.01;
  if (lowest.agl_m >= min_agl_m - kAglTolerance_m) return;
  const std::string found =
      lowest.agl_m < 0.0 ? fmt::format("{:.1f} m below the ground", -lowest.agl_m)
                         : fmt::format("{:.1f} m above the ground, less than min_agl_m = {:.1f} m,",
                                       lowest.agl_m, min_agl_m);
  core::fail(core::ErrorKind::Input, "the path is {} at t = {:.1f} s ({}); {}", found,
             lowest.time_s, text_of(lowest.place), advice);
}

}  // namespace terracast::geo
