#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <numbers>

#include "tiler/objects/gait.h"
#include "tiler/objects/things.h"

// People, who stand with straight legs; those that move swing legs and arms.
namespace terracast::tiler {
namespace {

using core::SemanticClass;
using Eigen::Vector2d;
using Eigen::Vector3d;
using world::Material;

struct Clothes {
  Color top;
  Color trousers;
  Color skin;
  Color hair;
};
constexpr std::array<Clothes, 6> kClothes = {
    {{{44, 62, 108}, {38, 40, 46}, {224, 182, 152}, {62, 44, 30}},
     {{168, 38, 36}, {52, 62, 88}, {196, 146, 112}, {28, 24, 22}},
     {{226, 222, 212}, {96, 88, 74}, {232, 196, 168}, {150, 112, 66}},
     {{52, 96, 64}, {30, 31, 34}, {122, 82, 58}, {22, 20, 19}},
     {{214, 170, 52}, {66, 74, 96}, {212, 168, 136}, {92, 62, 40}},
     {{88, 86, 92}, {112, 98, 78}, {158, 110, 80}, {40, 36, 34}}}};

/// A limb as a skin over level round sections, from the lowest to the highest.
/// finishes   between each two of them
void add_limb(ThingMesh& mesh, const std::vector<Vector3d>& joints,
              const std::vector<double>& radii_m, int num_sides,
              const std::vector<FinishNumber>& finishes) {
  std::vector<Ring> rings;
  for (std::size_t i = 0; i < joints.size(); ++i)
    rings.push_back(ring_at(joints[i].z(),
                            round_outline(radii_m[i], radii_m[i], num_sides, joints[i].head<2>())));
  mesh.loft(
      rings, [&](std::size_t ring, std::size_t) { return finishes[ring]; }, finishes.front(),
      finishes.back());
}

/// Sections of a trunk: height, half its depth (x), half its width (y).
void add_trunk(ThingMesh& mesh, const std::vector<Vector3d>& sections, int num_sides,
               const FinishOfFace& finish, FinishNumber ends) {
  std::vector<Ring> rings;
  for (const Vector3d& section : sections)
    rings.push_back(ring_at(section.x(), round_outline(section.y(), section.z(), num_sides)));
  mesh.loft(rings, finish, ends, ends);
}

/// Of 1.75 m; `size` scales it.
void build_person(ThingMesh& mesh, double size, int detail, int variant) {
  const Clothes& clothes = kClothes[static_cast<std::size_t>(variant)];
  const FinishNumber top = mesh.finish(Material::Plain, clothes.top);
  const FinishNumber trousers = mesh.finish(Material::Plain, clothes.trousers);
  const FinishNumber skin = mesh.finish(Material::Plain, clothes.skin);
  const FinishNumber hair = mesh.finish(Material::Plain, clothes.hair);
  const FinishNumber shoe = mesh.finish(Material::Rubber, {34, 32, 31});
  const int num_sides = round_sides(12, detail);
  const auto at = [size](double x, double y, double z) -> Vector3d {
    return size * Vector3d(x, y, z);
  };
  const auto scaled = [size](std::vector<double> radii) {
    for (double& radius : radii) radius *= size;
    return radii;
  };
  for (const double side : {1.0, -1.0}) {
    const double stature_m = size * kDrawnStature_m;
    const double step_m = step_length_m(stature_m, usual_walk_mps(stature_m));
    const auto swinging = [&](const char* name, const Vector3d& joint, double swing_rad,
                              double phase_rad, const std::function<void()>& build) {
      mesh.turning({.name = name,
                    .origin_m = joint,
                    .axis = Vector3d::UnitY(),
                    .per_metre_rad = std::numbers::pi / step_m,
                    .swing_rad = swing_rad,
                    .phase_rad = phase_rad},
                   build);
    };
    // One leg goes back while the other comes forward, each arm against the leg at its side.
    const double leg_phase_rad = side > 0.0 ? 0.0 : std::numbers::pi;
    swinging(
        "leg", at(0.0, side * 0.09, 0.88), leg_swing_rad(stature_m, step_m), leg_phase_rad, [&] {
          add_limb(mesh,
                   {at(-0.01, side * 0.09, 0.05), at(0.0, side * 0.095, 0.48),
                    at(0.0, side * 0.09, 0.90)},
                   scaled({0.045, 0.062, 0.082}), num_sides, {trousers, trousers});
          mesh.box(at(-0.09, side * 0.09 - 0.045, 0.0), at(0.15, side * 0.09 + 0.045, 0.09), shoe);
        });
    swinging("arm", at(0.0, side * 0.20, 1.40), arm_swing_rad(stature_m, step_m),
             std::numbers::pi - leg_phase_rad, [&] {
               add_limb(mesh,
                        {at(0.05, side * 0.23, 0.86), at(-0.01, side * 0.225, 1.13),
                         at(0.0, side * 0.20, 1.42)},
                        scaled({0.032, 0.042, 0.052}), num_sides, {detail == 0 ? skin : top, top});
             });
  }
  add_trunk(
      mesh,
      {at(0.84, 0.10, 0.155), at(0.95, 0.115, 0.165), at(1.08, 0.105, 0.145), at(1.28, 0.125, 0.18),
       at(1.42, 0.105, 0.195), at(1.48, 0.06, 0.08)},
      num_sides, [&](std::size_t ring, std::size_t) { return ring == 0 ? trousers : top; }, top);
  mesh.cylinder(at(0.005, 0.0, 1.45), at(0.02, 0.0, 1.56), 0.052 * size, num_sides, skin, skin);
  add_trunk(
      mesh,
      {at(1.515, 0.05, 0.045), at(1.56, 0.088, 0.07), at(1.64, 0.098, 0.078), at(1.71, 0.08, 0.065),
       at(1.75, 0.03, 0.025)},
      num_sides,
      [&](std::size_t ring, std::size_t edge) {
        const double turn = (static_cast<double>(edge) + 0.5) / num_sides;
        const bool is_face = std::abs(turn - 0.5) > 0.3;
        return ring >= 2 || (ring == 1 && !is_face) ? hair : skin;
      },
      hair);
}

ThingInfo person(std::string name, double size, std::string_view source) {
  return {.name = std::move(name),
          .family = {},
          .semantic_class = SemanticClass::Person,
          .stance = Stance::Stands,
          .size_m = size * Vector3d(0.275, 0.53, 1.75),
          .source = source,
          .coarsest_levels = {0, 1, 2},
          .num_variants = static_cast<int>(kClothes.size()),
          .build = [size](ThingMesh& m, int d, int v) { build_person(m, size, d, v); }};
}

}  // namespace

std::vector<ThingInfo> people();
std::vector<ThingInfo> people() {
  return {
      person(
          "person", 1.0,
          "1.75 m: mean stature of adults in Europe, 1.80 m of men and 1.67 m of women (NCD-RisC, "
          "2016), rounded; breadths of DIN 33402-2"),
      person("child", 0.72,
             "1.26 m: median stature at 7 to 8 years (WHO growth reference, 2007), rounded")};
}

}  // namespace terracast::tiler
