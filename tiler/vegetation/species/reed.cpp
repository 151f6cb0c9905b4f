#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "tiler/vegetation/finishes.h"
#include "tiler/vegetation/species.h"

// A stand of reed: upright stalks with leaves to one side and brown plumes (Phragmites australis).
namespace terracast::tiler {
namespace {

using Eigen::Vector3d;

constexpr double kReach_m = 1.6;
constexpr int kNumStalks = 70;

Plant grow(std::uint64_t seed) {
  Draws draws(seed);
  Plant reed;
  reed.keeps_leaf_length = true;
  reed.finishes = {plant_blades({128, 132, 70}), plant_blades({108, 122, 58}),
                   plant_blades({118, 94, 70})};
  const double wind_rad = draws.between(0.0, 2.0 * std::numbers::pi);
  for (int k = 0; k < kNumStalks; ++k) {
    const Vector3d foot = spread_foot(k, kNumStalks, kReach_m, 0.3, 0.0, draws).place_m;
    const double height_m = draws.between(1.7, 2.7);
    const double lean_rad = wind_rad + draws.about(0.0, 0.9);
    const Vector3d lean(std::cos(lean_rad), std::sin(lean_rad), 0.0);
    const Vector3d stalk = (height_m + 0.3) * Vector3d::UnitZ() + draws.between(0.05, 0.3) * lean;
    reed.leaves.push_back(make_leaf(foot, stalk, 0.022, -lean, LeafForm::Blade, 0.03, 0));
    const int num_leaves = 4;
    for (int i = 0; i < num_leaves; ++i) {
      const double t = 0.3 + 0.55 * (i + draws.unit()) / num_leaves;
      const double heading_rad = lean_rad + draws.about(0.0, 0.7);
      const Vector3d out(std::cos(heading_rad), std::sin(heading_rad), 0.0);
      const double leaf_m = draws.between(0.35, 0.6);
      reed.leaves.push_back(
          make_leaf(foot + t * stalk, leaf_m * (0.75 * out + 0.45 * Vector3d::UnitZ()), 0.045,
                    Vector3d::UnitZ() - 0.5 * out, LeafForm::Blade, 0.18 * leaf_m, 1));
    }
    if (draws.unit() < 0.7)
      reed.leaves.push_back(make_leaf(foot + 0.97 * stalk, 0.3 * (0.5 * lean + Vector3d::UnitZ()),
                                      0.09, draws.direction(), LeafForm::Blade, 0.03, 2));
  }
  return reed;
}

}  // namespace

SpeciesInfo reed_species() {
  return {"reed", "A stand of reed.", 3, {{-2, 1200}, {-1, 400}, {0, 120}, {1, 40}}, grow};
}

}  // namespace terracast::tiler
