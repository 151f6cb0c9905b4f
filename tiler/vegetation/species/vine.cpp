#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "tiler/vegetation/crop_rows.h"
#include "tiler/vegetation/finishes.h"
#include "tiler/vegetation/species.h"

// Vines on trellises: rows 2 m apart, a vine every metre, a post every four; shoots rise between
// wires and hang over them.
namespace terracast::tiler {
namespace {

using Eigen::Vector3d;

Plant grow(std::uint64_t seed) {
  Draws draws(seed);
  Plant vine;
  const auto finish = [](world::Material material, std::array<std::uint8_t, 3> color_srgb) {
    return plant_finish(material, core::SemanticClass::Plant, color_srgb);
  };
  vine.finishes = {
      finish(world::Material::Bark, {88, 70, 54}), finish(world::Material::Leaves, {82, 110, 42}),
      finish(world::Material::Leaves, {95, 122, 50}), finish(world::Material::Leaves, {72, 98, 38}),
      finish(world::Material::Planks, {136, 120, 100})};
  int count = 0;
  for_each_in_rows(2.0, 1.0, draws, [&](const Vector3d& foot) {
    Stem stock;
    stock.nodes.push_back({foot, 0.035});
    stock.nodes.push_back(
        {foot + Vector3d(draws.about(0.0, 0.06), draws.about(0.0, 0.06), kCropSunk_m + 0.4), 0.03});
    stock.nodes.push_back(
        {foot + Vector3d(draws.about(0.0, 0.08), draws.about(0.0, 0.08), kCropSunk_m + 0.8), 0.02});
    vine.stems.push_back(stock);
    if (count++ % 4 == 0) {
      Stem post;
      post.finish = 4;
      const Vector3d beside = foot + Vector3d(0.5, 0.0, 0.0);
      post.nodes = {{beside, 0.045},
                    {beside + Vector3d(0.0, 0.0, kCropSunk_m + 1.75), 0.045},
                    {beside + Vector3d(0.0, 0.0, kCropSunk_m + 1.8), 0.02}};
      vine.stems.push_back(post);
    }
    for (int i = 0; i < 88; ++i) {
      const double z = kCropSunk_m + 0.65 + 1.15 * std::pow(draws.unit(), 0.8);
      const double out = draws.about(0.0, 0.24);
      const Vector3d base = foot + Vector3d(draws.about(0.0, 0.56), out, z);
      const Vector3d outward(0.0, out < 0.0 ? -1.0 : 1.0, 0.5);
      const Vector3d tip =
          (draws.direction() + Vector3d(0.0, 0.0, -0.5)).normalized() * draws.between(0.14, 0.24);
      vine.leaves.push_back(make_leaf(base, tip, draws.between(0.15, 0.23),
                                      outward + 0.5 * draws.direction(), LeafForm::Kite, 0.03,
                                      static_cast<std::uint8_t>(1 + i % 3)));
    }
  });
  return vine;
}

}  // namespace

SpeciesInfo vine_species() {
  return {"vine",
          "Vines on trellises: a piece of a vineyard.",
          3,
          {{-2, 1800}, {-1, 500}, {0, 150}, {1, 60}},
          grow};
}

}  // namespace terracast::tiler
