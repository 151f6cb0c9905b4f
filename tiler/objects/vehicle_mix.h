#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "world/way_network.h"

namespace terracast::tiler {

struct ThingInfo;

/// One of several things.
struct Chance {
  std::string_view thing;
  double share;
};

/// A thing in one of its colours.
struct DrawnThing {
  const ThingInfo* thing = nullptr;
  int variant = 0;
};
/// draw     64 random bits
/// throws   Internal: a thing that there is none of
DrawnThing draw_thing(std::span<const Chance> chances, std::uint64_t draw);

/// How busy a class of roads is by day.
struct RoadTraffic {
  std::string_view highway;
  world::WayKind kind;
  double per_lane_km;  ///< vehicles at one time: flow over speed by day
  double trucks;       ///< share
};
/// Those that have traffic.
std::span<const RoadTraffic> road_traffic();

/// What drives there: cars, or what is counted as trucks.
std::span<const Chance> vehicles_on(const RoadTraffic& road, bool is_heavy);

}  // namespace terracast::tiler
