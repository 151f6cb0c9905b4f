#include "tiler/vegetation/finishes.h"
#include "tiler/vegetation/species.h"
#include "tiler/vegetation/tree_growth.h"

// A slender white trunk, branches that rise and twigs that hang (Betula pendula).
namespace terracast::tiler {
namespace {

Plant grow(std::uint64_t seed) {
  TreeRules birch;
  birch.height_m = 15.0;
  birch.shape = CrownShape::TendFlame;
  birch.bare_share = 0.2;
  birch.trunk_ratio = 0.011;
  birch.ratio_power = 1.3;
  birch.flare = 0.4;
  birch.stems = {{.length = 1.0,
                  .num_segments = 10,
                  .curve_variation_deg = 30.0,
                  .num_forks = 0.25,
                  .fork_angle_deg = 16.0},
                 {.num_stems = 42,
                  .length = 0.27,
                  .length_variation = 0.05,
                  .down_angle_deg = 46.0,
                  .down_angle_variation_deg = -12.0,
                  .turn_variation_deg = 30.0,
                  .num_segments = 4,
                  .curve_deg = 25.0,
                  .curve_variation_deg = 40.0,
                  .upward = 0.35},
                 {.num_stems = 9,
                  .length = 0.42,
                  .length_variation = 0.1,
                  .down_angle_deg = 45.0,
                  .down_angle_variation_deg = 15.0,
                  .turn_variation_deg = 30.0,
                  .num_segments = 3,
                  .curve_variation_deg = 20.0,
                  .upward = -1.7}};
  birch.leaves = {.num_leaves = 6,
                  .first = 0.15,
                  .length_m = 0.38,
                  .width_m = 0.25,
                  .down_angle_deg = 45.0,
                  .hanging = 0.7,
                  .fold = 0.1};
  birch.finishes = {tree_bark({206, 202, 192}), tree_leaves({96, 120, 46}),
                    tree_leaves({108, 131, 55}), tree_leaves({84, 108, 42})};
  return grow_tree(birch, seed);
}

}  // namespace

SpeciesInfo birch_species() {
  return {"birch", "Birch: slender, with a white trunk and hanging twigs.", 4, kTreeLevels, grow};
}

}  // namespace terracast::tiler
