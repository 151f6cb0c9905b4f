#pragma once

#include <Eigen/Core>
#include <functional>
#include <span>
#include <vector>

#include "core/log.h"
#include "geo/trajectory.h"
#include "job/traffic/encounters.h"
#include "job/traffic/traffic.h"
#include "scene/moving/moving_bodies.h"

namespace terracast::job {

/// Water at a place.
struct WaterAt {
  bool is_water = false;
  bool is_sea = false;
  double depth_m = 0.0;
};

/// Where ships go.
struct WaterSite {
  std::function<WaterAt(const Eigen::Vector2d& at_world)> water;  ///< threads: one at a time
  std::vector<Eigen::Vector2d> standing;  ///< places of what stands in the water
  double half_size_m = 0.0;               ///< of the world's square
  std::vector<Obstacle> obstacles;        ///< what else moves on the water
  double reach_s = 0.0;                   ///< as of TrafficSite
};

/// From the shore, from shoals and from what stands in the water a ship's middle stays farther than this and half its own
/// length. Where a shore is differs between a world's levels by tens of metres.
inline constexpr double kOffShore_m = 160.0;

/// How far from the cameras whoever may be seen from them, or may be in the way of these, may be in that time, and the
/// water beyond that which they look at.
double reach_of_ships_m(std::span<const TrafficOptions> options, double duration_s);

/// Ships and boats on open water within reach of a sequence's cameras, each straight ahead at one speed: where and as
/// what they go is drawn for each square kilometre, so it does not depend on the cameras. Who has no course that is
/// clear and deep enough is not there, and of two that come too near to each other the one of the higher key; as of
/// lay_out_traffic() the rest.
/// options   of ships alone
std::vector<scene::MovingThing> lay_out_ships(std::span<const TrafficOptions> options,
                                              std::span<const geo::BodyState> frames,
                                              double duration_s, const WaterSite& site,
                                              const core::Log& log);

}  // namespace terracast::job
