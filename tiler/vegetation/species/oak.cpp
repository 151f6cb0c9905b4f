#include "tiler/vegetation/finishes.h"
#include "tiler/vegetation/species.h"
#include "tiler/vegetation/tree_growth.h"

// A broad crown on a short, forking trunk; wide angles between branches (Quercus robur; after the
// black oak of Weber and Penn's appendix).
namespace terracast::tiler {
namespace {

Plant grow(std::uint64_t seed) {
  TreeRules oak;
  oak.height_m = 16.0;
  oak.shape = CrownShape::Hemispherical;
  oak.bare_share = 0.22;
  oak.trunk_ratio = 0.026;
  oak.ratio_power = 1.25;
  oak.flare = 0.7;
  oak.stems = {{.length = 0.8,
                .num_segments = 9,
                .curve_variation_deg = 55.0,
                .num_forks = 0.9,
                .fork_angle_deg = 34.0},
               {.num_stems = 26,
                .length = 0.6,
                .length_variation = 0.08,
                .down_angle_deg = 58.0,
                .down_angle_variation_deg = -14.0,
                .turn_variation_deg = 40.0,
                .num_segments = 5,
                .curve_variation_deg = 95.0,
                .upward = 0.55,
                .num_forks = 0.0},
               {.num_stems = 11,
                .length = 0.42,
                .length_variation = 0.1,
                .down_angle_deg = 48.0,
                .down_angle_variation_deg = 14.0,
                .turn_variation_deg = 40.0,
                .num_segments = 2,
                .curve_variation_deg = 50.0,
                .upward = 0.3}};
  oak.leaves = {.num_leaves = 8,
                .first = 0.25,
                .length_m = 0.72,
                .width_m = 0.54,
                .down_angle_deg = 62.0,
                .fold = 0.14};
  oak.finishes = {tree_bark({92, 80, 66}), tree_leaves({66, 90, 34}), tree_leaves({76, 99, 40}),
                  tree_leaves({57, 80, 32})};
  return grow_tree(oak, seed);
}

}  // namespace

SpeciesInfo oak_species() {
  return {"oak", "Oak: a broad crown of branches that fork.", 4, kTreeLevels, grow};
}

}  // namespace terracast::tiler
