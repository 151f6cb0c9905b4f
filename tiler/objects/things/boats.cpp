#include <array>

#include "tiler/objects/hull.h"

namespace terracast::tiler {
namespace {

using core::SemanticClass;
using Eigen::Vector3d;
using world::Material;

FinishNumber white(ThingMesh& mesh) { return mesh.finish(Material::Paint, {238, 238, 234}); }
FinishNumber glass(ThingMesh& mesh) { return mesh.finish(Material::Glass, {34, 42, 50}); }
FinishNumber teak(ThingMesh& mesh) { return mesh.finish(Material::Planks, {158, 122, 82}); }

void build_sailing_yacht(ThingMesh& mesh, int detail, int variant) {
  static constexpr std::array<Color, 3> kHulls = {{{238, 238, 234}, {26, 42, 84}, {226, 222, 206}}};
  const FinishNumber hull = mesh.finish(Material::Paint, kHulls[static_cast<std::size_t>(variant)]);
  const FinishNumber under = mesh.finish(Material::Paint, {40, 60, 92});
  const FinishNumber metal = mesh.finish(Material::Metal, {205, 207, 210});
  const FinishNumber dark = mesh.finish(Material::Plain, {46, 48, 52});
  add_hull(mesh,
           {.length_m = 11.99,
            .beam_m = 3.91,
            .draught_m = 0.65,
            .deck_z_m = 1.15,
            .bow_rise_m = 0.25,
            .bow_m = 6.2,
            .stern_m = 4.0,
            .transom = 0.78,
            .rake_m = 0.5,
            .bottom = 0.15},
           detail, hull, under, teak(mesh));
  // Keel, coach roof, cockpit.
  mesh.tapered_box({-0.9, -0.09, -2.1}, {0.8, 0.09, -0.4}, {-1.0, -0.12}, {1.1, 0.12}, under);
  mesh.tapered_box({-1.2, -1.15, 1.0}, {3.4, 1.15, 1.62}, {-1.0, -0.95}, {2.4, 0.95}, white(mesh));
  if (detail < 2) {
    for (const double side : {-1.0, 1.0})
      mesh.box({-0.6, side > 0 ? 0.8 : -1.12, 1.28}, {1.8, side > 0 ? 1.12 : -0.8, 1.46},
               glass(mesh));
    mesh.box({-4.9, -0.75, 0.9}, {-1.5, 0.75, 1.17}, dark);  // cockpit
    mesh.tapered_box({-1.9, -1.05, 1.5}, {-0.6, 1.05, 2.15}, {-1.7, -0.9}, {-1.2, 0.9},
                     mesh.finish(Material::Plain, {36, 52, 84}));
  }
  // Mast, boom with the furled sail, spreaders, stays.
  mesh.cone({1.35, 0.0, 1.1}, {1.35, 0.0, 17.6}, 0.10, 0.06, detail == 0 ? 8 : 4, metal, metal);
  mesh.bar({1.3, 0.0, 2.25}, {-3.6, 0.0, 2.25}, 0.11, metal);
  mesh.bar({1.1, 0.0, 2.42}, {-3.4, 0.0, 2.40}, 0.30, mesh.finish(Material::Plain, {210, 208, 198}),
           6);
  if (detail < 2) {
    for (const double z : {7.0, 12.2}) mesh.bar({1.3, -0.95, z}, {1.3, 0.95, z}, 0.05, metal);
    mesh.bar({5.75, 0.0, 1.4}, {1.45, 0.0, 17.3}, 0.09,
             mesh.finish(Material::Plain, {222, 220, 212}));  // furled jib
    mesh.bar({-5.8, 0.0, 1.2}, {1.25, 0.0, 17.5}, 0.02, dark, 3);
    for (const double side : {-1.0, 1.0}) {
      mesh.bar({1.0, side * 1.7, 1.1}, {1.3, side * 0.95, 7.0}, 0.02, dark, 3);
      mesh.bar({1.3, side * 0.95, 7.0}, {1.33, side * 0.05, 17.2}, 0.02, dark, 3);
    }
  }
}

void build_motor_yacht(ThingMesh& mesh, int detail, int variant) {
  static constexpr std::array<Color, 3> kHulls = {{{240, 240, 238}, {30, 44, 76}, {188, 192, 196}}};
  const FinishNumber hull = mesh.finish(Material::Paint, kHulls[static_cast<std::size_t>(variant)]);
  const FinishNumber under = mesh.finish(Material::Paint, {32, 34, 40});
  add_hull(mesh,
           {.length_m = 16.9,
            .beam_m = 4.87,
            .draught_m = 1.2,
            .deck_z_m = 1.55,
            .bow_rise_m = 0.9,
            .bow_m = 8.6,
            .stern_m = 4.0,
            .transom = 0.92,
            .rake_m = 1.6,
            .bottom = 0.2},
           detail, hull, under, teak(mesh));
  mesh.tapered_box({-4.2, -1.95, 1.4}, {4.2, 1.95, 2.25}, {-4.2, -1.85}, {3.4, 1.8}, white(mesh));
  mesh.tapered_box({-4.1, -1.86, 2.2}, {3.4, 1.8, 3.0}, {-4.1, -1.75}, {1.6, 1.55}, glass(mesh));
  mesh.tapered_box({-6.2, -1.95, 2.95}, {2.0, 1.95, 3.25}, {-6.2, -1.9}, {1.7, 1.75}, white(mesh));
  mesh.tapered_box({-2.2, -1.6, 3.2}, {1.2, 1.6, 3.75}, {-2.2, -1.55}, {0.4, 1.4}, white(mesh));
  if (detail < 2) {
    mesh.tapered_box({0.1, -1.35, 3.7}, {0.75, 1.35, 4.1}, {0.0, -1.25}, {0.2, 1.25}, glass(mesh));
    // Arch with radar.
    for (const double side : {-1.0, 1.0})
      mesh.bar({-3.0, side * 1.7, 3.2}, {-3.5, side * 1.4, 4.75}, 0.22, white(mesh));
    mesh.box({-3.75, -1.5, 4.65}, {-3.3, 1.5, 4.85}, white(mesh));
    mesh.cylinder({-3.5, 0.0, 4.8}, {-3.5, 0.0, 5.2}, 0.3, 8, white(mesh), white(mesh));
    mesh.box({-8.2, -2.0, 0.3}, {-7.4, 2.0, 0.62}, teak(mesh));
    for (const double side : {-1.0, 1.0})
      for (const double x : {-1.5, 0.6, 2.7})
        mesh.box({x, side > 0 ? 2.0 : -2.42, 0.95}, {x + 1.1, side > 0 ? 2.42 : -2.0, 1.2},
                 glass(mesh));
  }
}

void build_motor_boat(ThingMesh& mesh, int detail, int variant) {
  static constexpr std::array<Color, 3> kHulls = {{{238, 238, 236}, {168, 30, 34}, {30, 70, 120}}};
  const FinishNumber hull = mesh.finish(Material::Paint, kHulls[static_cast<std::size_t>(variant)]);
  const FinishNumber dark = mesh.finish(Material::Plain, {38, 40, 44});
  const FinishNumber seat = mesh.finish(Material::Plain, {206, 196, 176});
  add_hull(mesh,
           {.length_m = 6.5,
            .beam_m = 2.45,
            .draught_m = 0.4,
            .deck_z_m = 0.75,
            .bow_rise_m = 0.35,
            .bow_m = 3.3,
            .stern_m = 1.2,
            .transom = 0.92,
            .rake_m = 0.7,
            .bottom = 0.2},
           detail, hull, hull, white(mesh));
  mesh.box({-2.6, -0.85, 0.5}, {0.2, 0.85, 0.78}, dark);
  mesh.box({-2.3, -0.75, 0.7}, {-1.6, 0.75, 1.05}, seat);
  if (detail < 2) mesh.box({-0.9, 0.15, 0.7}, {-0.4, 0.7, 1.15}, seat);
  mesh.tapered_box({-0.1, -0.9, 0.72}, {0.75, 0.9, 1.30}, {-0.1, -0.75}, {0.1, 0.75}, glass(mesh));
  mesh.box({-3.55, -0.28, 0.35}, {-3.0, 0.28, 1.20}, dark);  // outboard engine
}

void build_fishing_boat(ThingMesh& mesh, int detail, int variant) {
  static constexpr std::array<Color, 3> kHulls = {{{30, 78, 128}, {176, 40, 34}, {44, 104, 70}}};
  const FinishNumber hull = mesh.finish(Material::Paint, kHulls[static_cast<std::size_t>(variant)]);
  const FinishNumber under = mesh.finish(Material::Paint, {122, 42, 34});
  const FinishNumber metal = mesh.finish(Material::Paint, {226, 160, 50});
  const FinishNumber dark = mesh.finish(Material::Metal, {60, 62, 64});
  const FinishNumber net = mesh.finish(Material::Plain, {42, 96, 86});
  add_hull(mesh,
           {.length_m = 23.9,
            .beam_m = 7.0,
            .draught_m = 2.9,
            .deck_z_m = 1.7,
            .bow_rise_m = 2.0,
            .bow_m = 10.0,
            .stern_m = 5.0,
            .transom = 0.85,
            .rake_m = 1.4,
            .bottom = 0.4},
           detail, hull, under, teak(mesh));
  mesh.box({0.6, -2.5, 1.5}, {5.6, 2.5, 4.2}, white(mesh));
  mesh.box({1.4, -2.0, 4.1}, {4.8, 2.0, 5.2}, white(mesh));
  mesh.tapered_box({1.3, -2.05, 5.15}, {4.9, 2.05, 6.0}, {1.3, -2.0}, {5.1, 2.0}, glass(mesh));
  mesh.box({1.0, -2.2, 5.95}, {5.4, 2.2, 6.3}, white(mesh));
  mesh.cone({3.0, 0.0, 6.2}, {3.0, 0.0, 11.5}, 0.16, 0.07, 6, metal, metal);
  // Gallows at the stern, boom, net drum.
  for (const double side : {-1.0, 1.0})
    mesh.bar({-10.2, side * 2.5, 1.6}, {-10.2, side * 2.1, 6.4}, 0.32, metal);
  mesh.bar({-10.2, -2.4, 6.3}, {-10.2, 2.4, 6.3}, 0.34, metal);
  mesh.bar({-0.2, 0.0, 3.6}, {-7.2, 0.0, 7.0}, 0.22, metal);
  mesh.cylinder({-7.2, -1.8, 2.9}, {-7.2, 1.8, 2.9}, 0.95, detail == 0 ? 12 : 6, net, dark);
  if (detail < 2) {
    mesh.box({-3.4, -1.4, 1.6}, {-1.6, 1.4, 2.7}, dark);
    mesh.bar({0.2, 0.0, 1.6}, {0.0, 0.0, 9.2}, 0.2, metal);
    mesh.bar({-10.2, 0.0, 6.3}, {2.9, 0.0, 11.2}, 0.04, dark, 3);
  }
}

void build_rowing_boat(ThingMesh& mesh, int detail, int variant) {
  static constexpr std::array<Color, 3> kHulls = {{{226, 222, 210}, {40, 92, 130}, {150, 60, 40}}};
  const FinishNumber hull = mesh.finish(Material::Paint, kHulls[static_cast<std::size_t>(variant)]);
  const FinishNumber wood = teak(mesh);
  const FinishNumber dark = mesh.finish(Material::Planks, {96, 74, 52});
  add_hull(mesh,
           {.length_m = 4.2,
            .beam_m = 1.5,
            .draught_m = 0.18,
            .deck_z_m = 0.38,
            .bow_rise_m = 0.16,
            .bow_m = 2.0,
            .stern_m = 1.0,
            .transom = 0.7,
            .rake_m = 0.3,
            .bottom = 0.4},
           detail, hull, hull, hull);
  mesh.prism({{-1.9, -0.42},
              {0.4, -0.62},
              {1.3, -0.36},
              {1.75, 0.0},
              {1.3, 0.36},
              {0.4, 0.62},
              {-1.9, 0.42}},
             0.2, 0.392, dark, dark);
  for (const double x : {-1.5, -0.3, 0.8})
    mesh.box({x - 0.14, -0.48, 0.3}, {x + 0.14, 0.48, 0.43}, wood);
}

/// A floating stage of a marina: 12 m x 2.4 m, its top 0.5 m above the water.
void build_pontoon(ThingMesh& mesh, int detail, int) {
  const FinishNumber deck = mesh.finish(Material::Planks, {150, 134, 112});
  const FinishNumber side = mesh.finish(Material::Concrete, {140, 140, 136});
  const FinishNumber pile = mesh.finish(Material::Metal, {92, 84, 78});
  mesh.loft({ring_at(-0.5, rectangle({-6.0, -1.14}, {6.0, 1.14})),
             ring_at(0.44, rectangle({-6.0, -1.14}, {6.0, 1.14}))},
            side);
  mesh.box({-6.0, -1.2, 0.36}, {6.0, 1.2, 0.5}, deck);
  if (detail < 2)
    for (const double y : {-0.9, 0.9})
      mesh.cylinder({-4.9, y, -4.0}, {-4.9, y, 2.6}, 0.16, detail == 0 ? 10 : 4, pile, pile);
  if (detail == 0)
    for (const double x : {-3.0, 3.0}) {
      const FinishNumber post = mesh.finish(Material::Paint, {222, 224, 226});
      mesh.box({x - 0.12, 0.7, 0.42}, {x + 0.12, 0.94, 1.45}, post);
    }
}

ThingInfo boat(std::string name, const Vector3d& size_m, std::string_view source, int num_variants,
               std::vector<int> levels, void (*build)(ThingMesh&, int, int),
               SemanticClass semantic_class = SemanticClass::Boat) {
  return {.name = std::move(name),
          .family = {},
          .semantic_class = semantic_class,
          .stance = Stance::Floats,
          .size_m = size_m,
          .source = source,
          .coarsest_levels = std::move(levels),
          .num_variants = num_variants,
          .build = build};
}

}  // namespace

std::vector<ThingInfo> boats();
std::vector<ThingInfo> boats() {
  return {
      boat("sailing_yacht", {11.99, 3.91, 17.6},
           "Bavaria Cruiser 40: hull of 11.99 m, 3.91 m across; mast 17.6 m above the water", 3,
           {0, 1, 3}, build_sailing_yacht),
      boat("motor_yacht", {16.9, 4.87, 5.2},
           "motor yachts of 55 feet: 16.9 x 4.87 m, 1.2 m draught (Princess F55 class)", 3,
           {0, 1, 3}, build_motor_yacht),
      boat("motor_boat", {6.8, 2.45, 1.30},
           "open boats of 6.5 m, with an outboard engine: 2.45 m across", 3, {0, 1, 2},
           build_motor_boat),
      boat("fishing_boat", {23.9, 7.0, 11.5},
           "trawlers below 24 m, the limit of EU fleet segments: 23.9 x 7 m", 3, {0, 1, 3},
           build_fishing_boat),
      boat("rowing_boat", {4.2, 1.5, 0.54}, "dinghies of 14 feet: 4.2 x 1.5 m", 3, {0, 1, 2},
           build_rowing_boat),
      boat("pontoon", {12.0, 2.4, 2.6}, "concrete pontoons of marinas: 12 x 2.4 m, 0.5 m freeboard",
           1, {0, 1, 3}, build_pontoon, SemanticClass::Pier)};
}

}  // namespace terracast::tiler
