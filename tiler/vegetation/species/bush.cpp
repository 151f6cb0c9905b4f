#include "tiler/vegetation/finishes.h"
#include "tiler/vegetation/species.h"
#include "tiler/vegetation/tree_growth.h"

// Many stems from one root, leafy down to the ground (Corylus avellana, Prunus spinosa).
namespace terracast::tiler {
namespace {

Plant grow(std::uint64_t seed) {
  TreeRules bush;
  bush.height_m = 2.2;
  bush.height_variation = 0.2;
  bush.shape = CrownShape::Cylindrical;
  bush.bare_share = 0.02;
  bush.trunk_ratio = 0.02;
  bush.ratio_power = 0.8;
  bush.stems = {{.length = 0.5, .num_segments = 3, .curve_variation_deg = 40.0},
                {.num_stems = 15,
                 .length = 1.35,
                 .length_variation = 0.35,
                 .down_angle_deg = 40.0,
                 .down_angle_variation_deg = 25.0,
                 .turn_variation_deg = 40.0,
                 .num_segments = 4,
                 .curve_deg = 35.0,
                 .curve_variation_deg = 60.0,
                 .upward = 0.4},
                {.num_stems = 8,
                 .length = 0.42,
                 .length_variation = 0.12,
                 .down_angle_deg = 48.0,
                 .down_angle_variation_deg = 15.0,
                 .num_segments = 2,
                 .curve_variation_deg = 40.0}};
  bush.leaves = {.num_leaves = 6,
                 .first = 0.1,
                 .length_m = 0.2,
                 .width_m = 0.14,
                 .size_variation = 0.35,
                 .down_angle_deg = 55.0,
                 .fold = 0.14};
  const auto finish = [](world::Material material, std::array<std::uint8_t, 3> color_srgb) {
    return plant_finish(material, core::SemanticClass::Bush, color_srgb);
  };
  bush.finishes = {finish(world::Material::Bark, {98, 84, 66}),
                   finish(world::Material::Leaves, {74, 98, 40}),
                   finish(world::Material::Leaves, {86, 110, 48}),
                   finish(world::Material::Leaves, {64, 86, 36})};
  return grow_tree(bush, seed);
}

}  // namespace

SpeciesInfo bush_species() { return {"bush", "Bush of many stems.", 4, kBushLevels, grow}; }

}  // namespace terracast::tiler
