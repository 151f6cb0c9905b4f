#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "tiler/vegetation/crop_rows.h"
#include "tiler/vegetation/finishes.h"
#include "tiler/vegetation/species.h"

// Ripe wheat in drilled rows 0.25 m apart: stalks in small bundles, each with its ears.
namespace terracast::tiler {
namespace {

using Eigen::Vector3d;

Plant grow(std::uint64_t seed) {
  Draws draws(seed);
  Plant wheat;
  wheat.keeps_leaf_length = true;
  wheat.finishes = {plant_blades({190, 164, 96}), plant_blades({204, 176, 106}),
                    plant_blades({176, 154, 88})};
  for_each_in_rows(0.25, 0.16, draws, [&](const Vector3d& foot) {
    const double height_m = draws.between(0.75, 0.95);
    const double heading_rad = draws.between(0.0, 2.0 * std::numbers::pi);
    const Vector3d out(std::cos(heading_rad), std::sin(heading_rad), 0.0);
    const Vector3d stalk =
        (height_m + kCropSunk_m) * Vector3d::UnitZ() + draws.between(0.02, 0.16) * out;
    wheat.leaves.push_back(make_leaf(foot, stalk, 0.045, -out, LeafForm::Blade, 0.02,
                                     static_cast<std::uint8_t>(draws.unit() < 0.5 ? 0 : 2)));
    wheat.leaves.push_back(make_leaf(foot + 0.96 * stalk,
                                     0.13 * (0.8 * out + Vector3d(0.0, 0.0, 0.5)), 0.05,
                                     draws.direction(), LeafForm::Blade, 0.015, 1));
  });
  return wheat;
}

}  // namespace

SpeciesInfo wheat_species() {
  return {"wheat",
          "Ripe wheat: a piece of a field, in rows.",
          3,
          {{-2, 2400}, {-1, 1600}, {0, 560}},
          grow};
}

}  // namespace terracast::tiler
