#include "tiler/objects/vehicle_mix.h"

#include <array>

#include "core/error.h"
#include "core/random.h"
#include "tiler/objects/things.h"

namespace terracast::tiler {
namespace {

using world::WayKind;

// Daily flows of 40 000, 20 000, 10 000, … vehicles at 120 to 40 km/h, a fifteenth of them in an hour.
constexpr std::array<RoadTraffic, 11> kRoads = {
    {{"motorway", WayKind::Motorway, 10.0, 0.22},
     {"trunk", WayKind::Trunk, 9.0, 0.18},
     {"primary", WayKind::Primary, 8.0, 0.10},
     {"secondary", WayKind::Secondary, 6.0, 0.08},
     {"tertiary", WayKind::Tertiary, 3.5, 0.06},
     {"motorway_link", WayKind::MotorwayLink, 6.0, 0.15},
     {"trunk_link", WayKind::TrunkLink, 5.0, 0.12},
     {"primary_link", WayKind::PrimaryLink, 4.0, 0.08},
     {"unclassified", WayKind::Unclassified, 1.0, 0.05},
     {"residential", WayKind::Residential, 1.2, 0.03},
     {"living_street", WayKind::LivingStreet, 0.8, 0.0}}};

constexpr Chance kCars[] = {{"hatchback", 0.27}, {"city_car", 0.11}, {"sedan", 0.19},
                            {"estate", 0.15},    {"suv", 0.18},      {"small_van", 0.04},
                            {"van", 0.05},       {"pickup", 0.01}};
constexpr Chance kLong[] = {{"articulated_truck", 0.55},
                            {"tank_truck", 0.08},
                            {"box_truck", 0.25},
                            {"coach", 0.07},
                            {"tipper", 0.05}};
constexpr Chance kTown[] = {
    {"box_truck", 0.35}, {"city_bus", 0.40}, {"articulated_bus", 0.08}, {"tipper", 0.17}};

}  // namespace

DrawnThing draw_thing(std::span<const Chance> chances, std::uint64_t draw) {
  double left = static_cast<double>(draw >> 11U) * 0x1.0p-53;
  std::string_view name = chances.back().thing;
  for (const Chance& chance : chances) {
    if (left < chance.share) {
      name = chance.thing;
      break;
    }
    left -= chance.share;
  }
  const ThingInfo* thing = find_thing(name);
  TERRACAST_CHECK(thing != nullptr, "there is no thing {}", name);
  return {.thing = thing,
          .variant = static_cast<int>(core::mix_bits(draw) %
                                      static_cast<std::uint64_t>(thing->num_variants))};
}

std::span<const RoadTraffic> road_traffic() { return kRoads; }

std::span<const Chance> vehicles_on(const RoadTraffic& road, bool is_heavy) {
  if (!is_heavy) return kCars;
  return road.trucks > 0.09 ? std::span<const Chance>(kLong) : std::span<const Chance>(kTown);
}

}  // namespace terracast::tiler
