#include "scene/objects/texture_library.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "core/srgb.h"

namespace terracast::scene {
namespace {

/// Linear colour times alpha, and alpha.
using Texel = Eigen::Array4f;

Texel texel(const core::Image8& image, int x, int y) {
  const std::uint8_t* codes = &image(x, y);
  const float alpha = image.channels() == 4 ? static_cast<float>(codes[3]) / 255.0f : 1.0f;
  return {alpha * core::linear_from_srgb8(codes[0]), alpha * core::linear_from_srgb8(codes[1]),
          alpha * core::linear_from_srgb8(codes[2]), alpha};
}

/// A coordinate's two pixels, which wrap, and the second one's weight.
struct Between {
  int first;
  int second;
  float weight;
};

/// at   0 … 1
Between pixels_at(double at, int size) {
  const double place = at * size - 0.5;
  const double below = std::floor(place);
  const int first = (static_cast<int>(below) + size) % size;
  return {first, (first + 1) % size, static_cast<float>(place - below)};
}

Texel bilinear(const core::Image8& image, double u, double v) {
  const Between x = pixels_at(u, image.width());
  const Between y = pixels_at(v, image.height());
  const Texel above = texel(image, x.first, y.first) * (1.0f - x.weight) +
                      texel(image, x.second, y.first) * x.weight;
  const Texel below = texel(image, x.first, y.second) * (1.0f - x.weight) +
                      texel(image, x.second, y.second) * x.weight;
  return above * (1.0f - y.weight) + below * y.weight;
}

/// Within one length of the texture, 0 … 1; what is no number is 0.
double within(float coordinate) {
  const double whole = static_cast<double>(coordinate);
  const double rest = whole - std::floor(whole);
  return rest >= 0.0 && rest < 1.0 ? rest : 0.0;
}

}  // namespace

TextureLibrary::TextureLibrary(const world::TileStore& store) {
  textures_.resize(store.manifest().textures.size());
  core::parallel_for(static_cast<std::int64_t>(textures_.size()), [&](std::int64_t i) {
    const auto row = static_cast<std::size_t>(i);
    textures_[row] = world::mip_levels(store.load_texture(row).image);
  });
}

TextureLibrary::TextureLibrary(const std::vector<world::Texture>& textures) {
  for (const world::Texture& texture : textures)
    textures_.push_back(world::mip_levels(texture.image));
}

Color textured_albedo(const TextureLibrary& textures, const world::Finish& finish,
                      const Eigen::Vector2f& uv, float footprint_uv) {
  if (finish.pattern >= textures.size())
    core::fail(core::ErrorKind::Input,
               "a surface shows texture {}; the world has {}; tile the world again", finish.pattern,
               textures.size());
  const std::vector<core::Image8>& levels = textures.levels(finish.pattern);
  const double u = within(uv.x());
  const double v = 1.0 - within(uv.y());  // rows run downward
  const float texels = footprint_uv * std::sqrt(static_cast<float>(levels.front().num_pixels()));
  const auto coarsest = static_cast<float>(levels.size() - 1);
  // What is no number is seen from nowhere near: the coarsest level.
  const float level =
      texels <= 1.0f ? 0.0f
                     : (std::isfinite(texels) ? std::min(std::log2(texels), coarsest) : coarsest);
  const auto finer = static_cast<std::size_t>(level);
  const float share = level - static_cast<float>(finer);
  Texel seen = bilinear(levels[finer], u, v);
  if (share > 0.0f) seen = seen * (1.0f - share) + bilinear(levels[finer + 1], u, v) * share;
  const Color tint(core::linear_from_srgb8(finish.color_srgb[0]),
                   core::linear_from_srgb8(finish.color_srgb[1]),
                   core::linear_from_srgb8(finish.color_srgb[2]));
  return (seen.head<3>() + (1.0f - seen[3])) * tint;
}

}  // namespace terracast::scene
