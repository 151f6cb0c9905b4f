#include "world/texture.h"

#include <algorithm>
#include <array>

#include "core/error.h"
#include "core/srgb.h"

namespace terracast::world {
namespace {

/// Of a source's line of `from` pixels, which make the pixel `at` of a line half as long, and by how much.
struct Taps {
  int first;
  int count;
  std::array<float, 3> weights;
};

Taps taps_of(int from, int at) {
  if (from == 1) return {0, 1, {1.0f, 0.0f, 0.0f}};
  if (from % 2 == 0) return {2 * at, 2, {0.5f, 0.5f, 0.0f}};
  // 2 d + 1 pixels on d: each pixel of the result covers 2 + 1 / d of the source's.
  const int to = from / 2;
  const auto whole = static_cast<float>(from);
  return {2 * at,
          3,
          {static_cast<float>(to - at) / whole, static_cast<float>(to) / whole,
           static_cast<float>(at + 1) / whole}};
}

std::vector<Taps> all_taps(int from) {
  std::vector<Taps> taps;
  for (int at = 0; at < std::max(from / 2, 1); ++at) taps.push_back(taps_of(from, at));
  return taps;
}

}  // namespace

void check_texture(const std::string& name, int width_px, int height_px, int channels) {
  const auto fail_texture = [&](const char* why) {
    core::fail(
        core::ErrorKind::Input,
        "texture \"{}\": {} x {} pixels of {} channels: {}; up to {} pixels a side and {} in "
        "all, of 3 or 4 channels, are right",
        name, width_px, height_px, channels, why, kMaxTextureSide_px, kMaxTexturePixels);
  };
  if (width_px < 1 || height_px < 1) fail_texture("no image");
  if (channels != 3 && channels != 4) fail_texture("neither RGB nor RGBA");
  if (width_px > kMaxTextureSide_px || height_px > kMaxTextureSide_px ||
      static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px) > kMaxTexturePixels)
    fail_texture("too large");
}

core::Image8 halved(const core::Image8& image) {
  TERRACAST_CHECK(image.channels() == 3 || image.channels() == 4, "{} channels", image.channels());
  const std::vector<Taps> across = all_taps(image.width());
  const std::vector<Taps> down = all_taps(image.height());
  const bool has_alpha = image.channels() == 4;
  core::Image8 half(static_cast<int>(across.size()), static_cast<int>(down.size()),
                    image.channels());
  for (int y = 0; y < half.height(); ++y) {
    const Taps& rows = down[static_cast<std::size_t>(y)];
    for (int x = 0; x < half.width(); ++x) {
      const Taps& columns = across[static_cast<std::size_t>(x)];
      std::array<float, 3> sum = {};
      float alpha = 0.0f;
      for (int j = 0; j < rows.count; ++j)
        for (int i = 0; i < columns.count; ++i) {
          const std::uint8_t* pixel = &image(columns.first + i, rows.first + j);
          float weight = rows.weights[static_cast<std::size_t>(j)] *
                         columns.weights[static_cast<std::size_t>(i)];
          if (has_alpha) weight *= static_cast<float>(pixel[3]) / 255.0f;
          alpha += weight;
          for (std::size_t k = 0; k < 3; ++k) sum[k] += weight * core::linear_from_srgb8(pixel[k]);
        }
      std::uint8_t* out = &half(x, y);
      if (has_alpha) {
        out[3] = static_cast<std::uint8_t>(std::min(alpha * 255.0f + 0.5f, 255.0f));
        if (alpha > 0.0f)
          for (float& one : sum) one /= alpha;
      }
      for (std::size_t k = 0; k < 3; ++k) out[k] = core::srgb8_from_linear(sum[k]);
    }
  }
  return half;
}

std::vector<core::Image8> mip_levels(core::Image8 image) {
  std::vector<core::Image8> levels;
  levels.push_back(std::move(image));
  while (levels.back().width() > 1 || levels.back().height() > 1)
    levels.push_back(halved(levels.back()));
  return levels;
}

std::size_t mip_bytes(int width_px, int height_px, int channels) {
  std::size_t bytes = 0;
  while (true) {
    bytes += static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px) *
             static_cast<std::size_t>(channels);
    if (width_px == 1 && height_px == 1) return bytes;
    width_px = std::max(width_px / 2, 1);
    height_px = std::max(height_px / 2, 1);
  }
}

}  // namespace terracast::world
