#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

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

/// How a hedge grows.
struct HedgeForm {
  Vector3d size;
  double end_share;  ///< of its section that is left at its ends
  double uneven;     ///< by which share of its section it stands in at most
  double spray_m;    ///< how long twigs with leaves are that stand out
};

double drawn(std::uint64_t what, std::uint64_t number) {
  return core::random_unit(0x6865646765ULL, what, number);
}

/// A twig with leaves: a thin body that narrows to a point, within the hedge's box.
void add_spray(ThingMesh& mesh, const HedgeForm& form, const Vector3d& foot, const Vector3d& out,
               double length_m, FinishNumber leaves, std::uint64_t number) {
  const auto within = [&](const Vector3d& at) {
    const Vector3d half(0.5 * form.size.x(), 0.5 * form.size.y(), form.size.z());
    return Vector3d(at.cwiseMax(Vector3d(-half.x(), -half.y(), kRoot_m)).cwiseMin(half));
  };
  const Vector3d twisted(drawn(20, number) - 0.5, drawn(21, number) - 0.5, drawn(22, number) - 0.5);
  const Vector3d side = out.cross(twisted).normalized();
  const Vector3d lift = 0.12 * length_m * out.cross(side);
  const Vector3d broad = foot + 0.35 * length_m * out;
  const Vector3d tip = within(foot + length_m * out);
  mesh.loft({{within(broad + 0.62 * length_m * side), within(broad - 0.62 * length_m * side),
              within(broad + lift - 0.3 * length_m * out)},
             {tip, tip, tip}},
            leaves);
}

/// Twigs with leaves all over its sides and top.
void add_sprays(ThingMesh& mesh, const HedgeForm& form, int count, double length_m,
                FinishNumber leaves) {
  const double w = 0.5 * form.size.y();
  const double h = form.size.z();
  for (int k = 0; k < count; ++k) {
    const auto number = static_cast<std::uint64_t>(k);
    // Spread along it, and round it from one foot over the top to the other.
    const double share = (k + drawn(10, number)) / count;
    const double x = (2.0 * share - 1.0) * 0.98 * kHalf_m;
    const double angle_rad = std::numbers::pi * std::fmod(0.6180339887 * k + 0.1, 1.0);
    const double end = std::min((kHalf_m - std::abs(x)) / 0.3, 1.0);
    const double section = form.end_share + (1.0 - form.end_share) * end;
    const Vector3d foot(x, 0.80 * section * w * std::cos(angle_rad),
                        h * (0.10 + 0.78 * section * std::sin(angle_rad)));
    const Vector3d out(0.9 * (drawn(11, number) - 0.5) + (1.0 - end) * (x < 0.0 ? -0.8 : 0.8),
                       std::cos(angle_rad) + 0.4 * (drawn(12, number) - 0.5),
                       0.25 + std::sin(angle_rad));
    add_spray(mesh, form, foot, out.normalized(), length_m * (0.7 + 0.6 * drawn(13, number)),
              leaves, number);
  }
}

/// Leafy all round, with rounded ends: a row of them is uneven, as bushes are.
void build_hedge(ThingMesh& mesh, const HedgeForm& form, const Color& color, int detail) {
  const FinishNumber leaves = mesh.finish(Material::Leaves, color);
  const double w = 0.5 * form.size.y();
  const double h = form.size.z();
  // What twigs stand out from; far off it is as large as with them.
  const double core = detail == 0 ? 0.93 : 0.965;
  const Outline fine = {{-0.86 * w, kRoot_m}, {0.86 * w, kRoot_m},   {0.95 * w, 0.30 * h},
                        {w, 0.60 * h},        {0.78 * w, 0.90 * h},  {0.30 * w, h},
                        {-0.30 * w, h},       {-0.78 * w, 0.90 * h}, {-w, 0.60 * h},
                        {-0.95 * w, 0.30 * h}};
  const Outline coarse = {{-0.86 * w, kRoot_m}, {0.86 * w, kRoot_m}, {w, 0.60 * h},
                          {0.45 * w, h},        {-0.45 * w, h},      {-w, 0.60 * h}};
  const Outline& section = detail < 2 ? fine : coarse;
  const std::vector<double> at_m =
      detail == 0   ? std::vector<double>{-1.5, -1.34, -0.95, -0.5, -0.05, 0.45, 0.95, 1.34, 1.5}
      : detail == 1 ? std::vector<double>{-1.5, -1.25, -0.4, 0.5, 1.25, 1.5}
                    : std::vector<double>{-1.5, -1.2, 1.2, 1.5};
  std::vector<Ring> rings;
  for (std::size_t i = 0; i < at_m.size(); ++i) {
    const bool is_end = i == 0 || i + 1 == at_m.size();
    Outline ring = section;
    for (std::size_t k = 2; k < ring.size(); ++k) {
      const double in = detail == 2 ? 0.4 : drawn(i, k);
      const double share = core * (is_end ? form.end_share : 1.0) * (1.0 - form.uneven * in);
      ring[k] = {ring[k].x() * share, ring[k].y() * (1.0 - 0.6 * (1.0 - share))};
    }
    rings.push_back(ring_across(at_m[i], ring));
  }
  mesh.loft(rings, leaves);
  if (detail == 0) add_sprays(mesh, form, 46, form.spray_m, leaves);
  if (detail == 1) add_sprays(mesh, form, 10, 1.5 * form.spray_m, leaves);
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
                    build_hedge(m, {{3.0, 0.9, 1.5}, 0.93, 0.18, 0.22}, kGreens[row(v)], d);
                  }),
          barrier("field_hedge", SemanticClass::Bush, {3.0, 1.8, 2.4},
                  "field hedges of hawthorn and hazel, 2 m to 3 m high", 4,
                  [row](ThingMesh& m, int d, int v) {
                    build_hedge(m, {{3.0, 1.8, 2.4}, 0.78, 0.42, 0.48}, kGreens[row(v)], d);
                  }),
          barrier("board_fence", SemanticClass::Wall, {3.0, 0.10, 1.12},
                  "garden fences of boards on two rails, 1.1 m", 4,
                  [row](ThingMesh& m, int d, int v) { build_fence(m, kWoods[row(v)], d); }),
          barrier("garden_wall", SemanticClass::Wall, {3.0, 0.30, 1.2},
                  "garden walls of 24 cm under slabs of 30 cm, 1.2 m", 3,
                  [row](ThingMesh& m, int d, int v) { build_wall(m, kStones[row(v)], d); })};
}

}  // namespace terracast::tiler
