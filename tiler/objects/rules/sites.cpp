#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "tiler/objects/area_grid.h"
#include "tiler/objects/object_tags.h"
#include "tiler/objects/rules.h"
#include "tiler/objects/things.h"

// Airfields, ports, marinas, ships, and what stands alone.
namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

constexpr Chance kAirliners[] = {
    {"airliner", 0.40}, {"airliner_with_winglets", 0.40}, {"turboprop", 0.14}, {"wide_body", 0.06}};
constexpr Chance kSmallPlanes[] = {
    {"light_aircraft", 0.55}, {"light_low_wing", 0.35}, {"business_jet", 0.10}};

/// From a terminal, where its line begins, to the door of an aircraft.
void add_jet_bridge(const VectorFeature& feature, std::uint64_t stream, Proposals& to) {
  if (feature.kind != FeatureKind::Line || feature.parts_world.empty() ||
      feature.parts_world.front().empty())
    return;
  const Walk walk(feature.parts_world.front().front());
  if (walk.length_m() < 8.0 || walk.length_m() > 60.0) return;
  const Vector2d reach = walk.at(walk.length_m()) - walk.at(0.0);
  Candidate bridge{.rule = Rule::Aircraft,
                   .footing = Footing::Any,
                   .feature = feature.number,
                   .key = core::stream_of(stream, 2),
                   .joins = true};
  bridge.thing = thing_row("jet_bridge");
  const double scale = reach.norm() / all_things()[bridge.thing].size_m.x();
  if (scale < 0.6 || scale > 1.8) return;
  bridge.scale = static_cast<std::uint16_t>(std::lround(4096.0 * scale));
  bridge.place_world = walk.at(0.0) + 0.5 * reach;
  bridge.heading = heading_of(reach.normalized());
  to.candidates.push_back(bridge);
}

}  // namespace

void propose_aircraft(const RuleInputs& inputs, Proposals& to) {
  bool has_stands = false;
  for (const VectorFeature& feature : inputs.features)
    has_stands = has_stands || ObjectTags(feature.tags).value("aeroway") == "parking_position";
  for (const VectorFeature& feature : inputs.features) {
    const std::string_view aeroway = ObjectTags(feature.tags).value("aeroway");
    const std::uint64_t stream = core::stream_of(0x61697263ULL, feature.number);
    const auto is_taken = [&](std::uint64_t number) {
      return core::random_unit(inputs.seed, stream, number) < inputs.options.aircraft;
    };
    const auto add = [&](const Vector2d& place, std::uint16_t heading,
                         std::span<const Chance> chances, std::uint64_t number) {
      Candidate plane{.rule = Rule::Aircraft,
                      .footing = Footing::Paved,
                      .feature = feature.number,
                      .key = core::stream_of(stream, number),
                      .steepest = 0.03};
      choose(plane, chances, core::random_bits(inputs.seed, core::stream_of(stream, number), 1));
      plane.place_world = place;
      plane.heading = heading;
      to.candidates.push_back(plane);
    };
    if (aeroway == "parking_position" && is_taken(0)) {
      // A line leads the nose wheel to where it stops; the aircraft stands behind that.
      if (feature.kind == FeatureKind::Line && !feature.parts_world.empty() &&
          !feature.parts_world.front().empty()) {
        const Walk walk(feature.parts_world.front().front());
        if (walk.length_m() < 5.0) continue;
        const Vector2d direction = walk.direction(walk.length_m());
        const bool is_small = walk.length_m() < 22.0;
        add(walk.at(walk.length_m()), heading_of(direction),
            is_small ? std::span<const Chance>(kSmallPlanes) : std::span<const Chance>(kAirliners),
            1);
        // Its nose is so far before its nose wheel.
        Candidate& plane = to.candidates.back();
        plane.place_world -=
            (0.5 * all_things()[plane.thing].size_m.x() - (is_small ? 1.5 : 6.0)) * direction;
      } else if (feature.kind == FeatureKind::Point) {
        const auto direction = ObjectTags(feature.tags).direction_deg("direction");
        add(middle_of(feature), heading_of_compass(direction.value_or(0.0)), kAirliners, 1);
      }
    } else if (aeroway == "jet_bridge") {
      add_jet_bridge(feature, stream, to);
    } else if (aeroway == "helipad" && is_taken(0)) {
      static constexpr Chance kHelicopters[] = {{"helicopter", 0.6}, {"rescue_helicopter", 0.4}};
      add(middle_of(feature), static_cast<std::uint16_t>(core::random_bits(inputs.seed, stream, 3)),
          kHelicopters, 1);
    } else if (aeroway == "apron" && feature.kind == FeatureKind::Area && !has_stands) {
      for (const auto& rings : feature.parts_world) {
        if (rings.empty() || rings.front().size() < 3) continue;
        const double area = area_m2(rings);
        if (area > 4e6) continue;
        const bool is_large = area > 25000.0;
        const double wide = is_large ? 44.0 : 14.0;
        const double deep = is_large ? 62.0 : 20.0;
        visit_grid(rings, wide, deep, 0.5 * wide, 0.40 * deep,
                   [&](const Vector2d& place, const Vector2d& direction, int row, int column,
                       int rows, int) {
                     // Rows in the middle are for taxiing.
                     if (rows >= 3 && row % 3 == 1) return;
                     const auto number = static_cast<std::uint64_t>(row) * 4096U +
                                         static_cast<std::uint64_t>(column) + 16U;
                     if (!is_taken(number)) return;
                     const Vector2d left(-direction.y(), direction.x());
                     add(place, heading_of(2 * row + 1 >= rows ? left : Vector2d(-left)),
                         is_large ? std::span<const Chance>(kAirliners)
                                  : std::span<const Chance>(kSmallPlanes),
                         number);
                   });
      }
    }
  }
}

