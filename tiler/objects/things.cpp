#include "tiler/objects/things.h"

#include <fmt/format.h>

#include <algorithm>

// Every family of built-in things: X(name) is tiler/objects/things/name.cpp, which defines
// `std::vector<ThingInfo> name()`.
#define TERRACAST_THING_FAMILIES(X) \
  X(aircraft)                       \
  X(barriers)                       \
  X(boats)                          \
  X(buses)                          \
  X(cars)                           \
  X(containers)                     \
  X(drones)                         \
  X(halls)                          \
  X(helicopters)                    \
  X(jet_bridges)                    \
  X(light_aircraft)                 \
  X(masts)                          \
  X(people)                         \
  X(port_cranes)                    \
  X(power_lines)                    \
  X(ships)                          \
  X(tanks)                          \
  X(towers)                         \
  X(trains)                         \
  X(trucks)                         \
  X(wind_turbines)

namespace terracast::tiler {

#define TERRACAST_DECLARE(name) std::vector<ThingInfo> name();
TERRACAST_THING_FAMILIES(TERRACAST_DECLARE)
#undef TERRACAST_DECLARE

std::span<const ThingInfo> all_things() {
  static const std::vector<ThingInfo> table = [] {
    std::vector<ThingInfo> all;
    const auto add = [&](std::string_view family, std::vector<ThingInfo> things) {
      for (ThingInfo& thing : things) {
        thing.family = family;
        all.push_back(std::move(thing));
      }
    };
#define TERRACAST_ENTRY(name) add(#name, name());
    TERRACAST_THING_FAMILIES(TERRACAST_ENTRY)
#undef TERRACAST_ENTRY
    return all;
  }();
  return table;
}

const ThingInfo* find_thing(std::string_view name) {
  const std::span<const ThingInfo> all = all_things();
  const auto found = std::find_if(all.begin(), all.end(),
                                  [&](const ThingInfo& thing) { return thing.name == name; });
  return found == all.end() ? nullptr : &*found;
}

std::vector<std::string> thing_names() {
  std::vector<std::string> names;
  for (const ThingInfo& thing : all_things()) names.push_back(thing.name);
  return names;
}

world::Prototype thing_prototype(const ThingInfo& thing, int variant) {
  world::Prototype prototype;
  prototype.name = thing.num_variants == 1 ? thing.name : fmt::format("{} {}", thing.name, variant);
  for (std::size_t detail = 0; detail < thing.coarsest_levels.size(); ++detail) {
    ThingMesh mesh(thing.semantic_class);
    thing.build(mesh, static_cast<int>(detail), variant);
    prototype.levels.push_back(
        {.coarsest_level = static_cast<std::int8_t>(thing.coarsest_levels[detail]),
         .shape = mesh.shape()});
  }
  return prototype;
}

MovableThing movable_thing(const ThingInfo& thing, int variant) {
  ThingMesh mesh(thing.semantic_class, true);
  thing.build(mesh, 0, variant);
  return {.shape = mesh.shape(), .turning = mesh.turning_shapes()};
}

int round_sides(int finest, int detail) {
  static constexpr double kShares[] = {1.0, 0.6, 0.35, 0.25};
  const double share = kShares[std::clamp(detail, 0, 3)];
  return std::max(4, 2 * static_cast<int>(0.5 * finest * share + 0.5));
}

}  // namespace terracast::tiler
