#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "tiler/vegetation/finishes.h"
#include "tiler/vegetation/species.h"

// A column that leans a little, and at its top a rosette of feathered fronds, new ones upright in
// the middle, old ones hanging below (Phoenix canariensis). Fronds leave the trunk by the golden
// angle (phyllotaxis: Vogel 1979) and bend under their weight.
namespace terracast::tiler {
namespace {

using Eigen::Vector3d;

constexpr int kNumFronds = 34;
constexpr int kNumSegments = 6;
constexpr int kNumLeaflets = 26;  ///< on each side

Plant grow(std::uint64_t seed) {
  Draws draws(seed);
  Plant palm;
  palm.finishes = {tree_bark({120, 102, 80}), tree_leaves({82, 104, 48}),
                   tree_leaves({95, 115, 56}), tree_leaves({128, 118, 66})};
  const double height_m = draws.between(7.5, 10.5);
  const double lean_m = draws.between(0.0, 0.8);
  const double lean_rad = draws.between(0.0, 2.0 * std::numbers::pi);
  const Vector3d lean(std::cos(lean_rad), std::sin(lean_rad), 0.0);
  Stem trunk;
  trunk.nodes.push_back({{0.0, 0.0, -kSunk_m}, 0.42});
  for (int i = 0; i <= 9; ++i) {
    const double t = i / 9.0;
    const double radius_m = t < 0.1 ? 0.42 - 1.2 * t : t < 0.85 ? 0.3 : 0.3 + 0.6 * (t - 0.85);
    trunk.nodes.push_back({height_m * t * Vector3d::UnitZ() + lean_m * t * t * lean, radius_m});
  }
  const Vector3d top = trunk.nodes.back().place_m;
  trunk.nodes.push_back({top + Vector3d(0.0, 0.0, 0.7), 0.05});
  palm.stems.push_back(trunk);
  for (int k = 0; k < kNumFronds; ++k) {
    const double age = (k + 0.5) / kNumFronds;
    const double heading_rad = k * kGoldenAngle_rad + draws.about(0.0, 0.15);
    const Vector3d out(std::cos(heading_rad), std::sin(heading_rad), 0.0);
    const double length_m = draws.between(3.0, 3.8) * (0.75 + 0.25 * std::min(4.0 * age, 1.0));
    double rise_rad = 1.35 - 1.75 * age + draws.about(0.0, 0.08);
    const std::uint8_t finish = age > 0.88 ? 3 : draws.unit() < 0.5 ? 1 : 2;
    Stem rachis;
    rachis.order = 1;
    rachis.finish = finish;
    Vector3d place = top + 0.15 * out + Vector3d(0.0, 0.0, 0.25 * (1.0 - age));
    for (int i = 0; i <= kNumSegments; ++i) {
      const double t = static_cast<double>(i) / kNumSegments;
      rachis.nodes.push_back({place, 0.045 * (1.0 - t) + 0.008});
      const Vector3d direction = std::cos(rise_rad) * out + std::sin(rise_rad) * Vector3d::UnitZ();
      place += length_m / kNumSegments * direction;
      rise_rad = std::max(rise_rad - (0.12 + 0.22 * t), -1.4);
    }
    for (int i = 0; i < kNumLeaflets; ++i) {
      const double t = 0.12 + 0.86 * (i + 0.5) / kNumLeaflets;
      const auto segment = static_cast<std::size_t>(t * kNumSegments);
      const Stem::Node& a = rachis.nodes[segment];
      const Stem::Node& b = rachis.nodes[segment + 1];
      const double share = t * kNumSegments - static_cast<double>(segment);
      const Vector3d base = a.place_m + share * (b.place_m - a.place_m);
      const Vector3d along = (b.place_m - a.place_m).normalized();
      const Vector3d side = along.cross(Vector3d::UnitZ()).normalized();
      const Vector3d up = side.cross(along);
      const double leaflet_m = 0.62 * std::sin(std::numbers::pi * (0.18 + 0.72 * t));
      for (const double hand : {-1.0, 1.0}) {
        const Vector3d direction =
            (0.75 * along + hand * side + (0.25 - 0.3 * age) * up + draws.about(0.0, 0.1) * up)
                .normalized();
        palm.leaves.push_back(
            make_leaf(base, leaflet_m * direction, 0.09, up, LeafForm::Kite, 0.01, finish));
      }
    }
    palm.stems.push_back(std::move(rachis));
  }
  palm.has_crown = true;
  return palm;
}

}  // namespace

SpeciesInfo palm_species() {
  return {"palm", "Date palm: a crown of feathered fronds.", 3, kTreeLevels, grow};
}

}  // namespace terracast::tiler