void propose_ports(const RuleInputs& inputs, Proposals& to) {
  static constexpr Chance kBoxes[] = {{"container_40", 0.45}, {"container_40_high", 0.55}};
  for (const VectorFeature& feature : inputs.features) {
    if (feature.kind != FeatureKind::Area) continue;
    const std::string_view landuse = ObjectTags(feature.tags).value("landuse");
    const std::string_view industrial = ObjectTags(feature.tags).value("industrial");
    if (landuse != "port" && landuse != "harbour" && landuse != "container_terminal" &&
        industrial != "port" && industrial != "container_terminal" &&
        ObjectTags(feature.tags).value("port") != "container")
      continue;
    const std::uint64_t stream = core::stream_of(0x706f7274ULL, feature.number);
    for (const auto& rings : feature.parts_world) {
      if (rings.empty() || rings.front().size() < 3 || area_m2(rings) > 2e7) continue;
      // Blocks of six rows across and ten containers along, with lanes between them; a crane over some.
      visit_grid(rings, 12.19 * 10 + 18.0, 34.0, 64.0, 15.0,
                 [&](const Vector2d& middle, const Vector2d& direction, int block_row,
                     int block_column, int, int) {
                   const Vector2d left(-direction.y(), direction.x());
                   const std::uint64_t block =
                       core::stream_of(stream, static_cast<std::uint64_t>(block_row) * 65536U +
                                                   static_cast<std::uint64_t>(block_column));
                   const auto add_crane = [&](double along_m) {
                     Candidate crane{.rule = Rule::Ports,
                                     .footing = Footing::Land,
                                     .feature = feature.number,
                                     .key = core::stream_of(block, 0x10000),
                                     .steepest = 0.05};
                     crane.thing = thing_row("yard_crane");
                     crane.variant =
                         static_cast<std::uint8_t>(core::random_bits(inputs.seed, stream, 9) % 3U);
                     crane.place_world = middle + along_m * direction;
                     crane.heading = heading_of(direction);
                     to.candidates.push_back(crane);
                   };
                   const int gap = (core::random_bits(inputs.seed, block, 1) & 1U) != 0 ? 4 : -1;
                   if (gap >= 0) add_crane((gap - 4.5) * 12.5);
                   for (int row = 0; row < 6; ++row)
                     for (int column = 0; column < 10; ++column) {
                       if (column == gap) continue;  // the crane stands here
                       const auto number = static_cast<std::uint64_t>(row * 16 + column);
                       if (core::random_unit(inputs.seed, block, 16 + 4 * number) >=
                           inputs.options.containers)
                         continue;
                       Candidate pile{.rule = Rule::Ports,
                                      .footing = Footing::Land,
                                      .feature = feature.number,
                                      .key = core::stream_of(block, number),
                                      .steepest = 0.05};
                       choose(pile, kBoxes, core::random_bits(inputs.seed, block, 17 + 4 * number));
                       pile.num_stacked = static_cast<std::uint8_t>(
                           1 + core::random_bits(inputs.seed, block, 18 + 4 * number) % 4U);
                       pile.place_world =
                           middle + (column - 4.5) * 12.5 * direction + (row - 2.5) * 2.9 * left;
                       pile.heading = static_cast<std::uint16_t>(heading_of(direction) +
                                                                 ((number & 1U) != 0 ? 32768 : 0));
                       to.candidates.push_back(pile);
                     }
                 });
      // Cranes and ships along edges that lie at the water.
      const PointsWorld& ring = rings.front();
      std::uint64_t number = 0;
      for (std::size_t i = 0; i < ring.size(); ++i) {
        const Vector2d edge = ring[(i + 1) % ring.size()] - ring[i];
        const double length_m = edge.norm();
        if (length_m < 120.0) continue;
        const Vector2d along = edge / length_m;
        Vector2d out(along.y(), -along.x());
        if (is_inside(rings, ring[i] + 0.5 * edge + 5.0 * out)) out = -out;
        // How far off the water begins.
        double quay_m = -1.0;
        for (double off = 0.0; off <= 40.0 && quay_m < 0.0; off += 4.0)
          if (inputs.is_water(ring[i] + 0.5 * edge + (off + 20.0) * out) &&
              inputs.is_water(ring[i] + 0.5 * edge + (off + 45.0) * out))
            quay_m = off;
        if (quay_m < 0.0) continue;
        const int num_cranes = std::min(static_cast<int>(length_m / 90.0), 12);
        for (int k = 0; k < num_cranes; ++k) {
          Candidate crane{.rule = Rule::Ports,
                          .footing = Footing::Land,
                          .feature = feature.number,
                          .key = core::stream_of(stream, 0x20000 + number++),
                          .steepest = 0.05};
          crane.thing = thing_row("gantry_crane");
          crane.variant = static_cast<std::uint8_t>(core::random_bits(inputs.seed, stream, 9) % 3U);
          crane.place_world = ring[i] + (k + 0.5) * length_m / num_cranes * along - 21.0 * out;
          crane.heading = heading_of(out);
          to.candidates.push_back(crane);
        }
        if (!inputs.options.ships) continue;
        Candidate ship{.rule = Rule::Ports,
                       .footing = Footing::Water,
                       .feature = feature.number,
                       .key = core::stream_of(stream, 0x30000 + number++)};
        ship.thing = thing_row(length_m > 330.0 ? "container_ship" : "feeder_ship");
        const double half_m = 0.5 * all_things()[ship.thing].size_m.y();
        ship.place_world = ring[i] + 0.5 * edge + (quay_m + 22.0 + half_m) * out;
        ship.heading = heading_of(along);
        if (length_m > 160.0) to.candidates.push_back(ship);
      }
    }
  }
}

