#include "geo/paths/over_ground.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "geo/paths/area.h"
#include "geo/paths/control_path.h"
#include "geo/units.h"

namespace terracast::geo {

TrackControls controls_along(const GroundTrack& track, double turn_radius_m,
                             const std::string& advice) {
  constexpr double kMostSteps = 400000.0;
  const double step_m = std::clamp(turn_radius_m / 6.0, 0.5, 10.0);
  const double steps = std::ceil(track.length_m() / step_m);
  if (steps > kMostSteps)
    core::fail(core::ErrorKind::Config,
               "the lines are {:.0f} km long; that is more than {:.0f} steps of {:.1f} m. {}",
               track.length_m() / 1000.0, kMostSteps, step_m, advice);
  const auto num_steps = std::max<std::size_t>(static_cast<std::size_t>(steps), 4);
  TrackControls result{.controls = {},
                       .spacing_m = track.length_m() / static_cast<double>(num_steps)};
  for (std::size_t i = 0; i <= num_steps; ++i) {
    const Eigen::Vector2d at = track.at(result.spacing_m * static_cast<double>(i));
    result.controls.emplace_back(at.x(), at.y(), 0.0);
  }
  return result;
}

void follow_terrain(const TerrainProfile& profile, const TrajectoryContext& context,
                    TrackControls& track) {
  std::vector<double> ground_m;
  for (const Eigen::Vector3d& control : track.controls)
    ground_m.push_back(
        ground_w_m(control.head<2>(), ground_m.empty() ? 0.0 : ground_m.back(), context));
  const int reach =
      std::max(1, static_cast<int>(std::ceil(profile.follow_length_m / track.spacing_m)));
  std::vector<double> heights = smoothed(ground_m, reach, false);
  // The spline stays within so many controls on both sides.
  const std::vector<double> obstacles =
      widened(ground_m, UniformSpline::reach_of(profile.continuity), false);
  for (std::size_t i = 0; i < heights.size(); ++i)
    heights[i] = std::max(heights[i] + profile.height_m, obstacles[i] + profile.min_agl_m);
  constexpr double kShareOfClimb = 0.95;  // what is left is for the last corrections
  limit_steps(heights, track.spacing_m *
                           std::tan(radians_from_degrees(kShareOfClimb * profile.max_climb_deg)));
  for (std::size_t i = 0; i < heights.size(); ++i) track.controls[i].z() = heights[i];
}

double highest_ground_w_m(const TrackControls& track, double least_w_m,
                          const TrajectoryContext& context) {
  double highest_w_m = least_w_m;
  for (const Eigen::Vector3d& control : track.controls)
    highest_w_m = std::max(highest_w_m, ground_w_m(control.head<2>(), highest_w_m, context));
  return highest_w_m;
}

}  // namespace terracast::geo
