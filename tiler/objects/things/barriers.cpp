#include <array>
#include <cmath>

#include "core/random.h"
#include "tiler/objects/things.h"

// Pieces of what stands between plots, 3 m long: hedges, fences, walls.
namespace terracast::tiler {
namespace {

using core::SemanticClass;
using Eigen::Vector2d;
using Eigen::Vector3d;
using world::Material;

constexpr double kHalf_m = 1.5;
constexpr double kRoot_m = -0.6;

/// Round above, cut or left to grow: twigs stand in by up to `uneven_m`.
void build_hedge(ThingMesh& mesh, const Vector3d& size, double uneven_m, const Color& color,
                 int detail) {
  const FinishNumber leaves = mesh.finish(Material::Leaves, color);
  const double w = 0.5 * size.y();
  const double h = size.z();
  const Outline section = {{-0.86 * w, kRoot_m},  {0.86 * w, kRoot_m},  {0.94 * w, 0.25 * h},
                           {w, 0.5 * h},          {0.96 * w, 0.75 * h}, {0.80 * w, 0.93 * h},
                           {0.35 * w, h},         {-0.35 * w, h},       {-0.80 * w, 0.93 * h},
                           {-0.96 * w, 0.75 * h}, {-w, 0.5 * h},        {-0.94 * w, 0.25 * h}};
  if (detail >= 2) {
    mesh.box({-kHalf_m, -0.9 * w, kRoot_m}, {kHalf_m, 0.9 * w, 0.96 * h}, leaves);
    return;
  }
  const int num_rings = detail == 0 ? 12 : 4;
  std::vector<Ring> rings;
  for (int i = 0; i <= num_rings; ++i) {
    Outline ring = section;
    // The ends are as they are drawn, so that pieces go on in each other.
    if (i > 0 && i < num_rings)
      for (std::size_t k = 2; k < ring.size(); ++k) {
        const double in = core::random_unit(0x6865646765ULL, static_cast<std::uint64_t>(i), k);
        // Some twigs are as long as the hedge is wide.
        const double shrink = in < 0.25 ? 0.0 : in * uneven_m / w;
        ring[k] = {ring[k].x() * (1.0 - shrink), ring[k].y() * (1.0 - 0.4 * shrink)};
      }
    rings.push_back(ring_across(-kHalf_m + 2.0 * kHalf_m * i / num_rings, ring));
  }
  mesh.loft(rings, leaves);
}

/// Upright boards on two rails between posts.
void build_fence(ThingMesh& mesh, const Color& color, int detail) {
  const FinishNumber wood = mesh.finish(Material::Planks, color);
  if (detail >= 2) {
    mesh.box({-kHalf_m, -0.02, -0.05}, {kHalf_m, 0.02, 0.92}, wood);
    return;
  }
  if (detail == 1) {
    mesh.box({-kHalf_m, -0.02, 0.10}, {kHalf_m, 0.02, 1.05}, wood);
    for (const double x : {-1.44, 0.06})
      mesh.box({x, -0.05, kRoot_m}, {x + 0.09, 0.045, 1.12}, wood);
    return;
  }
  for (const double x : {-1.44, 0.06}) mesh.box({x, -0.05, kRoot_m}, {x + 0.09, 0.045, 1.12}, wood);
  for (const double z : {0.28, 0.82})
    mesh.box({-kHalf_m, -0.018, z}, {kHalf_m, 0.026, z + 0.09}, wood);
  constexpr int kBoards = 20;
  for (int k = 0; k < kBoards; ++k) {
    const double x = -kHalf_m + 0.022 + 0.15 * k;
    const double high = 1.06 + 0.012 * ((k * 7) % 5);
    mesh.box({x, 0.02, 0.08}, {x + 0.106, 0.05, high}, wood);
  }
}

/// Plastered, under slabs.
void build_wall(ThingMesh& mesh, const Color& color, int detail) {
  const FinishNumber body = mesh.finish(Material::StoneWall, color);
  const FinishNumber slab = mesh.finish(Material::Concrete, {178, 174, 164});
  if (detail >= 1) {
    mesh.box({-kHalf_m, -0.12, kRoot_m}, {kHalf_m, 0.12, detail == 1 ? 1.12 : 1.18}, body);
    if (detail == 1) mesh.box({-kHalf_m, -0.15, 1.10}, {kHalf_m, 0.15, 1.19}, slab);
    return;
  }
  mesh.box({-kHalf_m, -0.12, kRoot_m}, {kHalf_m, 0.12, 1.13}, body);
  constexpr int kSlabs = 8;
  for (int k = 0; k < kSlabs; ++k) {
    const double x = -kHalf_m + 0.375 * k;
    const double lift = 0.002 * ((k * 3) % 5);
    mesh.tapered_box({x, -0.15 - 0.5 * lift, 1.10 - lift},
                     {x + 0.370, 0.15 + 0.5 * lift, 1.192 + lift}, {x + 0.01, -0.12},
                     {x + 0.36, 0.12}, slab);
  }
}

ThingInfo barrier(std::string name, SemanticClass semantic_class, const Vector3d& size_m,
                  std::string_view source, int num_variants,
                  std::function<void(ThingMesh&, int, int)> build) {
  return {.name = std::move(name),
          .family = {},
          .semantic_class = semantic_class,
          .stance = Stance::Rooted,
          .size_m = size_m,
          .source = source,
          .coarsest_levels = {-2, 0, 2},
          .num_variants = num_variants,
          .build = std::move(build)};
}

constexpr std::array<Color, 4> kGreens = {{{74, 92, 44}, {62, 84, 46}, {90, 98, 50}, {80, 82, 44}}};
constexpr std::array<Color, 4> kWoods = {
    {{128, 104, 78}, {150, 142, 130}, {206, 202, 192}, {98, 74, 52}}};
constexpr std::array<Color, 3> kStones = {{{196, 186, 164}, {168, 160, 146}, {214, 204, 182}}};

}  // namespace

std::vector<ThingInfo> barriers();
std::vector<ThingInfo> barriers() {
  const auto row = [](int variant) { return static_cast<std::size_t>(variant); };
  return {barrier("hedge", SemanticClass::Bush, {3.0, 0.9, 1.5},
                  "garden hedges of hornbeam and laurel, cut at 1.5 m", 4,
                  [row](ThingMesh& m, int d, int v) {
                    build_hedge(m, {3.0, 0.9, 1.5}, 0.12, kGreens[row(v)], d);
                  }),
          barrier("field_hedge", SemanticClass::Bush, {3.0, 1.8, 2.4},
                  "field hedges of hawthorn and hazel, 2 m to 3 m high", 4,
                  [row](ThingMesh& m, int d, int v) {
                    build_hedge(m, {3.0, 1.8, 2.4}, 0.55, kGreens[row(v)], d);
                  }),
          barrier("board_fence", SemanticClass::Wall, {3.0, 0.10, 1.12},
                  "garden fences of boards on two rails, 1.1 m", 4,
                  [row](ThingMesh& m, int d, int v) { build_fence(m, kWoods[row(v)], d); }),
          barrier("garden_wall", SemanticClass::Wall, {3.0, 0.30, 1.2},
                  "garden walls of 24 cm under slabs of 30 cm, 1.2 m", 3,
                  [row](ThingMesh& m, int d, int v) { build_wall(m, kStones[row(v)], d); })};
}

}  // namespace terracast::tiler
