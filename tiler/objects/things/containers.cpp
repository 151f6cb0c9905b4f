#include <array>

#include "tiler/objects/things.h"

namespace terracast::tiler {
namespace {

using core::SemanticClass;
using Eigen::Vector2d;
using Eigen::Vector3d;
using world::Material;

constexpr std::array<Color, 8> kColors = {{{146, 52, 38},
                                           {34, 72, 122},
                                           {190, 190, 184},
                                           {58, 102, 72},
                                           {196, 112, 36},
                                           {96, 54, 52},
                                           {70, 76, 84},
                                           {30, 120, 140}}};

void build_container(ThingMesh& mesh, const Vector3d& size, int detail, int variant) {
  const Color& color = kColors[static_cast<std::size_t>(variant)];
  const FinishNumber wall = mesh.finish(Material::Paint, color);
  const double l = 0.5 * size.x();
  const double w = 0.5 * size.y();
  const double h = size.z();
  if (detail > 0) {
    mesh.box({-l, -w, 0.0}, {l, w, h}, wall);
    return;
  }
  const Color shade = {static_cast<std::uint8_t>(color[0] * 4 / 5),
                       static_cast<std::uint8_t>(color[1] * 4 / 5),
                       static_cast<std::uint8_t>(color[2] * 4 / 5)};
  const FinishNumber frame = mesh.finish(Material::Paint, shade);
  const FinishNumber steel = mesh.finish(Material::Metal, {132, 134, 136});
  // Corrugated walls: trapezoids 0.278 m apart, 36 mm deep, inside the frame.
  Outline outline;
  const double from = -l + 0.12;
  const double to = l - 0.12;
  const int num_folds = static_cast<int>((to - from) / 0.278);
  const double pitch = (to - from) / num_folds;
  for (const double side : {-1.0, 1.0})
    for (int k = 0; k < num_folds; ++k) {
      const double x = side < 0.0 ? from + k * pitch : to - k * pitch;
      const double step = side < 0.0 ? pitch : -pitch;
      for (const auto& [share, depth] :
           {std::pair{0.06, 0.0}, {0.32, 0.0}, {0.56, 0.036}, {0.82, 0.036}})
        outline.emplace_back(x + share * step, side * (w - 0.015 - depth));
    }
  mesh.prism(outline, 0.1, h - 0.06, wall, wall);
  // Frame: posts, rails; castings a little proud of it, as in ISO 1161.
  for (const double x : {-l + 0.006, l - 0.166})
    for (const double y : {-w + 0.004, w - 0.134})
      mesh.box({x, y, 0.006}, {x + 0.16, y + 0.13, h - 0.006}, frame);
  for (const double y : {-w + 0.008, w - 0.078}) {
    mesh.box({-l + 0.1, y, 0.01}, {l - 0.1, y + 0.07, 0.16}, frame);
    mesh.box({-l + 0.1, y, h - 0.10}, {l - 0.1, y + 0.07, h - 0.012}, frame);
  }
  for (const double x : {-l, l - 0.178})
    for (const double y : {-w, w - 0.162})
      for (const double z : {0.0, h - 0.118})
        mesh.box({x, y, z}, {x + 0.178, y + 0.162, z + 0.118}, frame);
  // Doors at the rear with their bars.
  mesh.box({-l + 0.05, -w + 0.1, 0.12}, {-l + 0.2, w - 0.1, h - 0.08}, wall);
  for (const double y : {-0.85, -0.32, 0.32, 0.85})
    mesh.bar({-l + 0.03, y, 0.14}, {-l + 0.03, y, h - 0.12}, 0.036, steel);
  mesh.box({l - 0.12, -w + 0.1, 0.1}, {l - 0.05, w - 0.1, h - 0.08}, wall);
}

ThingInfo container(std::string name, const Vector3d& size_m, std::string_view source) {
  return {.name = std::move(name),
          .family = {},
          .semantic_class = SemanticClass::Container,
          .stance = Stance::Stands,
          .size_m = size_m,
          .source = source,
          .coarsest_levels = {-1, 2, 3},
          .num_variants = static_cast<int>(kColors.size()),
          .build = [size_m](ThingMesh& m, int d, int v) { build_container(m, size_m, d, v); }};
}

}  // namespace

std::vector<ThingInfo> containers();
std::vector<ThingInfo> containers() {
  return {container("container_20", {6.058, 2.438, 2.591},
                    "ISO 668, series 1CC: 6.058 x 2.438 x 2.591 m"),
          container("container_40", {12.192, 2.438, 2.591},
                    "ISO 668, series 1AA: 12.192 x 2.438 x 2.591 m"),
          container("container_40_high", {12.192, 2.438, 2.896},
                    "ISO 668, series 1AAA: 12.192 x 2.438 x 2.896 m")};
}

}  // namespace terracast::tiler