void propose_boats(const RuleInputs& inputs, Proposals& to) {
  static constexpr Chance kBoats[] = {
      {"sailing_yacht", 0.55}, {"motor_yacht", 0.20}, {"motor_boat", 0.25}};
  static constexpr Chance kSmall[] = {{"motor_boat", 0.5}, {"rowing_boat", 0.5}};
  for (const VectorFeature& feature : inputs.features) {
    const std::uint64_t stream = core::stream_of(0x626f6174ULL, feature.number);
    const ObjectTags tags(feature.tags);
    const bool is_mooring = tags.value("seamark:type") == "mooring" || tags.has("mooring");
    if (feature.kind == FeatureKind::Point && is_mooring) {
      if (core::random_unit(inputs.seed, stream, 0) >= inputs.options.boats) continue;
      Candidate boat{.rule = Rule::Boats,
                     .footing = Footing::Water,
                     .feature = feature.number,
                     .key = core::stream_of(stream, 1)};
      choose(boat, kBoats, core::random_bits(inputs.seed, stream, 2));
      boat.place_world = middle_of(feature);
      // At moorings all lie to one wind.
      boat.heading = static_cast<std::uint16_t>(core::random_bits(inputs.seed, 0x77696e64, 0) +
                                                core::random_bits(inputs.seed, stream, 3) % 4096U);
      to.candidates.push_back(boat);
      continue;
    }
    if (feature.kind != FeatureKind::Area || tags.value("leisure") != "marina") continue;
    for (const auto& rings : feature.parts_world) {
      if (rings.empty() || rings.front().size() < 3 || area_m2(rings) > 2e6) continue;
      // Jetties of pontoons end to end, 42 m apart, boats on both sides with their bows to them.
      visit_grid(
          rings, 12.0, 42.0, 6.0, 17.0,
          [&](const Vector2d& place, const Vector2d& direction, int row, int column, int, int) {
            const Vector2d left(-direction.y(), direction.x());
            const std::uint64_t own =
                core::stream_of(stream, static_cast<std::uint64_t>(row) * 65536U +
                                            static_cast<std::uint64_t>(column));
            Candidate pontoon{.rule = Rule::Boats,
                              .footing = Footing::Water,
                              .feature = feature.number,
                              .key = core::stream_of(own, 0)};
            pontoon.thing = thing_row("pontoon");
            pontoon.place_world = place;
            pontoon.heading = heading_of(direction);
            to.candidates.push_back(pontoon);
            for (int berth = 0; berth < 4; ++berth) {
              const auto number = static_cast<std::uint64_t>(berth) + 1U;
              if (core::random_unit(inputs.seed, own, 4 * number) >= inputs.options.boats) continue;
              Candidate boat{.rule = Rule::Boats,
                             .footing = Footing::Water,
                             .feature = feature.number,
                             .key = core::stream_of(own, number)};
              choose(
                  boat,
                  row % 3 == 2 ? std::span<const Chance>(kSmall) : std::span<const Chance>(kBoats),
                  core::random_bits(inputs.seed, own, 4 * number + 1));
              const double side = berth < 2 ? 1.0 : -1.0;
              const double off_m = 1.2 + 0.7 + 0.5 * all_things()[boat.thing].size_m.x();
              boat.place_world =
                  place + ((berth % 2 == 0 ? -3.0 : 3.0)) * direction + side * off_m * left;
              boat.heading = heading_of(-side * left);
              to.candidates.push_back(boat);
            }
          });
    }
  }
}

