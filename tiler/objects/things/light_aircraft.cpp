#include "tiler/objects/air_parts.h"
#include "tiler/objects/road_vehicle.h"

// Aeroplanes with one piston engine. x from the spinner aft in the table.
namespace terracast::tiler {
namespace {

using core::SemanticClass;
using Eigen::Vector3d;
using world::Material;

// 2400 turns a minute, as in cruise (Lycoming O-360 operator's manual: 2700 at most).
constexpr double kPropeller_radps = 251.0;

constexpr std::array<Color, 4> kStripes = {
    {{168, 24, 30}, {28, 58, 120}, {30, 96, 60}, {226, 150, 30}}};

void build_light(ThingMesh& mesh, const Vector3d& size_m, bool has_high_wing, int detail,
                 int variant) {
  const FinishNumber white = mesh.finish(Material::Paint, {238, 238, 234});
  const FinishNumber stripe =
      mesh.finish(Material::Paint, kStripes[static_cast<std::size_t>(variant)]);
  const FinishNumber glass = mesh.finish(Material::Glass, {44, 56, 66});
  const FinishNumber steel = mesh.finish(Material::Metal, {150, 152, 155});
  const FinishNumber dark = mesh.finish(Material::Plain, kDark);
  const double nose = 0.5 * size_m.x();
  const double length = size_m.x();
  const auto at = [&](double back, double z, double w, double h) {
    return Section{nose - back, z, w, h};
  };
  // Spinner, cowling, cabin, boom.
  const double top = has_high_wing ? 2.02 : 1.72;
  std::vector<Section> sections = {
      at(0.0, 1.32, 0.03, 0.03),
      at(0.22, 1.32, 0.16, 0.16),
      at(0.26, 1.27, 0.38, 0.30),
      at(0.6, 1.24, 0.48, 0.38),
      at(1.45, 1.28, 0.53, 0.44),
      at(2.15, 0.5 * (0.78 + top), 0.56, 0.5 * (top - 0.78)),
      at(3.4, 0.5 * (0.80 + top), 0.56, 0.5 * (top - 0.80)),
      at(4.5, 0.5 * (0.92 + top - 0.22), 0.45, 0.5 * (top - 0.22 - 0.92)),
      at(length - 0.5, 1.42, 0.12, 0.20),
      at(length - 0.12, 1.45, 0.04, 0.12)};
  if (detail >= 2) sections.erase(sections.begin() + 2, sections.begin() + 4);
  const int num_sides = detail >= 2 ? 6 : detail == 1 ? 8 : 12;
  const std::size_t screen = detail >= 2 ? 2 : 4;
  add_fuselage(
      mesh, sections, num_sides,
      [&](std::size_t r, std::size_t edge) {
        const double from_top = std::abs((static_cast<double>(edge) + 0.5) / num_sides - 0.5);
        if (r == screen && from_top < 0.25) return glass;
        if (r == screen + 1 && from_top > 0.06 && from_top < 0.26) return glass;
        if (r == screen + 2 && from_top < 0.22 && from_top > (has_high_wing ? 0.0 : 0.09))
          return glass;
        if (r > screen && from_top > 0.26 && from_top < 0.33) return stripe;
        return white;
      },
      white);
  const double half_span = 0.5 * size_m.y();
  if (has_high_wing) {
    add_wing_pair(mesh,
                  {{{nose - 2.05, 0.0, 2.03}, 1.63, 0.20},
                   {{nose - 2.05, 0.55 * half_span, 2.03 + 0.02 * half_span}, 1.63, 0.20},
                   {{nose - 2.28, half_span, 2.03 + 0.04 * half_span}, 1.12, 0.12}},
                  detail, white);
    if (detail < 2)
      for (const double side : {-1.0, 1.0})
        mesh.bar({nose - 2.6, side * 0.45, 0.98}, {nose - 2.65, side * 2.55, 2.08}, 0.09, white);
  } else {
    add_wing_pair(mesh,
                  {{{nose - 2.1, 0.0, 0.86}, 1.75, 0.24},
                   {{nose - 2.35, 0.5 * half_span, 0.86 + 0.06 * half_span}, 1.55, 0.20},
                   {{nose - 2.55, half_span, 0.86 + 0.12 * half_span}, 1.07, 0.12}},
                  detail, white);
  }
  const double tail_z = has_high_wing ? 1.42 : 1.35;
  add_wing_pair(mesh,
                {{{nose - length + 1.45, 0.0, tail_z}, 1.38, 0.11},
                 {{nose - length + 1.18, 1.70, tail_z}, 0.85, 0.08}},
                detail, white);
  add_wing(mesh,
           {{{nose - length + 2.0, 0.0, 1.45}, 1.75, 0.13},
            {{nose - length + 1.2, 0.0, 1.95}, 1.08, 0.11},
            {{nose - length + 0.78, 0.0, size_m.z()}, 0.78, 0.08}},
           Vector3d::UnitY(), detail, stripe);
  // Propeller at 20 degrees, so that it is seen from above and from the side.
  const Vector3d hub(nose - 0.14, 0.0, 1.32);
  mesh.turning({.name = "propeller",
                .origin_m = hub,
                .axis = Vector3d::UnitX(),
                .rate_radps = kPropeller_radps},
               [&] {
                 add_blades(mesh, hub, Vector3d::UnitX(), Vector3d(0.0, 0.94, 0.342).normalized(),
                            0.95, 0.15, 2, dark);
               });
  // Wheels: one in front, two below the cabin.
  const auto leg = [&](double back, double y, double up_y, double up_z, double r) {
    mesh.bar({nose - back, y, r}, {nose - back, up_y, up_z}, 0.08, steel);
    if (detail < 2)
      add_wheel(mesh, nose - back, y + 0.09, r, 0.18, 1);
    else
      mesh.box({nose - back - 0.15, y - 0.09, 0.0}, {nose - back + 0.15, y + 0.09, 0.3}, dark);
    if (detail == 0)  // fairing over the wheel
      mesh.tapered_box({nose - back - 0.34, y - 0.13, 0.13}, {nose - back + 0.30, y + 0.13, 0.40},
                       {nose - back - 0.1, y - 0.07}, {nose - back + 0.16, y + 0.07}, white);
  };
  leg(0.95, 0.0, 0.0, 1.0, 0.19);
  for (const double side : {-1.0, 1.0})
    leg(2.7, side * 1.26, has_high_wing ? side * 0.42 : side * 1.26, has_high_wing ? 0.92 : 0.9,
        0.22);
}

ThingInfo light(std::string name, const Vector3d& size_m, bool has_high_wing,
                std::string_view source) {
  return {.name = std::move(name),
          .family = {},
          .semantic_class = SemanticClass::Aircraft,
          .stance = Stance::Stands,
          .size_m = size_m,
          .source = source,
          .coarsest_levels = {0, 1, 3},
          .num_variants = static_cast<int>(kStripes.size()),
          .build = [size_m, has_high_wing](ThingMesh& m, int d, int v) {
            build_light(m, size_m, has_high_wing, d, v);
          }};
}

}  // namespace

std::vector<ThingInfo> light_aircraft();
std::vector<ThingInfo> light_aircraft() {
  return {light("light_aircraft", {8.28, 11.00, 2.72}, true,
                "Cessna 172S: 8.28 x 11.00 x 2.72 m (manufacturer's data)"),
          light("light_low_wing", {7.32, 10.80, 2.23}, false,
                "Piper PA-28-181: 7.32 x 10.80 x 2.23 m (manufacturer's data)")};
}

}  // namespace terracast::tiler
