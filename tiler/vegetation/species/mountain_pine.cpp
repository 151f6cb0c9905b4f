#include "tiler/vegetation/finishes.h"
#include "tiler/vegetation/species.h"
#include "tiler/vegetation/tree_growth.h"

// Krummholz at the tree line: stems that lie down and rise at their ends (Pinus mugo).
namespace terracast::tiler {
namespace {

Plant grow(std::uint64_t seed) {
  TreeRules pine;
  pine.height_m = 2.0;
  pine.shape = CrownShape::Cylindrical;
  pine.bare_share = 0.03;
  pine.trunk_ratio = 0.03;
  pine.ratio_power = 0.9;
  pine.stems = {{.length = 0.45, .num_segments = 3, .curve_variation_deg = 60.0},
                {.num_stems = 17,
                 .length = 1.25,
                 .length_variation = 0.3,
                 .down_angle_deg = 80.0,
                 .down_angle_variation_deg = 18.0,
                 .turn_variation_deg = 40.0,
                 .num_segments = 4,
                 .curve_variation_deg = 60.0,
                 .upward = 0.9},
                {.num_stems = 7,
                 .length = 0.45,
                 .length_variation = 0.1,
                 .down_angle_deg = 50.0,
                 .down_angle_variation_deg = 15.0,
                 .num_segments = 2,
                 .upward = 1.3}};
  pine.leaves = {.num_leaves = 16,
                 .first = 0.15,
                 .length_m = 0.2,
                 .width_m = 0.045,
                 .size_variation = 0.3,
                 .down_angle_deg = 55.0,
                 .fold = 0.05};
  const auto finish = [](world::Material material, std::array<std::uint8_t, 3> color_srgb) {
    return plant_finish(material, core::SemanticClass::Bush, color_srgb);
  };
  pine.finishes = {finish(world::Material::Bark, {96, 82, 70}),
                   finish(world::Material::Needles, {54, 78, 40}),
                   finish(world::Material::Needles, {64, 88, 46}),
                   finish(world::Material::Needles, {46, 68, 36})};
  return grow_tree(pine, seed);
}

}  // namespace

SpeciesInfo mountain_pine_species() {
  return {"mountain_pine",
          "Dwarf pine of the tree line.",
          3,
          {{-2, 5000}, {-1, 1200}, {0, 240}, {2, 30}},
          grow};
}

}  // namespace terracast::tiler
