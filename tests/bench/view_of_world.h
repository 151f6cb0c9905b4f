#pragma once

#include <Eigen/Geometry>
#include <cstdio>
#include <cstdlib>
#include <optional>

#include "geo/units.h"
#include "tests/support/hills_flight.h"

/// Views of tiled worlds that benchmarks are given by the environment.
namespace terracast::bench {

/// A camera looks along a heading (anticlockwise from east), turned down by a pitch.
struct Place {
  double east_m, north_m, agl_m, heading_deg, pitch_deg;
};

/// TERRACAST_BENCH_VIEW=east,north,agl,heading,pitch; nullopt: none is given.
inline std::optional<Place> place_asked() {
  Place place{};
  const char* view = std::getenv("TERRACAST_BENCH_VIEW");
  if (view == nullptr || std::sscanf(view, "%lf,%lf,%lf,%lf,%lf", &place.east_m, &place.north_m,
                                     &place.agl_m, &place.heading_deg, &place.pitch_deg) != 5)
    return std::nullopt;
  return place;
}

/// Three frames of a pair and a third camera that looks aside, of one colour sample.
inline render::SequencePlan flight_at(const Place& place, double ground_z_m, int width_px,
                                      int height_px) {
  render::SequencePlan plan = test::small_plan(3, width_px, height_px);
  plan.cameras = test::small_rig(width_px, height_px, place.pitch_deg);
  plan.conditions.color_samples = 1;
  const Eigen::Quaterniond heading(
      Eigen::AngleAxisd(geo::radians_from_degrees(place.heading_deg), Eigen::Vector3d::UnitZ()));
  for (int i = 0; i < 3; ++i) {
    geo::BodyState& state = plan.states[static_cast<std::size_t>(i)];
    state.world_from_body.rotation = heading;
    state.world_from_body.translation =
        Eigen::Vector3d(place.east_m, place.north_m, ground_z_m + place.agl_m) +
        heading * Eigen::Vector3d(8.0 * (i - 1), 0.0, 0.0);
  }
  return plan;
}

}  // namespace terracast::bench
