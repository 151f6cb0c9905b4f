#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "tiler/vegetation/finishes.h"
#include "tiler/vegetation/species.h"

// Some square metres of meadow: tufts of blades that lean outward and bend, denser in the middle.
namespace terracast::tiler {
namespace {

using Eigen::Vector3d;

constexpr double kReach_m = 2.3;
constexpr int kNumTufts = 150;
constexpr int kNumBlades = 7;  ///< of a tuft

Plant grow(std::uint64_t seed) {
  Draws draws(seed);
  Plant meadow;
  meadow.keeps_leaf_length = true;
  meadow.finishes = {plant_blades({92, 112, 50}), plant_blades({108, 124, 58}),
                     plant_blades({132, 130, 72})};
  for (int k = 0; k < kNumTufts; ++k) {
    const auto [out_m, foot] = spread_foot(k, kNumTufts, kReach_m, 0.12, 0.3, draws);
    const double height_m = draws.between(0.22, 0.55) * (1.15 - 0.35 * out_m / kReach_m);
    for (int i = 0; i < kNumBlades; ++i) {
      const double heading_rad = draws.between(0.0, 2.0 * std::numbers::pi);
      const Vector3d out(std::cos(heading_rad), std::sin(heading_rad), 0.0);
      const double blade_m = height_m * draws.between(0.6, 1.15);
      const double lean = draws.between(0.15, 0.7);
      const Vector3d tip = blade_m * lean * out + (blade_m + 0.12) * Vector3d::UnitZ();
      const std::uint8_t finish = draws.unit() < 0.2 ? 2 : draws.unit() < 0.5 ? 0 : 1;
      meadow.leaves.push_back(make_leaf(foot + draws.between(0.0, 0.06) * out, tip,
                                        draws.between(0.018, 0.03), -out, LeafForm::Blade,
                                        0.14 * blade_m * lean, finish));
    }
  }
  return meadow;
}

}  // namespace

SpeciesInfo grass_species() {
  return {"grass",
          "Tufts of grass on some square metres.",
          4,
          {{-3, 3200}, {-2, 1000}, {-1, 240}},
          grow};
}

}  // namespace terracast::tiler
