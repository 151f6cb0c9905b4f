#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "tiler/objects/air_parts.h"

namespace terracast::tiler {
namespace {

using core::SemanticClass;
using Eigen::Vector3d;
using world::Material;

struct TurbineSpec {
  double hub_z_m;
  double rotor_m;  ///< radius
  double foot_m;   ///< radius of the tower
  double top_m;
  double chord_m;
};

/// The rotor is in front, the first blade straight up.
void build_turbine(ThingMesh& mesh, const TurbineSpec& t, int detail) {
  const FinishNumber white = mesh.finish(Material::Paint, {232, 234, 234});
  const FinishNumber concrete = mesh.finish(Material::Concrete, {158, 156, 150});
  const int sides = round_sides(24, detail);
  const double hub = t.hub_z_m;
  mesh.cone({0.0, 0.0, -1.5}, {0.0, 0.0, hub - 1.6}, t.foot_m, t.top_m, sides, white, white);
  if (detail < 2)
    mesh.cylinder({0.0, 0.0, -1.8}, {0.0, 0.0, 0.35}, 2.4 * t.foot_m, sides, concrete, concrete);
  // Nacelle, hub.
  const double s = t.rotor_m / 45.0;
  mesh.loft(
      {ring_across(-6.6 * s,
                   cut_rectangle({-1.5 * s, hub - 1.5 * s}, {1.5 * s, hub + 1.7 * s}, 0.5 * s)),
       ring_across(-5.6 * s,
                   cut_rectangle({-1.7 * s, hub - 1.8 * s}, {1.7 * s, hub + 1.9 * s}, 0.5 * s)),
       ring_across(2.4 * s,
                   cut_rectangle({-1.7 * s, hub - 1.8 * s}, {1.7 * s, hub + 1.9 * s}, 0.5 * s)),
       ring_across(3.2 * s,
                   cut_rectangle({-1.3 * s, hub - 1.4 * s}, {1.3 * s, hub + 1.4 * s}, 0.5 * s))},
      white);
  const double front = 4.3 * s;
  std::vector<Ring> spinner;
  for (const auto& [x, r] : {std::pair{-1.3, 1.4}, {0.3, 1.55}, {1.3, 1.1}, {2.0, 0.35}}) {
    spinner.push_back(
        ring_across(front + x * s, round_outline(r * s, r * s, detail == 0 ? 14 : 6, {0.0, hub})));
  }
  mesh.loft(spinner, white);
  // Blades: round at the root, twisted wings outward.
  const std::vector<std::array<double, 3>> shape = {// share of the radius, chord, twist
                                                    {0.02, 0.50, 1.1},  {0.08, 0.52, 0.9},
                                                    {0.20, 1.0, 0.35},  {0.5, 0.66, 0.12},
                                                    {0.85, 0.36, 0.02}, {1.0, 0.10, 0.0}};
  for (int k = 0; k < 3; ++k) {
    const double turn = 2.0 * std::numbers::pi * k / 3.0;
    const Vector3d along(0.0, std::sin(turn), std::cos(turn));
    const Vector3d side = along.cross(Vector3d::UnitX());
    std::vector<Ring> rings;
    for (std::size_t i = 0; i < shape.size(); i += detail >= 2 ? 2 : 1) {
      const auto& [share, chord, twist] = shape[detail >= 2 && i == 4 ? 5 : i];
      const Vector3d middle = Vector3d(front, 0.0, hub) + share * t.rotor_m * along;
      const Vector3d wide = std::cos(twist) * side - std::sin(twist) * Vector3d::UnitX();
      const Vector3d thick = along.cross(wide);
      const double c = chord * t.chord_m;
      const double h = share < 0.1 ? 0.5 * c : 0.12 * c + 0.03;
      rings.push_back({middle + 0.35 * c * wide, middle + 0.05 * c * wide + h * thick,
                       middle - 0.65 * c * wide * (share < 0.1 ? 0.55 : 1.0),
                       middle + 0.05 * c * wide - h * thick});
    }
    mesh.loft(rings, white);
  }
}

}  // namespace

std::vector<ThingInfo> wind_turbines();
std::vector<ThingInfo> wind_turbines() {
  const auto turbine = [](std::string name, const TurbineSpec& spec, std::string_view source,
                          const Vector3d& size_m) {
    return ThingInfo{.name = std::move(name),
                     .family = {},
                     .semantic_class = SemanticClass::WindTurbine,
                     .stance = Stance::Rooted,
                     .size_m = size_m,
                     .source = source,
                     .coarsest_levels = {0, 2, 5},
                     .num_variants = 1,
                     .build = [spec](ThingMesh& m, int d, int) { build_turbine(m, spec, d); }};
  };
  // Across: two blades at 120 degrees from the upright one, sin 120 times the rotor.
  return {turbine("wind_turbine", {80.0, 45.0, 2.1, 1.2, 3.5},
                  "Vestas V90-2.0 MW: hub at 80 m, rotor of 90 m, blades' chord 3.5 m "
                  "(manufacturer's data)",
                  {12.9, 78.0, 125.0}),
          turbine("wind_turbine_large", {119.0, 56.0, 2.3, 1.4, 4.0},
                  "Vestas V112-3.0 MW: hub at 119 m, rotor of 112 m, blades' chord 4.0 m "
                  "(manufacturer's data)",
                  {16.1, 97.0, 175.0})};
}

}  // namespace terracast::tiler
