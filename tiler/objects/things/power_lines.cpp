#include <cmath>

#include "tiler/objects/lattice.h"
#include "tiler/objects/power_line.h"

// Supports of power lines.
namespace terracast::tiler {
namespace {

using core::SemanticClass;
using Eigen::Vector3d;
using world::Material;

/// Cross-arms of the large pylon: heights and half lengths; a conductor hangs at each end.
struct Arm {
  double z_m;
  double half_m;
};
struct PylonSpec {
  double height_m;
  double foot_half_m;
  double waist_z_m;
  double waist_half_m;
  double top_half_m;
  std::vector<Arm> arms;
  double insulator_m;
};
// The shape of National Grid's L6 (50.6 m, three pairs of arms), and of smaller ones of 132 kV (26.3 m).
const PylonSpec kLarge = {50.6, 4.6, 27.5, 1.5, 0.7, {{30.5, 8.3}, {38.0, 10.0}, {45.5, 7.4}}, 4.1};
const PylonSpec kSmall = {26.3, 2.2, 14.0, 0.75, 0.4, {{16.4, 3.6}, {19.8, 4.2}, {23.2, 3.2}}, 1.6};

void build_pylon(ThingMesh& mesh, const PylonSpec& pylon, int detail) {
  const FinishNumber steel = mesh.finish(Material::Metal, {142, 147, 150});
  const FinishNumber glass = mesh.finish(Material::Glass, {96, 118, 112});
  const FinishNumber concrete = mesh.finish(Material::Concrete, {150, 148, 142});
  const double leg = 0.0050 * pylon.height_m;
  const double brace = 0.0026 * pylon.height_m;
  std::vector<LatticeLevel> levels = {{-1.0, pylon.foot_half_m * (1.0 + 1.0 / pylon.waist_z_m)}};
  for (const double share : {0.0, 0.22, 0.41, 0.57, 0.70, 0.81, 0.91, 1.0})
    levels.push_back({share * pylon.waist_z_m,
                      pylon.foot_half_m + share * (pylon.waist_half_m - pylon.foot_half_m)});
  const double top_z = pylon.arms.back().z_m + 0.5;
  const int num_panels = 8;
  for (int k = 1; k <= num_panels; ++k) {
    const double t = static_cast<double>(k) / num_panels;
    levels.push_back({pylon.waist_z_m + t * (top_z - pylon.waist_z_m),
                      pylon.waist_half_m + t * (pylon.top_half_m - pylon.waist_half_m)});
  }
  if (detail == 1) {  // every second level
    std::vector<LatticeLevel> fewer;
    for (std::size_t i = 0; i < levels.size(); i += 2) fewer.push_back(levels[i]);
    if (levels.size() % 2 == 0) fewer.push_back(levels.back());
    levels = fewer;
  }
  if (detail >= 2) {
    add_lattice(mesh, {levels[0], {pylon.waist_z_m, pylon.waist_half_m}, levels.back()}, leg, brace,
                detail, [&](std::size_t) { return steel; });
  } else {
    add_lattice(mesh, levels, leg, brace, detail, [&](std::size_t) { return steel; });
  }
  // The earth wire's peak.
  for (int k = 0; k < 4; ++k)
    mesh.bar({k % 2 == 0 ? -pylon.top_half_m : pylon.top_half_m,
              k < 2 ? -pylon.top_half_m : pylon.top_half_m, top_z},
             {0.0, 0.0, pylon.height_m - 0.02 * (k + 1)}, leg, steel, 3);
  mesh.bar({0.0, 0.0, pylon.height_m - 1.2}, {0.0, 0.0, pylon.height_m}, leg, steel);
  for (const Arm& arm : pylon.arms) {
    const double t = (arm.z_m - pylon.waist_z_m) / (top_z - pylon.waist_z_m);
    const double half = pylon.waist_half_m + t * (pylon.top_half_m - pylon.waist_half_m);
    const double rise = 0.22 * arm.half_m;
    for (const double side : {-1.0, 1.0}) {
      const Vector3d tip(0.0, side * arm.half_m, arm.z_m);
      for (const double x : {-half, half}) {
        const Vector3d foot(x, side * half, arm.z_m);
        const Vector3d shoulder(x, side * half, arm.z_m + rise);
        mesh.bar(foot, tip, 0.8 * leg, steel, 3);
        if (detail < 2) mesh.bar(shoulder, tip, 0.8 * leg, steel, 3);
        if (detail == 0)
          for (const double share : {0.3, 0.6}) {
            mesh.bar(foot + share * (tip - foot), shoulder + share * (tip - shoulder), brace, steel,
                     3);
            mesh.bar(foot + (share - 0.3) * (tip - foot), shoulder + share * (tip - shoulder),
                     brace, steel, 3);
          }
      }
      if (detail == 0)
        mesh.bar({-half, side * half, arm.z_m}, {half, side * half, arm.z_m}, brace, steel, 3);
      const Vector3d end = tip - pylon.insulator_m * Vector3d::UnitZ();
      mesh.bar(tip, end, detail == 0 ? 0.11 : 0.16, glass, detail == 0 ? 4 : 3);
      if (detail == 0)
        for (int k = 1; k <= 6; ++k) {
          const double z = tip.z() - pylon.insulator_m * k / 7.0;
          mesh.cylinder({0.0, tip.y(), z - 0.05}, {0.0, tip.y(), z + 0.05}, 0.16, 6, glass, glass);
        }
    }
  }
  if (detail == 0)
    for (const double x : {-1.0, 1.0})
      for (const double y : {-1.0, 1.0})
        mesh.box({x * pylon.foot_half_m - 0.5, y * pylon.foot_half_m - 0.5, -1.2},
                 {x * pylon.foot_half_m + 0.5, y * pylon.foot_half_m + 0.5, 0.25}, concrete);
}

void build_pole(ThingMesh& mesh, int detail) {
  const FinishNumber wood = mesh.finish(Material::Planks, {98, 78, 58});
  const FinishNumber dark = mesh.finish(Material::Glass, {70, 52, 44});
  const FinishNumber steel = mesh.finish(Material::Metal, {120, 122, 124});
  mesh.cone({0.0, 0.0, -1.5}, {0.0, 0.0, 9.6}, 0.15, 0.09, detail == 0 ? 10 : 4, wood, wood);
  mesh.box({-0.06, -1.05, 9.12}, {0.14, 1.05, 9.24}, detail == 0 ? steel : wood);
  if (detail < 2)
    for (const double y : {-0.95, 0.95})
      mesh.cylinder({0.04, y, 9.2}, {0.04, y, 9.6}, 0.055, detail == 0 ? 8 : 4, dark, dark);
  if (detail < 2)
    mesh.cylinder({0.0, 0.0, 9.55}, {0.0, 0.0, 10.0}, 0.055, detail == 0 ? 8 : 4, dark, dark);
  if (detail == 0)
    for (const double y : {-0.7, 0.7}) mesh.bar({0.08, y, 9.14}, {0.06, 0.0, 8.4}, 0.04, steel);
}

}  // namespace

std::vector<Vector3d> wire_points(std::string_view thing) {
  std::vector<Vector3d> points;
  if (thing == "wood_pole") return {{0.04, -0.95, 9.6}, {0.0, 0.0, 10.0}, {0.04, 0.95, 9.6}};
  const PylonSpec& pylon = thing == "pylon_small" ? kSmall : kLarge;
  for (const Arm& arm : pylon.arms)
    for (const double side : {-1.0, 1.0})
      points.emplace_back(0.0, side * arm.half_m, arm.z_m - pylon.insulator_m);
  points.emplace_back(0.0, 0.0, pylon.height_m);
  return points;
}

double wire_height_m(double share, double distance_m, double rise_m, double catenary_m) {
  // z(x) = c (cosh((x - m) / c) - cosh(m / c)), with the lowest point m where z(distance) is the rise:
  // 2 c sinh(d / 2c) sinh((d - 2m) / 2c) = rise.
  const double c = catenary_m;
  const double d = distance_m;
  const double m = 0.5 * d - c * std::asinh(rise_m / (2.0 * c * std::sinh(d / (2.0 * c))));
  return c * (std::cosh((share * d - m) / c) - std::cosh(m / c));
}

std::vector<ThingInfo> power_lines();
std::vector<ThingInfo> power_lines() {
  const auto support = [](std::string name, const Vector3d& size_m, std::string_view source,
                          std::vector<int> levels,
                          std::function<void(ThingMesh&, int, int)> build) {
    return ThingInfo{.name = std::move(name),
                     .family = {},
                     .semantic_class = SemanticClass::Pylon,
                     .stance = Stance::Rooted,
                     .size_m = size_m,
                     .source = source,
                     .coarsest_levels = std::move(levels),
                     .num_variants = 1,
                     .build = std::move(build)};
  };
  return {support("pylon", {10.2, 20.32, 50.6},
                  "National Grid's L6 (400 kV): 50.6 m high, three pairs of arms; arms and foot "
                  "drawn from its outline",
                  {0, 1, 4}, [](ThingMesh& m, int d, int) { build_pylon(m, kLarge, d); }),
          support("pylon_small", {5.4, 8.72, 26.3},
                  "132 kV towers (PL1, L4): 26.3 m high, three pairs of arms; arms and foot drawn "
                  "from their outline",
                  {0, 1, 3}, [](ThingMesh& m, int d, int) { build_pylon(m, kSmall, d); }),
          support("wood_pole", {0.30, 2.10, 10.0},
                  "BS 1990-1 medium poles of 11.5 m, 1.5 m of them in the ground", {0, 1, 2},
                  [](ThingMesh& m, int d, int) { build_pole(m, d); })};
}

}  // namespace terracast::tiler
