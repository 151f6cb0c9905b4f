#include "tiler/vegetation/finishes.h"
#include "tiler/vegetation/species.h"
#include "tiler/vegetation/tree_growth.h"

// A column: branches rise steeply along the trunk from near the ground (Populus nigra Italica).
namespace terracast::tiler {
namespace {

Plant grow(std::uint64_t seed) {
  TreeRules poplar;
  poplar.height_m = 21.0;
  poplar.shape = CrownShape::TendFlame;
  poplar.bare_share = 0.07;
  poplar.trunk_ratio = 0.014;
  poplar.ratio_power = 1.2;
  poplar.stems = {{.length = 0.97, .num_segments = 10, .curve_variation_deg = 12.0},
                  {.num_stems = 46,
                   .length = 0.21,
                   .length_variation = 0.04,
                   .down_angle_deg = 34.0,
                   .down_angle_variation_deg = 8.0,
                   .turn_variation_deg = 25.0,
                   .num_segments = 4,
                   .curve_variation_deg = 20.0,
                   .upward = 0.75},
                  {.num_stems = 7,
                   .length = 0.36,
                   .length_variation = 0.08,
                   .down_angle_deg = 38.0,
                   .down_angle_variation_deg = 10.0,
                   .num_segments = 2,
                   .curve_variation_deg = 20.0,
                   .upward = 0.7}};
  poplar.leaves = {.num_leaves = 6,
                   .first = 0.1,
                   .length_m = 0.42,
                   .width_m = 0.32,
                   .down_angle_deg = 50.0,
                   .fold = 0.12};
  poplar.finishes = {tree_bark({118, 110, 94}), tree_leaves({80, 108, 42}),
                     tree_leaves({92, 119, 50}), tree_leaves({70, 97, 38})};
  return grow_tree(poplar, seed);
}

}  // namespace

SpeciesInfo poplar_species() {
  return {"poplar", "Lombardy poplar: a tall column.", 3, kTreeLevels, grow};
}

}  // namespace terracast::tiler
