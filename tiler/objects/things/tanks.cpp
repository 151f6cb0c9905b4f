#include <cmath>
#include <numbers>

#include "tiler/objects/things.h"

// Storage tanks and silos.
namespace terracast::tiler {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using world::Material;

constexpr std::array<Color, 3> kTankColors = {{{232, 232, 228}, {196, 200, 200}, {214, 206, 184}}};

void build_tank(ThingMesh& mesh, double radius, double height, int detail, int variant) {
  const FinishNumber wall =
      mesh.finish(Material::Paint, kTankColors[static_cast<std::size_t>(variant)]);
  const FinishNumber roof = mesh.finish(Material::Metal, {198, 202, 204});
  const FinishNumber rail = mesh.finish(Material::Metal, {168, 150, 60});
  const int sides = round_sides(40, detail);
  const double eave = height - 0.06 * radius;
  mesh.lathe({0.0, 0.0},
             {{radius, -1.0},
              {radius, eave},
              {0.55 * radius, eave + 0.045 * radius},
              {0.12 * radius, height}},
             sides, [&](std::size_t k) { return k == 0 ? wall : roof; });
  if (detail > 0) return;
  // Stairs wind up the wall; wind girders.
  const int num_steps = 28;
  for (int k = 0; k < num_steps; ++k) {
    const double from = 2.2 * k / num_steps;
    const double z = eave * k / num_steps;
    const auto at = [&](double turn, double r, double up) {
      return Vector3d(r * std::cos(turn), r * std::sin(turn), up);
    };
    mesh.bar(at(from, radius + 0.45, z),
             at(from + 2.2 / num_steps + 0.004, radius + 0.45, z + eave / num_steps), 0.7, rail);
  }
  for (const double share : {0.45, 0.75, 0.97})
    mesh.lathe({0.0, 0.0},
               {{radius - 0.2, share * eave - 0.1},
                {radius + 0.12, share * eave - 0.1},
                {radius + 0.12, share * eave + 0.1},
                {radius - 0.2, share * eave + 0.1}},
               sides, [&](std::size_t) { return wall; });
}

/// Three silos in a row with a lift between them.
void build_silos(ThingMesh& mesh, int detail) {
  const FinishNumber steel = mesh.finish(Material::SheetMetal, {190, 196, 198});
  const FinishNumber roof = mesh.finish(Material::Metal, {206, 210, 212});
  const FinishNumber grey = mesh.finish(Material::Metal, {140, 146, 150});
  const int sides = round_sides(24, detail);
  const double radius = 4.5;
  for (const double x : {-9.6, 0.0, 9.6}) {
    Outline profile = {{radius, -1.0}};
    if (detail == 0)  // sheets a little proud of each other
      for (int k = 0; k < 7; ++k) {
        profile.emplace_back(radius + (k % 2) * 0.05, 2.4 * k + 0.1);
        profile.emplace_back(radius + (k % 2) * 0.05, 2.4 * (k + 1));
      }
    else
      profile.emplace_back(radius, 16.8);
    profile.emplace_back(radius + 0.15, 16.9);
    profile.emplace_back(0.6, 19.4);
    profile.emplace_back(0.6, 20.0);
    const std::size_t last = profile.size();
    mesh.lathe({x, 0.0}, profile, sides,
               [&, last](std::size_t k) { return k + 4 >= last ? roof : steel; });
  }
  mesh.box({3.9, -6.4, -0.8}, {5.7, -4.4, 24.0}, grey);
  mesh.bar({4.8, -5.4, 22.5}, {4.8, 0.0, 20.6}, 0.7, grey);
  mesh.box({-10.2, -0.55, 19.9}, {10.2, 0.55, 20.7}, grey);
  if (detail < 2)
    for (int k = 0; k < 4; ++k)
      mesh.bar({4.8, -4.4, 3.0 + 4.0 * k}, {4.8, -2.0, 3.0 + 4.0 * k}, 0.2, grey);
}

void build_silo(ThingMesh& mesh, int detail) {
  const FinishNumber wall = mesh.finish(Material::Concrete, {186, 184, 176});
  const FinishNumber roof = mesh.finish(Material::Metal, {196, 200, 204});
  mesh.lathe({0.0, 0.0}, {{3.0, -1.0}, {3.0, 15.5}, {2.7, 16.7}, {1.8, 17.6}, {0.3, 18.0}},
             round_sides(24, detail), [&](std::size_t k) { return k == 0 ? wall : roof; });
  if (detail == 0) {
    const FinishNumber steel = mesh.finish(Material::Metal, {150, 152, 150});
    mesh.cylinder({2.9, 1.4, -0.5}, {2.9, 1.4, 16.2}, 0.5, 10, steel, steel);
    for (int k = 0; k < 9; ++k)
      mesh.lathe({0.0, 0.0},
                 {{2.8, 0.9 + 1.7 * k},
                  {3.03, 0.9 + 1.7 * k},
                  {3.03, 0.98 + 1.7 * k},
                  {2.8, 0.98 + 1.7 * k}},
                 24, [&](std::size_t) { return steel; });
  }
}

/// A ball on legs, for gas.
void build_sphere(ThingMesh& mesh, int detail) {
  const FinishNumber white = mesh.finish(Material::Paint, {234, 234, 230});
  const FinishNumber steel = mesh.finish(Material::Metal, {196, 198, 198});
  const double r = 9.0;
  const double z = 11.0;
  Outline profile;
  const int num_rings = detail == 0 ? 14 : detail == 1 ? 8 : 6;
  for (int k = 0; k <= num_rings; ++k) {
    const double turn = std::numbers::pi * k / num_rings;
    profile.emplace_back(std::max(r * std::sin(turn), 0.0), z - r * std::cos(turn));
  }
  mesh.lathe({0.0, 0.0}, profile, round_sides(26, detail), [&](std::size_t) { return white; });
  const int num_legs = detail >= 2 ? 4 : 10;
  for (int k = 0; k < num_legs; ++k) {
    const double turn = 2.0 * std::numbers::pi * k / num_legs;
    mesh.cylinder({8.9 * std::cos(turn), 8.9 * std::sin(turn), -1.0},
                  {8.9 * std::cos(turn), 8.9 * std::sin(turn), z}, 0.35, detail == 0 ? 8 : 4, steel,
                  steel);
  }
}

ThingInfo tank(std::string name, const Vector3d& size_m, std::string_view source, int num_variants,
               std::function<void(ThingMesh&, int, int)> build) {
  return {.name = std::move(name),
          .family = {},
          .semantic_class = core::SemanticClass::Object,
          .stance = Stance::Rooted,
          .size_m = size_m,
          .source = source,
          .coarsest_levels = {0, 1, 4},
          .num_variants = num_variants,
          .build = std::move(build)};
}

}  // namespace

