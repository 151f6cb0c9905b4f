#include <algorithm>

#include "core/random.h"
#include "tiler/objects/area_grid.h"
#include "tiler/objects/object_tags.h"
#include "tiler/objects/rules.h"
#include "tiler/objects/things.h"

// Yards of industry: trucks at the docks of halls, piles of containers.
namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

constexpr Chance kTrucks[] = {
    {"articulated_truck", 0.62}, {"box_truck", 0.28}, {"tank_truck", 0.06}, {"tipper", 0.04}};
constexpr Chance kBoxes[] = {{"container_40", 0.45}, {"container_40_high", 0.55}};

/// With their tails to the hall, which lies to the right of its docks' line.
void back_trucks(const RuleInputs& inputs, const VectorFeature& feature, std::size_t part,
                 const PointsWorld& line, Proposals& to) {
  constexpr double kBay_m = 4.2;
  constexpr double kTaken =
      0.6;  ///< of the docks that have a truck where all parking places are taken
  const Walk walk(line);
  const std::uint64_t stream =
      core::stream_of(core::stream_of(0x646f636bULL, feature.number), part);
  const int bays = static_cast<int>(std::min(walk.length_m(), 1000.0) / kBay_m);
  for (int bay = 0; bay < bays; ++bay) {
    const auto number = static_cast<std::uint64_t>(bay);
    if (core::random_unit(inputs.seed, stream, 2 * number) >= kTaken * inputs.options.parked_cars)
      continue;
    const double along_m = (bay + 0.5) * walk.length_m() / bays;
    const Vector2d direction = walk.direction(along_m);
    const Vector2d out(-direction.y(), direction.x());
    Candidate truck{.rule = Rule::Yards,
                    .footing = Footing::Paved,
                    .feature = feature.number,
                    .key = core::stream_of(stream, number),
                    .steepest = 0.08};
    choose(truck, kTrucks, core::random_bits(inputs.seed, stream, 2 * number + 1));
    truck.place_world = walk.at(along_m) + (0.5 * all_things()[truck.thing].size_m.x() + 0.4) * out;
    truck.heading = heading_of(out);
    to.candidates.push_back(truck);
  }
}

/// Blocks of four rows of containers with lanes between them; fewer and lower than in ports.
void pile_containers(const RuleInputs& inputs, const VectorFeature& feature, std::size_t part,
                     const std::vector<PointsWorld>& rings, Proposals& to) {
  constexpr double kKept = 0.7;
  const std::uint64_t stream =
      core::stream_of(core::stream_of(0x79617264ULL, feature.number), part);
  visit_grid(
      rings, 12.6, 2.9, 6.3, 1.45,
      [&](const Vector2d& place, const Vector2d& direction, int row, int column, int, int) {
        if (row % 8 >= 4 || column % 5 == 4) return;
        const auto number =
            static_cast<std::uint64_t>(row) * 4096U + static_cast<std::uint64_t>(column);
        if (core::random_unit(inputs.seed, stream, 4 * number) >= kKept * inputs.options.containers)
          return;
        Candidate pile{.rule = Rule::Yards,
                       .footing = Footing::Paved,
                       .feature = feature.number,
                       .key = core::stream_of(stream, number),
                       .steepest = 0.05};
        choose(pile, kBoxes, core::random_bits(inputs.seed, stream, 4 * number + 1));
        pile.num_stacked = static_cast<std::uint8_t>(
            1 + core::random_bits(inputs.seed, stream, 4 * number + 2) % 3U);
        pile.place_world = place;
        pile.heading = heading_of(direction);
        to.candidates.push_back(pile);
      });
}

}  // namespace

void propose_yards(const RuleInputs& inputs, Proposals& to) {
  for (const VectorFeature& feature : inputs.features)
    for (std::size_t part = 0; part < feature.parts_world.size(); ++part) {
      const std::vector<PointsWorld>& rings = feature.parts_world[part];
      if (rings.empty()) continue;
      if (feature.kind == FeatureKind::Line &&
          ObjectTags(feature.tags).value("amenity") == "loading_dock" &&
          inputs.options.parked_cars > 0.0)
        back_trucks(inputs, feature, part, rings.front(), to);
      if (feature.kind == FeatureKind::Area &&
          ObjectTags(feature.tags).value("industrial") == "container_yard" &&
          inputs.options.containers > 0.0 && rings.front().size() >= 3 && area_m2(rings) < 2e6)
        pile_containers(inputs, feature, part, rings, to);
    }
}

}  // namespace terracast::tiler
