#include <cmath>

#include "tiler/objects/things.h"

// Halls for places of which only a point is known.
namespace terracast::tiler {
namespace {

using core::SemanticClass;
using Eigen::Vector2d;
using Eigen::Vector3d;
using world::Material;

/// A round roof over doors in front (x).
void build_hangar(ThingMesh& mesh, double length, double width, double height, int detail,
                  int variant) {
  static constexpr std::array<Color, 3> kWalls = {
      {{206, 208, 206}, {168, 180, 186}, {196, 188, 168}}};
  const FinishNumber wall =
      mesh.finish(Material::SheetMetal, kWalls[static_cast<std::size_t>(variant)]);
  const FinishNumber roof = mesh.finish(Material::MetalRoof, {172, 178, 182});
  const FinishNumber door = mesh.finish(Material::SheetMetal, {96, 116, 136});
  const FinishNumber frame = mesh.finish(Material::Metal, {70, 74, 80});
  const FinishNumber glass = mesh.finish(Material::Glass, {70, 86, 94});
  const double half = 0.5 * width;
  const double eave = 0.72 * height;
  Outline arch = {{-half, -1.0}, {half, -1.0}, {half, eave}};
  const int num = detail == 0 ? 14 : detail == 1 ? 8 : 4;
  for (int k = 1; k < num; ++k) {
    const double t = 1.0 - 2.0 * k / num;
    arch.emplace_back(half * t, eave + (height - eave) * (1.0 - t * t));
  }
  arch.emplace_back(-half, eave);
  const double front = 0.5 * length;
  mesh.loft(
      {ring_across(-front, arch), ring_across(front - 0.1, arch)},
      [&](std::size_t, std::size_t edge) {
        return edge >= 2 && edge + 1 < arch.size() ? roof : wall;
      },
      wall, wall);
  // Sliding doors in leaves, a beam above them.
  const int num_leaves = 6;
  const double door_half = 0.84 * half;
  const double leaf = 2.0 * door_half / num_leaves;
  for (int k = 0; k < num_leaves; ++k) {
    const double y = -door_half + k * leaf;
    const double out = k % 2 == 0 ? 0.0 : -0.04;
    if (detail == 0 || k == 0)
      mesh.box({front - 0.4, y + 0.02, -0.5},
               {front + out, detail == 0 ? y + leaf - 0.02 : door_half, 0.88 * eave}, door);
    if (detail == 0)
      mesh.box({front - 0.3, y + 0.2 * leaf, 0.62 * eave},
               {front + out + 0.02 - (k % 2 == 0 ? 0.02 : 0.0), y + 0.8 * leaf, 0.76 * eave},
               glass);
  }
  mesh.box({front - 0.5, -door_half - 0.4, 0.88 * eave - 0.05},
           {front - 0.02, door_half + 0.4, 0.94 * eave}, frame);
}

void build_warehouse(ThingMesh& mesh, int detail, int variant) {
  static constexpr std::array<Color, 3> kWalls = {
      {{214, 216, 214}, {120, 142, 160}, {188, 192, 188}}};
  const FinishNumber wall =
      mesh.finish(Material::SheetMetal, kWalls[static_cast<std::size_t>(variant)]);
  const FinishNumber band = mesh.finish(Material::Paint, {44, 76, 120});
  const FinishNumber roof = mesh.finish(Material::FlatRoof, {160, 162, 160});
  const FinishNumber door = mesh.finish(Material::SheetMetal, {232, 232, 228});
  const FinishNumber dark = mesh.finish(Material::Rubber, {40, 40, 42});
  const FinishNumber glass = mesh.finish(Material::Glass, {120, 138, 146});
  // Walls with a parapet: the roof lies below its top.
  mesh.loft(
      {ring_at(-1.0, rectangle({-40.0, -25.0}, {40.0, 25.0})),
       ring_at(10.4, rectangle({-40.0, -25.0}, {40.0, 25.0})),
       ring_at(11.0, rectangle({-40.0, -25.0}, {40.0, 25.0})),
       ring_at(11.0, rectangle({-39.7, -24.7}, {39.7, 24.7})),
       ring_at(10.5, rectangle({-39.7, -24.7}, {39.7, 24.7}))},
      [&](std::size_t r, std::size_t) { return r == 1 ? band : wall; }, wall, roof);
  if (detail >= 2) return;
  for (int k = 0; k < 14; ++k) {  // docks along one side
    const double x = -36.0 + 5.4 * k;
    mesh.box({x - 1.75, 24.8, 0.9}, {x + 1.75, 25.35, 4.6}, dark);
    mesh.box({x - 1.25, 24.9, 1.15}, {x + 1.25, 25.40, 4.2}, door);
  }
  for (int row = 0; row < 4; ++row)  // skylights
    for (int k = 0; k < 8; ++k)
      mesh.tapered_box(
          {-36.0 + 9.4 * k, -19.0 + 10.8 * row, 10.3}, {-31.0 + 9.4 * k, -17.0 + 10.8 * row, 10.95},
          {-35.7 + 9.4 * k, -18.7 + 10.8 * row}, {-31.3 + 9.4 * k, -17.3 + 10.8 * row}, glass);
  // Offices at a corner.
  mesh.box({25.0, -29.0, -1.0}, {39.0, -24.5, 7.2}, wall);
  for (const double z : {1.0, 4.4})
    mesh.box({25.6, -29.03, z}, {38.4, -28.5, z + 1.6}, mesh.finish(Material::Glass, {50, 62, 72}));
}

ThingInfo hall(std::string name, SemanticClass semantic_class, const Vector3d& size_m,
               std::string_view source, std::function<void(ThingMesh&, int, int)> build) {
  return {.name = std::move(name),
          .family = {},
          .semantic_class = semantic_class,
          .stance = Stance::Rooted,
          .size_m = size_m,
          .source = source,
          .coarsest_levels = {0, 1, 5},
          .num_variants = 3,
          .build = std::move(build)};
}

}  // namespace

std::vector<ThingInfo> halls();
std::vector<ThingInfo> halls() {
  return {hall("hangar", SemanticClass::Hangar, {45.0, 42.0, 17.0},
               "bays for an aircraft of 36 m span and 12.6 m height (ICAO code C) with room of 3 m",
               [](ThingMesh& m, int d, int v) { build_hangar(m, 45.0, 42.0, 17.0, d, v); }),
          hall("hangar_small", SemanticClass::Hangar, {16.0, 16.0, 6.0},
               "hangars of flying clubs: 16 x 16 m for wings of 11 m",
               [](ThingMesh& m, int d, int v) { build_hangar(m, 16.0, 16.0, 6.0, d, v); }),
          hall("warehouse", SemanticClass::Warehouse, {80.0, 54.4, 11.0},
               "logistics halls: 80 x 50 m, 10 m clear height, docks 5.4 m apart",
               [](ThingMesh& m, int d, int v) { build_warehouse(m, d, v); })};
}

}  // namespace terracast::tiler
