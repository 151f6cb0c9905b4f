#include <cmath>
#include <numbers>

#include "tiler/objects/things.h"

// Towers of masonry and concrete.
namespace terracast::tiler {
namespace {

using core::SemanticClass;
using Eigen::Vector3d;
using world::Material;

void build_control_tower(ThingMesh& mesh, int detail) {
  const FinishNumber concrete = mesh.finish(Material::Concrete, {206, 204, 198});
  const FinishNumber white = mesh.finish(Material::Paint, {234, 234, 232});
  const FinishNumber glass = mesh.finish(Material::Glass, {52, 84, 92});
  const FinishNumber dark = mesh.finish(Material::Metal, {70, 72, 76});
  const int sides = detail == 0 ? 16 : 8;
  mesh.box({-8.0, -6.0, -1.0}, {8.0, 6.0, 6.5}, white);
  if (detail < 2) {
    for (const double y : {-6.04, 5.9}) mesh.box({-7.4, y, 3.6}, {7.4, y + 0.14, 5.2}, glass);
    mesh.box({-8.2, -6.2, 6.4}, {8.2, 6.2, 6.8}, concrete);
  }
  mesh.lathe({0.0, 0.0}, {{3.2, -1.0}, {3.0, 28.0}}, sides, [&](std::size_t) { return concrete; });
  // Bowl, balcony, cab whose panes lean outward, roof, mast.
  mesh.lathe({0.0, 0.0}, {{2.8, 26.5}, {5.0, 29.5}, {5.4, 32.0}, {6.0, 32.1}, {6.0, 32.6}}, sides,
             [&](std::size_t k) { return k == 1 ? white : concrete; });
  mesh.lathe({0.0, 0.0}, {{4.2, 32.5}, {4.2, 33.3}, {5.0, 36.4}}, sides,
             [&](std::size_t k) { return k == 0 ? white : glass; });
  mesh.lathe({0.0, 0.0}, {{5.3, 36.3}, {5.4, 36.9}, {3.0, 37.5}}, sides,
             [&](std::size_t) { return white; });
  mesh.bar({0.0, 0.0, 37.2}, {0.0, 0.0, 42.0}, 0.16, dark, 6);
  if (detail == 0) {
    for (int k = 0; k < 16; ++k) {  // rail
      const double turn = 2.0 * std::numbers::pi * (k + 0.5) / 16.0;
      mesh.bar({5.9 * std::cos(turn), 5.9 * std::sin(turn), 32.5},
               {5.9 * std::cos(turn), 5.9 * std::sin(turn), 33.7}, 0.06, dark, 3);
      const double a = 2.0 * std::numbers::pi * k / 16.0;  // frames between panes
      mesh.bar({4.22 * std::cos(a), 4.22 * std::sin(a), 33.2},
               {5.04 * std::cos(a), 5.04 * std::sin(a), 36.4}, 0.12, dark, 4);
    }
    mesh.cylinder({1.4, 0.0, 37.2}, {1.4, 0.0, 38.6}, 0.5, 10, white, white);
  }
}

void build_lighthouse(ThingMesh& mesh, int detail, int variant) {
  const FinishNumber white = mesh.finish(Material::Plaster, {236, 234, 228});
  const FinishNumber red = variant == 0 ? mesh.finish(Material::Plaster, {180, 36, 32}) : white;
  const FinishNumber iron = mesh.finish(Material::Metal, {44, 48, 52});
  const FinishNumber glass = mesh.finish(Material::Glass, {150, 168, 160});
  const FinishNumber lamp = mesh.finish(Material::Lamp, {255, 244, 206});
  const FinishNumber stone = mesh.finish(Material::StoneWall, {150, 144, 134});
  const int sides = round_sides(20, detail);
  mesh.lathe({0.0, 0.0}, {{5.0, -1.5}, {4.9, 1.2}}, sides, [&](std::size_t) { return stone; });
  mesh.lathe({0.0, 0.0},
             {{3.6, 1.0}, {3.36, 5.0}, {3.12, 9.0}, {2.88, 13.0}, {2.64, 17.0}, {2.4, 21.0}}, sides,
             [&](std::size_t k) { return k % 2 == 1 ? red : white; });
  mesh.lathe({0.0, 0.0}, {{2.3, 20.6}, {3.2, 21.4}, {3.2, 21.7}}, sides,
             [&](std::size_t) { return stone; });
  if (detail == 0)
    for (int k = 0; k < 14; ++k) {
      const double a = 2.0 * std::numbers::pi * k / 14.0;
      const double b = 2.0 * std::numbers::pi * (k + 1) / 14.0;
      mesh.bar({3.1 * std::cos(a), 3.1 * std::sin(a), 21.6},
               {3.1 * std::cos(a), 3.1 * std::sin(a), 22.75}, 0.06, iron, 3);
      mesh.bar({3.1 * std::cos(a), 3.1 * std::sin(a), 22.7},
               {3.1 * std::cos(b), 3.1 * std::sin(b), 22.7}, 0.06, iron, 3);
    }
  mesh.lathe({0.0, 0.0}, {{1.7, 21.6}, {1.7, 22.6}, {1.75, 25.4}}, sides,
             [&](std::size_t k) { return k == 0 ? red : glass; });
  mesh.lathe({0.0, 0.0}, {{0.8, 22.4}, {0.8, 24.8}}, 8, [&](std::size_t) { return lamp; });
  mesh.lathe({0.0, 0.0}, {{2.0, 25.3}, {1.9, 25.7}, {0.8, 27.2}, {0.15, 27.6}, {0.15, 28.0}}, sides,
             [&](std::size_t) { return variant == 0 ? red : iron; });
  // Door and windows of the stairs.
  if (detail < 2) {
    const FinishNumber door = mesh.finish(Material::Planks, {58, 66, 60});
    mesh.box({3.0, -0.6, 1.1}, {3.66, 0.6, 3.4}, door);
    for (const double z : {7.2, 11.2, 15.2, 18.8})
      mesh.box({2.0, -0.35, z}, {3.62 - 0.06 * z + 0.03, 0.35, z + 1.1}, iron);
  }
}

/// A ball on a flared stem, as North American water towers are.
void build_water_tower(ThingMesh& mesh, int detail) {
  const FinishNumber paint = mesh.finish(Material::Paint, {206, 218, 226});
  Outline profile = {{5.2, -1.0}, {4.8, 0.8}, {2.6, 5.0}, {2.3, 10.0}, {2.3, 21.0}, {3.4, 23.6}};
  const int num_rings = detail == 0 ? 12 : 6;
  for (int k = 1; k <= num_rings; ++k) {
    const double turn = -1.10 + (std::numbers::pi / 2.0 + 1.10) * k / num_rings;
    profile.emplace_back(std::max(8.2 * std::cos(turn), 0.6), 30.0 + 6.6 * std::sin(turn));
  }
  profile.emplace_back(0.6, 37.4);
  mesh.lathe({0.0, 0.0}, profile, round_sides(28, detail), [&](std::size_t) { return paint; });
}

/// A concrete stem with a wide cup, as European ones are.
void build_water_tower_cup(ThingMesh& mesh, int detail) {
  const FinishNumber concrete = mesh.finish(Material::Concrete, {190, 186, 176});
  const FinishNumber dark = mesh.finish(Material::Metal, {74, 78, 82});
  const int sides = round_sides(28, detail);
  mesh.lathe({0.0, 0.0},
             {{3.6, -1.0},
              {3.0, 3.0},
              {2.8, 22.0},
              {3.4, 24.0},
              {9.0, 31.0},
              {9.2, 32.2},
              {9.2, 34.0},
              {8.8, 34.2},
              {1.2, 36.0}},
             sides, [&](std::size_t) { return concrete; });
  mesh.cylinder({0.0, 0.0, 35.6}, {0.0, 0.0, 37.4}, 1.0, detail == 0 ? 12 : 6, dark, dark);
  if (detail < 2) mesh.box({2.6, -0.7, -0.5}, {3.42, 0.7, 2.3}, dark);
}

/// A chimney of works with bands at its top.
void build_chimney(ThingMesh& mesh, int detail) {
  const FinishNumber concrete = mesh.finish(Material::Concrete, {178, 174, 166});
  const FinishNumber red = mesh.finish(Material::Paint, {178, 46, 38});
  const FinishNumber white = mesh.finish(Material::Paint, {226, 224, 218});
  const FinishNumber dark = mesh.finish(Material::Plain, {30, 28, 27});
  mesh.lathe({0.0, 0.0},
             {{4.1, -1.0},
              {4.0, 0.5},
              {3.0, 55.0},
              {2.9, 60.0},
              {2.8, 65.0},
              {2.7, 70.0},
              {2.6, 75.0},
              {2.5, 80.0}},
             round_sides(20, detail), [&](std::size_t k) {
               return k < 2 ? concrete : k % 2 == 0 ? red : white;
             });
  mesh.cylinder({0.0, 0.0, 79.0}, {0.0, 0.0, 80.03}, 2.1, detail == 0 ? 16 : 6, dark, dark);
}

/// A crane of building sites.
void build_tower_crane(ThingMesh& mesh, int detail) {
  const FinishNumber yellow = mesh.finish(Material::Paint, {226, 172, 36});
  const FinishNumber grey = mesh.finish(Material::Concrete, {150, 150, 146});
  const FinishNumber glass = mesh.finish(Material::Glass, {60, 76, 84});
  const int num_panels = detail == 0 ? 18 : 8;
  if (detail >= 2) {
    mesh.box({-0.75, -0.75, -0.5}, {0.75, 0.75, 45.0}, yellow);
  } else {
    for (int k = 0; k < 4; ++k) {
      const double x = k % 2 == 0 ? -0.8 : 0.8;
      const double y = k < 2 ? -0.8 : 0.8;
      mesh.bar({x, y, -0.5}, {x, y, 45.0}, 0.18, yellow, 4);
    }
    for (int k = 0; k < num_panels; ++k) {
      const double z = 45.0 * k / num_panels;
      const double up = 45.0 * (k + 1) / num_panels;
      const double s = k % 2 == 0 ? 0.8 : -0.8;
      mesh.bar({-0.8, -s, z}, {-0.8, s, up}, 0.09, yellow, 3);
      mesh.bar({0.8, s, z}, {0.8, -s, up}, 0.09, yellow, 3);
      mesh.bar({-s, -0.8, z}, {s, -0.8, up}, 0.09, yellow, 3);
      mesh.bar({s, 0.8, z}, {-s, 0.8, up}, 0.09, yellow, 3);
    }
  }
  mesh.box({-3.0, -3.0, -1.0}, {3.0, 3.0, 0.6}, grey);
  // Jib, counter jib with its weights, top, cab, ties, hook.
  const double z = 46.2;
  mesh.bar({0.0, -0.6, z - 0.6}, {50.0, -0.6, z - 0.6}, 0.20, yellow, 4);
  mesh.bar({0.0, 0.6, z - 0.6}, {50.0, 0.6, z - 0.6}, 0.20, yellow, 4);
  mesh.bar({0.0, 0.0, z + 0.9}, {50.0, 0.0, z + 0.3}, 0.20, yellow, 4);
  if (detail < 2) {
    const int num_ties = detail == 0 ? 20 : 10;
    for (int k = 0; k < num_ties; ++k) {
      const double from = 50.0 * k / num_ties;
      const double to = 50.0 * (k + 0.5) / num_ties;
      const double end = 50.0 * (k + 1) / num_ties;
      for (const double y : {-0.6, 0.6}) {
        mesh.bar({from, y, z - 0.6}, {to, 0.0, z + 0.8 - 0.012 * to}, 0.08, yellow, 3);
        if (detail == 0)
          mesh.bar({to, 0.0, z + 0.8 - 0.012 * to}, {end, y, z - 0.6}, 0.08, yellow, 3);
      }
    }
    mesh.bar({0.0, 0.0, 52.8}, {34.0, 0.0, z + 0.5}, 0.08, yellow, 3);
    mesh.bar({0.0, 0.0, 52.8}, {-14.5, 0.0, z - 0.3}, 0.08, yellow, 3);
    mesh.box({0.9, -1.9, 44.6}, {2.7, -0.7, 46.8}, glass);
    mesh.bar({30.0, 0.0, z - 0.6}, {30.0, 0.0, 18.0}, 0.05, grey, 3);
    mesh.box({29.6, -0.3, 16.8}, {30.4, 0.3, 18.1}, yellow);
    mesh.box({29.0, -0.7, z - 0.95}, {31.0, 0.7, z - 0.62}, grey);
  }
  mesh.box({-15.0, -0.7, z - 0.8}, {-0.2, 0.7, z - 0.4}, yellow);
  mesh.box({-14.6, -0.95, z - 3.0}, {-11.8, 0.95, z - 0.2}, grey);
  mesh.tapered_box({-0.9, -0.9, 44.8}, {0.9, 0.9, 53.0}, {-0.15, -0.15}, {0.15, 0.15}, yellow);
}

ThingInfo tower(std::string name, SemanticClass semantic_class, const Vector3d& size_m,
                std::string_view source, int num_variants,
                std::function<void(ThingMesh&, int, int)> build) {
  return {.name = std::move(name),
          .family = {},
          .semantic_class = semantic_class,
          .stance = Stance::Rooted,
          .size_m = size_m,
          .source = source,
          .coarsest_levels = {0, 1, 4},
          .num_variants = num_variants,
          .build = std::move(build)};
}

}  // namespace

std::vector<ThingInfo> towers();
std::vector<ThingInfo> towers() {
  return {tower("control_tower", SemanticClass::Building, {16.4, 12.4, 42.0},
                "control towers of regional airports: cab's floor at 33 m", 1,
                [](ThingMesh& m, int d, int) { build_control_tower(m, d); }),
          tower("lighthouse", SemanticClass::Building, {10.0, 10.0, 28.0},
                "Westerheversand class: towers of 28 to 40 m, 7 m across at the foot", 2,
                [](ThingMesh& m, int d, int v) { build_lighthouse(m, d, v); }),
          tower("water_tower", SemanticClass::Building, {16.4, 16.4, 37.4},
                "AWWA D100 pedesphere of 250 000 gallons: 37 m high, ball of 16 m", 1,
                [](ThingMesh& m, int d, int) { build_water_tower(m, d); }),
          tower("water_tower_cup", SemanticClass::Building, {18.4, 18.4, 37.4},
                "concrete water towers of 1000 m3: cup of 18 m, 37 m high", 1,
                [](ThingMesh& m, int d, int) { build_water_tower_cup(m, d); }),
          tower("chimney", SemanticClass::Building, {8.2, 8.2, 80.03},
                "industrial chimneys of 80 m, 5 m across at the top (EN 13084-1 bands)", 1,
                [](ThingMesh& m, int d, int) { build_chimney(m, d); }),
          tower("tower_crane", SemanticClass::Crane, {65.1, 6.0, 53.0},
                "Liebherr EC-B class: jib of 50 m, hook at 45 m", 1,
                [](ThingMesh& m, int d, int) { build_tower_crane(m, d); })};
}

}  // namespace terracast::tiler
