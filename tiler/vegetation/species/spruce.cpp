#include "tiler/vegetation/finishes.h"
#include "tiler/vegetation/species.h"
#include "tiler/vegetation/tree_growth.h"

// Whorls of branches on a straight trunk, down to the ground: the upper ones rise, the lower ones
// hang and turn up again at their ends; twigs lie flat to both sides (Picea abies).
namespace terracast::tiler {
namespace {

Plant grow(std::uint64_t seed) {
  TreeRules spruce;
  spruce.height_m = 22.0;
  spruce.shape = CrownShape::Pointed;
  spruce.bare_share = 0.07;
  spruce.trunk_ratio = 0.014;
  spruce.ratio_power = 1.15;
  spruce.flare = 0.4;
  spruce.stems = {{.length = 1.0, .num_segments = 10, .curve_variation_deg = 6.0},
                  {.num_stems = 110,
                   .length = 0.19,
                   .length_variation = 0.03,
                   .down_angle_deg = 84.0,
                   .down_angle_variation_deg = -30.0,
                   .turn_deg = 72.0,
                   .turn_variation_deg = 18.0,
                   .whorl = 5,
                   .num_segments = 4,
                   .curve_deg = 22.0,
                   .curve_variation_deg = 30.0,
                   .upward = 0.42}};
  spruce.leaves = {.num_leaves = 20,
                   .first = 0.06,
                   .length_m = 0.95,
                   .width_m = 0.34,
                   .size_variation = 0.3,
                   .down_angle_deg = 52.0,
                   .in_two_rows = true,
                   .hanging = 0.75,
                   .fold = -0.07};
  spruce.finishes = {tree_bark({86, 70, 56}), tree_needles({42, 62, 36}),
                     tree_needles({51, 71, 41}), tree_needles({35, 54, 33})};
  return grow_tree(spruce, seed);
}

}  // namespace

SpeciesInfo spruce_species() {
  return {"spruce", "Spruce: a cone of whorled branches.", 4, kTreeLevels, grow};
}

}  // namespace terracast::tiler