void propose_ships(const RuleInputs& inputs, Proposals& to) {
  static constexpr Chance kAny[] = {
      {"coaster", 0.35}, {"bulk_carrier", 0.25}, {"tanker", 0.2}, {"feeder_ship", 0.2}};
  static constexpr std::pair<std::string_view, std::string_view> kNames[] = {
      {"container", "container_ship"},  {"feeder", "feeder_ship"}, {"bulk", "bulk_carrier"},
      {"bulk_carrier", "bulk_carrier"}, {"tanker", "tanker"},      {"ferry", "ferry"},
      {"passenger", "ferry"},           {"cargo", "coaster"},      {"fishing", "fishing_boat"},
      {"sailing", "sailing_yacht"},     {"yacht", "motor_yacht"},  {"boat", "motor_boat"}};
  for (const VectorFeature& feature : inputs.features) {
    if (feature.kind != FeatureKind::Point) continue;
    const std::string_view ship = ObjectTags(feature.tags).value("ship");
    const std::string_view seamark = ObjectTags(feature.tags).value("seamark:type");
    if (ship.empty() && seamark != "anchorage" && seamark != "berth" && seamark != "anchor_berth")
      continue;
    const std::uint64_t stream = core::stream_of(0x73686970ULL, feature.number);
    Candidate own{
        .rule = Rule::Ships, .footing = Footing::Water, .feature = feature.number, .key = stream};
    choose(own, kAny, core::random_bits(inputs.seed, stream, 1));
    for (const auto& [name, thing] : kNames)
      if (ship == name) {
        const Chance chance[] = {{thing, 1.0}};
        choose(own, chance, core::random_bits(inputs.seed, stream, 1));
      }
    own.place_world = middle_of(feature);
    const auto direction = ObjectTags(feature.tags).direction_deg("direction");
    own.heading = direction ? heading_of_compass(*direction)
                            : static_cast<std::uint16_t>(core::random_bits(inputs.seed, stream, 2));
    to.candidates.push_back(own);
  }
}

