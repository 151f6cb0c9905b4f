#include "tiler/vegetation/finishes.h"
#include "tiler/vegetation/species.h"
#include "tiler/vegetation/tree_growth.h"

// A bare reddish trunk under an uneven, rounded crown; needles in tufts at the ends of twigs
// (Pinus sylvestris).
namespace terracast::tiler {
namespace {

Plant grow(std::uint64_t seed) {
  TreeRules pine;
  pine.height_m = 19.0;
  pine.shape = CrownShape::Spherical;
  pine.bare_share = 0.5;
  pine.trunk_ratio = 0.015;
  pine.ratio_power = 1.2;
  pine.flare = 0.4;
  pine.stems = {{.length = 0.96,
                 .num_segments = 10,
                 .curve_variation_deg = 38.0,
                 .num_forks = 0.3,
                 .fork_angle_deg = 22.0},
                {.num_stems = 30,
                 .length = 0.27,
                 .length_variation = 0.07,
                 .down_angle_deg = 70.0,
                 .down_angle_variation_deg = -26.0,
                 .turn_variation_deg = 40.0,
                 .whorl = 3,
                 .num_segments = 4,
                 .curve_variation_deg = 70.0,
                 .upward = 0.5},
                {.num_stems = 9,
                 .length = 0.4,
                 .length_variation = 0.1,
                 .down_angle_deg = 48.0,
                 .down_angle_variation_deg = 12.0,
                 .num_segments = 2,
                 .curve_variation_deg = 40.0,
                 .upward = 0.7}};
  pine.leaves = {.num_leaves = 11,
                 .first = 0.3,
                 .length_m = 0.4,
                 .width_m = 0.17,
                 .size_variation = 0.3,
                 .down_angle_deg = 48.0,
                 .fold = 0.05};
  pine.finishes = {tree_bark({146, 98, 66}), tree_needles({62, 84, 52}), tree_needles({72, 94, 58}),
                   tree_needles({54, 74, 48})};
  return grow_tree(pine, seed);
}

}  // namespace

SpeciesInfo pine_species() {
  return {"pine", "Scots pine: a bare trunk and a rounded crown.", 4, kTreeLevels, grow};
}

}  // namespace terracast::tiler
