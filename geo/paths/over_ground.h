#pragma once

#include <Eigen/Core>
#include <vector>

#include "geo/paths/ground_track.h"
#include "geo/paths/uniform_spline.h"
#include "geo/trajectory.h"

namespace terracast::geo {

/// Evenly spaced controls of a path that is laid out on the map; heights are above the Earth's curve (flattened).
struct TrackControls {
  std::vector<Eigen::Vector3d> controls;
  double spacing_m;
};

/// Controls along a way on the map, with height 0, near enough for its turns.
/// throws Config: a way too long; `advice` says what would shorten it
TrackControls controls_along(const GroundTrack& track, double turn_radius_m,
                             const std::string& advice);

/// A flight at a height above the ground below.
struct TerrainProfile {
  double height_m;   ///< above the ground, averaged over follow_length_m to both sides
  double min_agl_m;  ///< and nowhere nearer to it than this
  double follow_length_m;
  double max_climb_deg;  ///< raised where the ground falls or rises more steeply
  Continuity continuity;
};

/// Sets the heights of controls so that the path through them keeps a profile.
/// throws Input: the world has no ground there
void follow_terrain(const TerrainProfile& profile, const TrajectoryContext& context,
                    TrackControls& track);

/// The highest ground below controls, flattened; at least `least_w_m`.
/// throws Input: the world has no ground there
double highest_ground_w_m(const TrackControls& track, double least_w_m,
                          const TrajectoryContext& context);

}  // namespace terracast::geo
