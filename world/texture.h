#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/image.h"

namespace terracast::world {

/// An image on surfaces of Material::Textured, whose finish's pattern names it. Its lower left corner
/// is at uv (0, 0), its upper right one at (1, 1); it repeats beyond.
struct Texture {
  std::string name;
  core::Image8 image;  ///< sRGB, three channels, or four with alpha (not multiplied in)

  bool operator==(const Texture&) const = default;
};

/// More pixels a side, and altogether, no texture has.
inline constexpr int kMaxTextureSide_px = 16384;
inline constexpr std::size_t kMaxTexturePixels = std::size_t{1} << 26;
/// More than so many bytes, coarser levels included, the textures of a world do not take in memory.
inline constexpr std::size_t kMaxTexturesBytes = std::size_t{1} << 32;

/// throws   Input: an image without pixels, too large, or of one or two channels; names the texture
void check_texture(const std::string& name, int width_px, int height_px, int channels);

/// Half as wide and high (rounded down, 1 at the least): each pixel the mean over its share of the area, in linear
/// light, by alpha where there is alpha. So the mean of the whole stays what it was, but for rounding to
/// codes.
core::Image8 halved(const core::Image8& image);

/// The image and its halves down to a single pixel.
std::vector<core::Image8> mip_levels(core::Image8 image);

/// What the levels of such an image take in memory.
std::size_t mip_bytes(int width_px, int height_px, int channels);

}  // namespace terracast::world
