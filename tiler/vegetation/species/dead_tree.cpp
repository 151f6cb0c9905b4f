#include "tiler/vegetation/finishes.h"
#include "tiler/vegetation/species.h"
#include "tiler/vegetation/tree_growth.h"

// A snag: bare, bleached, most of its branches broken off short.
namespace terracast::tiler {
namespace {

Plant grow(std::uint64_t seed) {
  TreeRules snag;
  snag.height_m = 12.0;
  snag.height_variation = 0.2;
  snag.shape = CrownShape::Spherical;
  snag.bare_share = 0.25;
  snag.trunk_ratio = 0.02;
  snag.ratio_power = 1.1;
  snag.taper = 0.85;
  snag.stems = {{.length = 1.0,
                 .num_segments = 8,
                 .curve_variation_deg = 40.0,
                 .num_forks = 0.6,
                 .fork_angle_deg = 30.0},
                {.num_stems = 22,
                 .length = 0.25,
                 .length_variation = 0.16,
                 .down_angle_deg = 65.0,
                 .down_angle_variation_deg = 20.0,
                 .turn_variation_deg = 50.0,
                 .num_segments = 4,
                 .curve_variation_deg = 120.0,
                 .upward = 0.2,
                 .num_forks = 0.5},
                {.num_stems = 5,
                 .length = 0.4,
                 .length_variation = 0.2,
                 .down_angle_deg = 50.0,
                 .down_angle_variation_deg = 20.0,
                 .turn_variation_deg = 50.0,
                 .num_segments = 3,
                 .curve_variation_deg = 120.0}};
  snag.leaves.num_leaves = 0;
  snag.finishes = {tree_bark({142, 132, 120})};
  return grow_tree(snag, seed);
}

}  // namespace

SpeciesInfo dead_tree_species() {
  // Without leaves it has fewer triangles than others have on tiles of level 0.
  return {"dead_tree",
          "Dead tree: bare and bleached.",
          3,
          {{0, 6000}, {1, 300}, {3, 60}, {5, 20}},
          grow};
}

}  // namespace terracast::tiler
