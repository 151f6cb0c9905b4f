#include <cmath>
#include <numbers>

#include "tiler/objects/lattice.h"

// What stands on a post: street lamps, radio masts.
namespace terracast::tiler {
namespace {

using core::SemanticClass;
using Eigen::Vector3d;
using world::Material;

/// The arm reaches forward, over the road.
void build_street_lamp(ThingMesh& mesh, int detail) {
  const FinishNumber steel = mesh.finish(Material::Metal, {128, 132, 134});
  const FinishNumber lamp = mesh.finish(Material::Lamp, {250, 236, 196});
  const int sides = detail == 0 ? 8 : 4;
  mesh.cone({0.0, 0.0, -0.8}, {0.0, 0.0, 7.75}, 0.085, 0.045, sides, steel, steel);
  if (detail == 0) mesh.cylinder({0.0, 0.0, -0.5}, {0.0, 0.0, 1.1}, 0.10, 10, steel, steel);
  mesh.bar({0.0, 0.0, 7.70}, {0.25, 0.0, 7.90}, 0.07, steel, sides);
  mesh.bar({0.22, 0.0, 7.88}, {1.25, 0.0, 7.93}, 0.07, steel, sides);
  mesh.tapered_box({1.05, -0.15, 7.86}, {1.80, 0.15, 8.0}, {1.1, -0.09}, {1.75, 0.09}, steel);
  if (detail == 0) mesh.box({1.18, -0.12, 7.84}, {1.72, 0.12, 7.88}, lamp);
}

void build_park_lamp(ThingMesh& mesh, int detail) {
  const FinishNumber post = mesh.finish(Material::Paint, {40, 46, 44});
  const FinishNumber lamp = mesh.finish(Material::Lamp, {250, 240, 210});
  const int sides = detail == 0 ? 10 : 4;
  mesh.cone({0.0, 0.0, -0.6}, {0.0, 0.0, 3.4}, 0.065, 0.045, sides, post, post);
  mesh.lathe({0.0, 0.0}, {{0.10, 3.36}, {0.22, 3.62}, {0.22, 3.82}}, sides,
             [&](std::size_t) { return lamp; });
  mesh.lathe({0.0, 0.0}, {{0.30, 3.80}, {0.26, 3.88}, {0.06, 4.0}}, sides,
             [&](std::size_t) { return post; });
}

/// A lattice mast with red and white bands, three sets of stays and panels of antennas.
void build_radio_mast(ThingMesh& mesh, int detail) {
  const FinishNumber red = mesh.finish(Material::Paint, {186, 40, 32});
  const FinishNumber white = mesh.finish(Material::Paint, {232, 230, 224});
  const FinishNumber grey = mesh.finish(Material::Metal, {150, 154, 158});
  std::vector<LatticeLevel> levels = {{-1.0, 0.5}};
  const int num_levels = detail == 0 ? 28 : 14;
  for (int k = 0; k <= num_levels; ++k) levels.push_back({56.0 * k / num_levels, 0.5});
  if (detail >= 2) {
    std::vector<Ring> bands = {ring_at(-1.0, rectangle({-0.42, -0.42}, {0.42, 0.42}))};
    for (int band = 1; band <= 7; ++band)
      bands.push_back(ring_at(8.0 * band, rectangle({-0.42, -0.42}, {0.42, 0.42})));
    mesh.loft(
        bands, [&](std::size_t band, std::size_t) { return band % 2 == 0 ? red : white; }, red,
        red);
  } else {
    add_lattice(mesh, levels, 0.10, 0.045, detail,
                [&](std::size_t i) { return (i * 7 / levels.size()) % 2 == 0 ? red : white; });
  }
  mesh.bar({0.0, 0.0, 55.5}, {0.0, 0.0, 60.0}, 0.12, white, 6);
  for (int k = 0; k < 3; ++k) {
    const double turn = 2.0 * std::numbers::pi * k / 3.0 + 0.5;
    const Vector3d out(std::cos(turn), std::sin(turn), 0.0);
    if (detail < 2) {
      const Vector3d panel = 0.9 * out + Vector3d(0.0, 0.0, 50.0);
      mesh.bar(panel, panel + Vector3d(0.0, 0.0, 2.4), 0.28, white);
      mesh.bar(panel + Vector3d(0, 0, 1.2), 0.4 * out + Vector3d(0, 0, 51.2), 0.08, grey, 3);
      for (const double z : {26.0, 48.0})
        mesh.bar(0.5 * out + Vector3d(0.0, 0.0, z), 26.0 * out + Vector3d(0.0, 0.0, -0.5), 0.035,
                 grey, 3);
    }
    mesh.box(26.0 * out - Vector3d(0.6, 0.6, 1.0), 26.0 * out + Vector3d(0.6, 0.6, 0.4), grey);
  }
  if (detail < 2)
    mesh.cylinder({0.35, 0.4, 38.0}, {0.35, 0.95, 38.0}, 0.9, detail == 0 ? 14 : 8, white,
                  white);  // dish
}

/// A free-standing tower, as mobile networks have them.
void build_lattice_tower(ThingMesh& mesh, int detail) {
  const FinishNumber grey = mesh.finish(Material::Metal, {152, 156, 158});
  const FinishNumber white = mesh.finish(Material::Paint, {230, 230, 226});
  std::vector<LatticeLevel> levels = {{-1.0, 2.08}};
  const int num_levels = detail == 0 ? 12 : 6;
  for (int k = 0; k <= num_levels; ++k)
    levels.push_back({36.0 * k / num_levels, 2.0 - 1.5 * k / num_levels});
  add_lattice(mesh, levels, 0.16, 0.08, detail, [&](std::size_t) { return grey; });
  mesh.bar({0.0, 0.0, 35.5}, {0.0, 0.0, 40.0}, 0.12, grey, 6);
  mesh.box({-1.1, -1.1, 32.0}, {1.1, 1.1, 32.12}, grey);
  for (int k = 0; k < 3; ++k) {
    const double turn = 2.0 * std::numbers::pi * k / 3.0;
    const Vector3d at(1.3 * std::cos(turn), 1.3 * std::sin(turn), 33.0);
    mesh.bar(at, at + Vector3d(0.0, 0.0, 2.2), 0.3, white);
    if (detail < 2) mesh.bar(at + Vector3d(0.0, 0.0, 1.1), {0.0, 0.0, 34.1}, 0.08, grey, 3);
  }
  if (detail < 2)
    mesh.cylinder({0.9, 0.0, 28.0}, {1.3, 0.0, 28.0}, 0.6, detail == 0 ? 12 : 6, white, white);
}

ThingInfo mast(std::string name, SemanticClass semantic_class, const Vector3d& size_m,
               std::string_view source, std::vector<int> levels, void (*build)(ThingMesh&, int)) {
  return {.name = std::move(name),
          .family = {},
          .semantic_class = semantic_class,
          .stance = Stance::Rooted,
          .size_m = size_m,
          .source = source,
          .coarsest_levels = std::move(levels),
          .num_variants = 1,
          .build = [build](ThingMesh& m, int d, int) { build(m, d); }};
}

}  // namespace

std::vector<ThingInfo> masts();
std::vector<ThingInfo> masts() {
  return {mast("street_lamp", SemanticClass::StreetLamp, {1.90, 0.30, 8.0},
               "EN 40-2: column of 8 m, bracket of 1.5 m", {0, 1, 2}, build_street_lamp),
          mast("park_lamp", SemanticClass::StreetLamp, {0.60, 0.57, 4.0},
               "EN 40-2: post top column of 4 m", {0, 1, 2}, build_park_lamp),
          mast("radio_mast", SemanticClass::Pylon, {46.22, 40.72, 60.0},
               "stayed mast of 60 m, stays 26 m out (proportions of EN 1993-3-1's examples)",
               {0, 1, 4}, build_radio_mast),
          mast("lattice_tower", SemanticClass::Pylon, {4.32, 4.32, 40.0},
               "towers of mobile networks, 30 to 50 m: 40 m", {0, 1, 3}, build_lattice_tower)};
}

}  // namespace terracast::tiler
