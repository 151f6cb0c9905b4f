#pragma once

#include <Eigen/Core>
#include <functional>

#include "geo/air/wind.h"
#include "geo/trajectory.h"

/// The wind along a flight.
namespace terracast::geo {

struct FlightAir {
  WindField wind;
  /// Height of the ground below the flight, above the ellipsoid, by the flight's time; smooth.
  std::function<double(double time_s)> ground_height_m;

  WindField::Place place_in_air(const WorldFrame& frame, double time_s,
                                const Eigen::Vector3d& place_world) const;
};

/// The air about a body: its wind, and how fast the body's way through it grows.
struct MetAir {
  Eigen::Vector3d wind_world_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d way_rate = Eigen::Vector3d::Zero();
};
/// Gusts begin with the flight, at time 0, however long it settles before; turbulence is met all the time.
/// air        null: calm
/// way        as AirWay; its distance from time 0 on
MetAir met_air(const FlightAir* air, const WorldFrame& frame, double time_s,
               const Eigen::Vector3d& place_world, const Eigen::Vector3d& velocity_world_mps,
               const Eigen::Vector3d& way);

/// The air along a plan, from `before_s` before its beginning to `after_s` after its end. The ground is that below the
/// plan, every half second, smoothed by a cubic spline.
/// max_off_m   how far below the plan the flight may come
/// throws      Input: no ground there; turbulence that is too fine for the way
FlightAir air_along(const Trajectory& plan, const WindOptions& options,
                    const TrajectoryContext& context, double before_s, double after_s,
                    double max_off_m);

}  // namespace terracast::geo
