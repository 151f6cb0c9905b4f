#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "tiler/vegetation/crop_rows.h"
#include "tiler/vegetation/finishes.h"
#include "tiler/vegetation/species.h"

// Maize: rows 0.8 m apart, a plant every 0.27 m; stalks with arching leaves to both sides of the
// row, and a tassel.
namespace terracast::tiler {
namespace {

using Eigen::Vector3d;

Plant grow(std::uint64_t seed) {
  Draws draws(seed);
  Plant corn;
  corn.keeps_leaf_length = true;
  corn.finishes = {plant_blades({96, 122, 52}), plant_blades({78, 108, 42}),
                   plant_blades({90, 118, 48}), plant_blades({168, 150, 92})};
  for_each_in_rows(0.8, 0.27, draws, [&](const Vector3d& foot) {
    const double height_m = draws.between(1.9, 2.3);
    const double turn_rad = draws.between(0.0, std::numbers::pi);
    const Vector3d across_stalk(std::cos(turn_rad), std::sin(turn_rad), 0.0);
    corn.leaves.push_back(make_leaf(foot, (height_m + kCropSunk_m) * Vector3d::UnitZ(), 0.04,
                                    across_stalk, LeafForm::Blade, 0.0, 0));
    const int num_leaves = 5;
    for (int i = 0; i < num_leaves; ++i) {
      const double t = 0.22 + 0.6 * i / num_leaves;
      const double heading_rad = turn_rad + std::numbers::pi * i + draws.about(0.0, 0.4);
      const Vector3d out(std::cos(heading_rad), std::sin(heading_rad), 0.0);
      const double leaf_m = draws.between(0.6, 0.85);
      corn.leaves.push_back(make_leaf(
          foot + (kCropSunk_m + t * height_m) * Vector3d::UnitZ(),
          leaf_m * (0.85 * out + draws.between(0.0, 0.4) * Vector3d::UnitZ()), 0.085,
          Vector3d::UnitZ(), LeafForm::Blade, 0.24 * leaf_m, static_cast<std::uint8_t>(1 + i % 2)));
    }
    corn.leaves.push_back(make_leaf(foot + (kCropSunk_m + 0.95 * height_m) * Vector3d::UnitZ(),
                                    {0.0, 0.0, 0.28}, 0.07, draws.direction(), LeafForm::Blade,
                                    0.01, 3));
  });
  return corn;
}

}  // namespace

SpeciesInfo corn_species() {
  return {
      "corn", "Maize: a piece of a field, in rows.", 3, {{-2, 2200}, {-1, 800}, {0, 320}}, grow};
}

}  // namespace terracast::tiler