std::vector<ThingInfo> tanks();
std::vector<ThingInfo> tanks() {
  return {tank("storage_tank", {37.5, 37.5, 15.7},
               "API 650: 36.6 m (120 ft) across, 14.6 m (48 ft) of wall; with its stairs", 3,
               [](ThingMesh& m, int d, int v) { build_tank(m, 18.29, 15.7, d, v); }),
          tank("storage_tank_small", {13.13, 13.13, 12.5},
               "API 650: 12.2 m (40 ft) across, 12.2 m (40 ft) of wall; with its stairs", 3,
               [](ThingMesh& m, int d, int v) { build_tank(m, 6.1, 12.5, d, v); }),
          tank("gas_sphere", {18.5, 17.87, 20.0}, "spheres of 3000 m3: 18 m across", 1,
               [](ThingMesh& m, int d, int) { build_sphere(m, d); }),
          tank("silo", {6.42, 6.06, 18.0}, "tower silos of 20 by 60 feet: 6.1 x 18.3 m", 1,
               [](ThingMesh& m, int d, int) { build_silo(m, d); }),
          tank("grain_silos", {28.5, 11.05, 24.0},
               "three hopper bins of 30 feet (9 m) across, eaves at 17 m", 1,
               [](ThingMesh& m, int d, int) { build_silos(m, d); })};
}

}  // namespace terracast::tiler
