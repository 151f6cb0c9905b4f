#include "geo/air/flight_air.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "geo/paths/above_ground.h"
#include "geo/paths/uniform_spline.h"

namespace terracast::geo {

WindField::Place FlightAir::place_in_air(const WorldFrame& frame, double time_s,
                                         const Eigen::Vector3d& place_world) const {
  return {.world_from_enu = frame.world_from_enu(place_world),
          .agl_m = frame.geodetic_from_world(place_world).height_m - ground_height_m(time_s)};
}

MetAir met_air(const FlightAir* air, const WorldFrame& frame, double time_s,
               const Eigen::Vector3d& place_world, const Eigen::Vector3d& velocity_world_mps,
               const Eigen::Vector3d& way) {
  if (!air) return {};
  const WindField::Place place = air->place_in_air(frame, time_s, place_world);
  const AirWay rate =
      air->wind.way_rate(place.agl_m, (velocity_world_mps - air->wind.mean_mps(place)).norm());
  const double distance_rate_mps = time_s < 0.0 ? 0.0 : rate.distance_m;
  // Derivatives by differences look a little before the beginning.
  const AirWay met{.distance_m = std::max(way[0], 0.0),
                   .level_lengths = std::max(way[1], 0.0),
                   .vertical_lengths = std::max(way[2], 0.0)};
  return {.wind_world_mps = air->wind.at(place, met),
          .way_rate = {distance_rate_mps, rate.level_lengths, rate.vertical_lengths}};
}

FlightAir air_along(const Trajectory& plan, const WindOptions& options,
                    const TrajectoryContext& context, double before_s, double after_s,
                    double max_off_m) {
  constexpr double kSpacing_s = 0.5;
  const double whole_s = before_s + plan.duration_s() + after_s;
  const double count = std::ceil(whole_s / kSpacing_s);
  const double spacing_s = whole_s / count;
  const WindField still_air(options, 0.0, 0.0);
  std::vector<double> grounds_m;
  double least_agl_m = std::numeric_limits<double>::infinity(), distance_m = 0.0;
  for (double i = 0.0; i <= count; i += 1.0) {
    const double time_s = i * spacing_s - before_s;
    const MotionState state = plan.at(time_s);
    const Eigen::Vector3d& position = state.world_from_body.translation;
    const Geodetic place = context.frame.geodetic_from_world(position);
    const double agl_m =
        agl_on_path_m(place, context, [&] { return fmt::format("at t = {:.1f} s", time_s); });
    grounds_m.push_back(place.height_m - agl_m);
    least_agl_m = std::min(least_agl_m, agl_m);
    const double wind_mps =
        still_air
            .mean_mps({.world_from_enu = context.frame.world_from_enu(position), .agl_m = agl_m})
            .norm();
    distance_m += spacing_s * (state.velocity_world_mps.norm() + wind_mps);
  }
  // It moves about its path as well.
  constexpr double kMoreDistance = 1.25, kMoreDistance_m = 200.0;
  return {
      .wind =
          WindField(options, kMoreDistance * distance_m + kMoreDistance_m, least_agl_m - max_off_m),
      .ground_height_m = [ground = UniformSpline(std::move(grounds_m), whole_s, false),
                          before_s](double time_s) { return ground.at(time_s + before_s).value; }};
}

}  // namespace terracast::geo
