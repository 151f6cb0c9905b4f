#include <Eigen/Geometry>
#include <cmath>

#include "tiler/vegetation/finishes.h"
#include "tiler/vegetation/species.h"

// Some square metres of a meadow of Neptune grass (Posidonia oceanica): sheaves of five to eight ribbons, half a metre
// to a metre long, that stand up from the matte and bend over one way, as the swell lays them; the oldest are brown and
// grey with what grows on them.
namespace terracast::tiler {
namespace {

using Eigen::Vector3d;

/// Wider than the places of tufts are apart: meadows close.
constexpr double kReach_m = 3.3;
constexpr int kNumSheaves = 300;
constexpr double kSunk_m = 0.3;

Plant grow(std::uint64_t seed) {
  Draws draws(seed);
  Plant meadow;
  meadow.keeps_leaf_length = true;
  meadow.finishes = {plant_blades({70, 98, 44}), plant_blades({94, 122, 56}),
                     plant_blades({118, 140, 74}), plant_blades({108, 96, 66})};
  for (int k = 0; k < kNumSheaves; ++k) {
    const auto [out_m, foot] = spread_foot(k, kNumSheaves, kReach_m, kSunk_m, 0.3, draws);
    const double length_m = draws.between(0.45, 0.85) * (1.05 - 0.15 * out_m / kReach_m);
    const int num_blades = 5 + static_cast<int>(4.0 * draws.unit());
    for (int i = 0; i < num_blades; ++i) {
      // Along x, and a little aside.
      const double heading_rad = draws.about(0.0, 1.1);
      const Vector3d out(std::cos(heading_rad), std::sin(heading_rad), 0.0);
      const double blade_m = length_m * draws.between(0.55, 1.1);
      const double lean = draws.between(0.15, 0.75);
      const double rise = std::sqrt(1.0 - 0.8 * lean * lean);
      const Vector3d tip = blade_m * lean * out + (blade_m * rise + kSunk_m) * Vector3d::UnitZ();
      const double drawn = draws.unit();
      const std::uint8_t finish = drawn < 0.14 ? 3 : drawn < 0.42 ? 0 : drawn < 0.8 ? 1 : 2;
      const Vector3d beside =
          draws.about(0.0, 0.05) * Vector3d(-out.y(), out.x(), 0.0) + draws.about(0.0, 0.04) * out;
      meadow.leaves.push_back(make_leaf(foot + beside, tip, draws.between(0.018, 0.030), -out,
                                        LeafForm::Blade, 0.22 * blade_m * lean, finish));
    }
  }
  return meadow;
}

}  // namespace

SpeciesInfo seagrass_species() {
  return {"seagrass",
          "Tufts of Neptune grass on some square metres of the bed of the sea.",
          4,
          {{-1, 6000}, {0, 5000}},
          grow};
}

}  // namespace terracast::tiler