void propose_landmarks(const RuleInputs& inputs, Proposals& to) {
  const std::uint64_t wind = core::random_bits(inputs.seed, 0x77696e64, 1);
  for (const VectorFeature& feature : inputs.features) {
    const ObjectTags tags(feature.tags);
    if (feature.kind == FeatureKind::Line) continue;
    const std::string_view man_made = tags.value("man_made");
    const std::uint64_t stream = core::stream_of(0x6c616e64ULL, feature.number);
    const std::uint64_t draw = core::random_bits(inputs.seed, stream, 1);
    std::string_view thing;
    double wanted_m = tags.most("height").value_or(0.0);
    double diameter_m = tags.middle("diameter").value_or(0.0);
    if (feature.kind == FeatureKind::Area && !feature.parts_world.empty() && diameter_m <= 0.0)
      diameter_m = 2.0 * std::sqrt(area_m2(feature.parts_world.front()) / 3.14159265);
    bool by_diameter = false;
    if (tags.value("power") == "generator" && (tags.value("generator:source") == "wind" ||
                                               tags.value("generator:method") == "wind_turbine"))
      thing = (draw & 3U) == 0 ? "wind_turbine_large" : "wind_turbine";
    else if (man_made == "wind_turbine")
      thing = "wind_turbine";
    else if (man_made == "lighthouse")
      thing = "lighthouse";
    else if (man_made == "water_tower")
      thing = (draw & 1U) != 0 ? "water_tower" : "water_tower_cup";
    else if (man_made == "silo")
      thing = diameter_m > 9.0 && feature.kind == FeatureKind::Area ? "grain_silos" : "silo",
      by_diameter = thing == "silo";
    else if (man_made == "storage_tank" || man_made == "tank" || man_made == "gasometer")
      thing = diameter_m > 22.0 ? "storage_tank" : "storage_tank_small", by_diameter = true;
    else if (man_made == "chimney")
      thing = "chimney";
    else if (man_made == "crane")
      thing =
          tags.value("crane:type") == "portal_crane" || tags.value("crane:type") == "gantry_crane"
              ? "gantry_crane"
              : "tower_crane";
    else if (man_made == "mast")
      thing = wanted_m > 45.0 || wanted_m == 0.0 ? "radio_mast" : "lattice_tower";
    else if (man_made == "communications_tower")
      thing = "lattice_tower";
    else if (man_made == "tower" || tags.value("aeroway") == "tower" ||
             tags.value("aeroway") == "control_tower") {
      const std::string_view kind = tags.value("tower:type");
      if (kind == "communication" || kind == "lattice")
        thing = "lattice_tower";
      else if (kind == "airport_control" || tags.value("service") == "aircraft_control" ||
               tags.has("aeroway"))
        thing = "control_tower";
    } else if (feature.kind == FeatureKind::Point &&
               (tags.value("aeroway") == "hangar" || tags.value("building") == "hangar"))
      thing = "hangar";
    else if (feature.kind == FeatureKind::Point && tags.value("building") == "warehouse")
      thing = "warehouse";
    if (thing.empty()) continue;
    // What has a building's outline is built by the layer of buildings.
    if (feature.kind == FeatureKind::Area && tags.has("building")) continue;
    Candidate own{.rule = Rule::Landmarks,
                  .footing = Footing::Land,
                  .feature = feature.number,
                  .key = stream,
                  .steepest = 0.5};
    const Chance chance[] = {{thing, 1.0}};
    choose(own, chance, draw);
    const ThingInfo& info = all_things()[own.thing];
    double scale = 1.0;
    if (by_diameter && diameter_m > 0.5)
      scale = diameter_m / (thing == "storage_tank" ? 36.6 : thing == "silo" ? 6.1 : 12.2);
    else if (wanted_m > 1.0)
      scale = wanted_m / info.size_m.z();
    own.scale = static_cast<std::uint16_t>(std::lround(4096.0 * std::clamp(scale, 0.3, 4.0)));
    own.place_world = middle_of(feature);
    // Tanks and silos stand in paved yards, too.
    own.footing = man_made == "lighthouse" ? Footing::Any
                  : by_diameter            ? Footing::Paved
                                           : Footing::Land;
    const bool is_turbine = thing.substr(0, 4) == "wind";
    const auto direction = tags.direction_deg("direction");
    own.heading = direction    ? heading_of_compass(*direction)
                  : is_turbine ? static_cast<std::uint16_t>(wind + draw % 1500U)
                               : static_cast<std::uint16_t>(draw >> 20U);
    to.candidates.push_back(own);
  }
}

}  // namespace terracast::tiler
