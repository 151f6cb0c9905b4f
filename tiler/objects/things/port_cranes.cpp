#include "tiler/objects/road_vehicle.h"

namespace terracast::tiler {
namespace {

using core::SemanticClass;
using Eigen::Vector3d;
using world::Material;

constexpr std::array<Color, 3> kColors = {{{36, 84, 150}, {196, 60, 44}, {226, 226, 222}}};

/// A ship-to-shore gantry: the boom reaches forward (x) over the ship. The origin lies between its rails.
void build_gantry(ThingMesh& mesh, int detail, int variant) {
  const FinishNumber paint =
      mesh.finish(Material::Paint, kColors[static_cast<std::size_t>(variant)]);
  const FinishNumber grey = mesh.finish(Material::Metal, {120, 124, 128});
  const FinishNumber white = mesh.finish(Material::Paint, {232, 232, 228});
  const FinishNumber glass = mesh.finish(Material::Glass, kWindow);
  const double land = -15.24;  // rails 30.48 m apart
  const double sea = 15.24;
  const double beam_z = 38.0;
  for (const double y : {-9.0, 9.0}) {
    for (const double x : {land, sea}) {
      mesh.box({x - 0.7, y - 0.9, 1.2}, {x + 0.7, y + 0.9, beam_z + 1.0}, paint);
      if (detail < 2) {  // bogies
        mesh.box({x - 0.5, y - 3.6, 0.5}, {x + 0.5, y + 3.6, 1.7}, grey);
        for (const double at : {-3.0, -1.4, 1.4, 3.0})
          mesh.cylinder({x - 0.3, y + at, 0.4}, {x + 0.3, y + at, 0.4}, 0.4, detail == 0 ? 10 : 6,
                        grey, grey);
      } else {
        mesh.box({x - 0.5, y - 3.6, 0.0}, {x + 0.5, y + 3.6, 1.7}, grey);
      }
    }
    mesh.box({land, y - 0.7, 15.0}, {sea, y + 0.7, 17.0}, paint);  // portal beam
    mesh.bar({land, y, 17.0}, {sea - 0.5, y, beam_z - 1.0}, 0.8, paint);
    // The frame above the sea-side legs.
    mesh.bar({sea, y, beam_z}, {sea - 2.0, y * 0.25, 62.0}, 1.0, paint);
  }
  for (const double x : {land, sea}) {
    mesh.box({x - 0.6, -9.0, 14.6}, {x + 0.6, 9.0, 16.6}, paint);
    mesh.box({x - 0.65, -9.0, beam_z - 0.6}, {x + 0.65, 9.0, beam_z + 1.2}, paint);
  }
  mesh.box({sea - 3.0, -2.9, 61.0}, {sea - 1.0, 2.9, 63.0}, paint);
  // Boom of two girders, from 15 m behind the land rail to 40 m in front of the sea rail.
  for (const double y : {-3.3, 3.3})
    mesh.box({land - 15.0, y - 0.55, beam_z + 0.8}, {sea + 40.0, y + 0.55, beam_z + 3.0}, paint);
  for (const double x : {land - 14.8, -4.0, 24.0, 40.0, sea + 39.0})
    mesh.box({x - 0.4, -3.2, beam_z + 1.2}, {x + 0.4, 3.2, beam_z + 2.4}, paint);
  for (const double y : {-2.8, 2.8}) {
    const double bar = detail == 0 ? 0.35 : 0.5;
    mesh.bar({sea - 2.0, y, 62.0}, {sea + 37.0, 1.15 * y, beam_z + 2.6}, bar, paint);
    mesh.bar({sea - 2.0, y, 62.0}, {sea + 17.0, 1.15 * y, beam_z + 2.6}, bar, paint);
    mesh.bar({sea - 2.0, y, 62.0}, {land, 1.15 * y, beam_z + 2.6}, bar, paint);
    if (detail < 2) mesh.bar({land, 1.1 * y, 46.0}, {sea - 2.4, y, 61.5}, 0.5, paint);
  }
  for (const double y : {-3.0, 3.0}) mesh.bar({land, y, beam_z + 2.0}, {land, y, 46.3}, 0.7, paint);
  // Machine house, trolley with its cab, spreader on ropes.
  mesh.box({land - 9.0, -4.0, beam_z + 2.6}, {land + 7.0, 4.0, beam_z + 7.6}, white);
  if (detail < 2) {
    const double x = sea + 15.0;
    mesh.box({x - 3.0, -3.4, beam_z + 2.8}, {x + 3.0, 3.4, beam_z + 4.0}, grey);
    mesh.box({x - 4.4, -2.6, beam_z - 2.6}, {x - 2.6, -0.6, beam_z + 0.4}, glass);
    for (const double dx : {-1.5, 1.5})
      for (const double y : {-1.0, 1.0})
        mesh.bar({x + dx, y, beam_z + 2.9}, {x + dx, y, 24.0}, 0.06, grey, 3);
    mesh.box({x - 1.2, -6.0, 23.6}, {x + 1.2, 6.0, 24.3},
             mesh.finish(Material::Paint, {226, 172, 36}));
  }
  if (detail == 0) {
    for (int k = 0; k < 9; ++k) {  // stairs zigzag on a leg
      const double s = k % 2 == 0 ? 1.0 : -1.0;
      mesh.bar({land - 1.3, 9.0 - 1.6 * s, 2.0 + 4.0 * k},
               {land - 1.3, 9.0 + 1.6 * s, 6.0 + 4.0 * k}, 0.5, grey);
    }
    for (const double y : {-4.1, 4.1})
      mesh.box({land - 15.0, y - 0.35, beam_z + 1.5}, {sea + 40.0, y + 0.35, beam_z + 1.6}, grey);
  }
}

/// A rubber-tyred gantry over six rows of containers and a lane; it spans across (y).
void build_yard_crane(ThingMesh& mesh, int detail, int variant) {
  const FinishNumber paint =
      mesh.finish(Material::Paint, kColors[static_cast<std::size_t>(variant)]);
  const FinishNumber grey = mesh.finish(Material::Metal, {110, 114, 118});
  const FinishNumber glass = mesh.finish(Material::Glass, kWindow);
  const double half = 11.735;  // 23.47 m between the wheels' middles
  const double top = 22.0;
  for (const double y : {-half, half}) {
    for (const double x : {-3.6, 3.6})
      mesh.box({x - 0.4, y - 0.45, 1.6}, {x + 0.4, y + 0.45, top + 0.5}, paint);
    mesh.box({-6.0, y - 0.5, 1.3}, {6.0, y + 0.5, 2.5}, paint);
    mesh.box({-3.6, y - 0.4, top - 1.4}, {3.6, y + 0.4, top - 0.2}, paint);
    for (const double x : {-5.2, -3.2, 3.2, 5.2}) {
      if (detail < 2)
        add_wheel(mesh, x, y > 0 ? y + 0.32 : y - 0.32, 0.78, 0.64, detail);
      else
        mesh.box({x - 0.7, y - 0.3, 0.0}, {x + 0.7, y + 0.3, 1.4},
                 mesh.finish(Material::Rubber, kTyre));
    }
  }
  for (const double x : {-3.6, 3.6})
    mesh.box({x - 0.55, -half - 0.6, top}, {x + 0.55, half + 0.6, top + 2.0}, paint);
  const double trolley = 3.0;
  mesh.box({-4.4, trolley - 2.6, top + 1.9}, {4.4, trolley + 2.6, top + 3.0}, grey);
  if (detail < 2) {
    mesh.box({-1.6, trolley - 1.8, top + 2.9}, {1.6, trolley + 1.8, top + 4.2}, grey);
    mesh.box({-3.0, trolley - 2.4, top - 2.6}, {-1.4, trolley - 0.8, top - 0.2}, glass);
    mesh.box({-2.8, trolley - 2.2, top - 0.4}, {-2.4, trolley - 1.8, top + 2.2}, grey);
    for (const double x : {-2.2, 2.2})
      for (const double y : {-0.8, 0.8})
        mesh.bar({x, trolley + y, top + 2.2}, {x, trolley + y, 14.4}, 0.05, grey, 3);
    mesh.box({-6.0, trolley - 1.2, 14.0}, {6.0, trolley + 1.2, 14.5},
             mesh.finish(Material::Paint, {226, 172, 36}));
    mesh.box({-2.6, half + 0.45, 2.4}, {2.6, half + 1.3, 4.6}, grey);  // its engine
  } else {
    mesh.box({-1.6, trolley - 1.8, top + 2.9}, {1.6, trolley + 1.8, top + 4.2}, grey);
    mesh.box({-2.6, half + 0.4, 2.4}, {2.6, half + 1.3, 4.6}, grey);
  }
}

}  // namespace

std::vector<ThingInfo> port_cranes();
std::vector<ThingInfo> port_cranes() {
  const auto crane = [](std::string name, const Vector3d& size_m, std::string_view source,
                        void (*build)(ThingMesh&, int, int)) {
    return ThingInfo{.name = std::move(name),
                     .family = {},
                     .semantic_class = SemanticClass::Crane,
                     .stance = Stance::Stands,
                     .size_m = size_m,
                     .source = source,
                     .coarsest_levels = {0, 1, 5},
                     .num_variants = static_cast<int>(kColors.size()),
                     .build = build};
  };
  return {
      crane("gantry_crane", {85.48, 25.2, 63.0},
            "Panamax ship-to-shore cranes: rails 30.48 m (100 ft) apart, outreach 40 m, back reach "
            "15 m, 27 m wide",
            build_gantry),
      crane("yard_crane", {12.0, 25.37, 26.2},
            "Konecranes RTG, 6 rows and a lane: span 23.47 m, lifts 1 over 5", build_yard_crane)};
}

}  // namespace terracast::tiler
