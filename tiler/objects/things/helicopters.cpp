#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "tiler/objects/air_parts.h"
#include "tiler/objects/road_vehicle.h"

namespace terracast::tiler {
namespace {

using core::SemanticClass;
using Eigen::Vector3d;
using world::Material;

constexpr std::array<Color, 4> kColors = {
    {{214, 168, 24}, {170, 26, 30}, {30, 58, 116}, {228, 228, 224}}};

// About 395 and 2090 turns a minute, those of the Airbus H125 (manufacturer's data: 385 to 394, and 2086).
constexpr double kRotor_radps = 41.0;
constexpr double kTailRotor_radps = 218.0;

struct HelicopterSpec {
  Vector3d size_m;      ///< with its rotor, one blade forward
  double rotor_m;       ///< radius
  double hub_x_m;       ///< from the box's middle
  double body_front_m;  ///< x of the nose
  double tail_m;        ///< x of the tail's end
  double tail_rotor_m;  ///< radius
  int num_blades;
  double body_half_width_m;
  double cabin_m;  ///< length of the cabin
};

void build_helicopter(ThingMesh& mesh, const HelicopterSpec& h, int detail, int variant) {
  const FinishNumber paint =
      mesh.finish(Material::Paint, kColors[static_cast<std::size_t>(variant)]);
  const FinishNumber white = mesh.finish(Material::Paint, {232, 232, 230});
  const FinishNumber glass = mesh.finish(Material::Glass, {40, 50, 60});
  const FinishNumber dark = mesh.finish(Material::Metal, {48, 49, 52});
  const double nose = h.body_front_m;
  const double w = h.body_half_width_m;
  const double cabin = h.cabin_m;
  const double roof = 0.72 * h.size_m.z();
  const double mid = 0.5 * (0.55 + roof);
  const double half = 0.5 * (roof - 0.55);
  const auto at = [&](double back, double z, double sw, double sh) {
    return Section{nose - back, z, sw * w, sh * half};
  };
  std::vector<Section> sections = {at(0.0, mid - 0.30 * half, 0.1, 0.12),
                                   at(0.12 * cabin, mid - 0.24 * half, 0.55, 0.52),
                                   at(0.30 * cabin, mid - 0.08 * half, 0.85, 0.84),
                                   at(0.52 * cabin, mid, 1.0, 1.0),
                                   at(0.80 * cabin, mid, 1.0, 1.0),
                                   at(1.0 * cabin, mid + 0.1 * half, 0.84, 0.86),
                                   at(1.35 * cabin, mid + 0.42 * half, 0.42, 0.42),
                                   {h.tail_m + 0.9, mid + 0.62 * half, 0.12, 0.15},
                                   {h.tail_m + 0.3, mid + 0.66 * half, 0.06, 0.10}};
  const int num_sides = detail == 0 ? 14 : detail == 1 ? 8 : 6;
  add_fuselage(
      mesh, sections, num_sides,
      [&](std::size_t r, std::size_t edge) {
        const double turn = (static_cast<double>(edge) + 0.5) / num_sides;
        const double from_top = std::abs(turn - 0.5);
        if (r == 1 || r == 2) return from_top < 0.33 ? glass : paint;
        if (r == 3) return from_top > 0.1 && from_top < 0.3 ? glass : paint;
        if (r >= 6) return white;
        return paint;
      },
      paint);
  // Engine cover, mast, rotor.
  mesh.tapered_box({h.hub_x_m - 1.5, -0.5 * w, roof - 0.35},
                   {h.hub_x_m + 0.9, 0.5 * w, roof + 0.35}, {h.hub_x_m - 1.1, -0.3 * w},
                   {h.hub_x_m + 0.4, 0.3 * w}, paint);
  mesh.cylinder({h.hub_x_m, 0.0, roof}, {h.hub_x_m, 0.0, h.size_m.z()}, 0.11, detail == 0 ? 10 : 4,
                dark, dark);
  const Vector3d hub(h.hub_x_m, 0.0, h.size_m.z() - 0.15);
  mesh.turning(
      {.name = "rotor", .origin_m = hub, .axis = -Vector3d::UnitZ(), .rate_radps = kRotor_radps},
      [&] {
        add_blades(mesh, hub, Vector3d::UnitZ(), Vector3d::UnitX(), h.rotor_m, 0.32, h.num_blades,
                   dark, 0.04);
      });
  if (detail < 2) {
    mesh.cylinder({h.hub_x_m, 0.0, h.size_m.z() - 0.26}, {h.hub_x_m, 0.0, h.size_m.z() - 0.04},
                  0.30, 8, dark, dark);
    // Tail rotor on the right, upright.
    const Vector3d tail_hub(h.tail_m + 0.45, -0.24, mid + 0.66 * half);
    mesh.turning({.name = "tail_rotor",
                  .origin_m = tail_hub,
                  .axis = Vector3d::UnitY(),
                  .rate_radps = kTailRotor_radps},
                 [&] {
                   add_blades(mesh, tail_hub, Vector3d::UnitY(), Vector3d(0.6, 0.0, 0.8),
                              h.tail_rotor_m, 0.18, 2, dark);
                 });
    mesh.bar({h.tail_m + 0.45, -0.02, mid + 0.66 * half},
             {h.tail_m + 0.45, -0.27, mid + 0.66 * half}, 0.1, dark);
  }
  // Fins above and below the boom's end, tail plane.
  add_wing(mesh,
           {{{h.tail_m + 0.75, 0.0, mid - 0.05 * half}, 0.42, 0.05},
            {{h.tail_m + 0.95, 0.0, mid + 0.62 * half}, 0.75, 0.08},
            {{h.tail_m + 0.45, 0.0, mid + 1.45 * half}, 0.45, 0.05}},
           Vector3d::UnitY(), detail, paint);
  add_wing_pair(mesh,
                {{{h.tail_m + 2.0, 0.0, mid + 0.6 * half}, 0.55, 0.06},
                 {{h.tail_m + 1.95, 1.15, mid + 0.6 * half}, 0.5, 0.05}},
                detail, white);
  // Skids; their lowest sides lie on the ground.
  for (const double side : {-1.0, 1.0}) {
    const double y = side * (w + 0.28);
    const double r = 0.05;
    mesh.bar({nose - 1.35 * cabin, y, r}, {nose - 0.25 * cabin, y, r}, 2.0 * r, dark);
    if (detail < 2) {
      mesh.bar({nose - 0.25 * cabin + 0.02, y, r + 0.01}, {nose - 0.08 * cabin, y, 0.28}, 0.09,
               dark);
      for (const double x : {nose - 0.42 * cabin, nose - 1.05 * cabin})
        mesh.bar({x, y, r}, {x, side * 0.4 * w, 0.75}, 0.08, dark);
    }
  }
}

ThingInfo helicopter(std::string name, const HelicopterSpec& spec, std::string_view source) {
  return {.name = std::move(name),
          .family = {},
          .semantic_class = SemanticClass::Helicopter,
          .stance = Stance::Stands,
          .size_m = spec.size_m,
          .source = source,
          .coarsest_levels = {0, 1, 3},
          .num_variants = static_cast<int>(kColors.size()),
          .build = [spec](ThingMesh& m, int d, int v) { build_helicopter(m, spec, d, v); }};
}

}  // namespace

std::vector<ThingInfo> helicopters();
std::vector<ThingInfo> helicopters() {
  // The rotor's widths are those of blades at 0 and 120 degrees, and at 0 and 90 degrees.
  return {
      helicopter("helicopter",
                 {.size_m = {12.94, 9.39, 3.34},
                  .rotor_m = 5.345,
                  .hub_x_m = 1.125,
                  .body_front_m = 3.45,
                  .tail_m = -6.31,
                  .tail_rotor_m = 0.93,
                  .num_blades = 3,
                  .body_half_width_m = 0.90,
                  .cabin_m = 3.6},
                 "Airbus H125: 12.94 m with rotors, rotor of 10.69 m, 3.34 m high (manufacturer's "
                 "data); across, the blades at 0 and 120 degrees, with their chord"),
      helicopter("rescue_helicopter",
                 {.size_m = {13.64, 10.80, 3.95},
                  .rotor_m = 5.40,
                  .hub_x_m = 1.42,
                  .body_front_m = 4.2,
                  .tail_m = -6.82,
                  .tail_rotor_m = 0.55,
                  .num_blades = 4,
                  .body_half_width_m = 1.02,
                  .cabin_m = 4.6},
                 "Airbus H145: 13.54 to 13.64 m with rotors, 3.95 m high (manufacturer's data; "
                 "four of its "
                 "blades drawn, rotor of 10.8 m)")};
}

}  // namespace terracast::tiler
