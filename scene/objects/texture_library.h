#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "core/image.h"
#include "scene/light/sky.h"
#include "world/shape.h"
#include "world/tile_store.h"

namespace terracast::scene {

/// The textures of a world with all their coarser levels in memory, which world::num_bytes_of() tells
/// and tracing.memory_bytes sets aside. Immutable; threads: safe.
class TextureLibrary {
 public:
  TextureLibrary() = default;
  /// Reads all textures of the store, in parallel.
  /// throws   Input: a damaged texture; Io
  explicit TextureLibrary(const world::TileStore& store);
  explicit TextureLibrary(const std::vector<world::Texture>& textures);

  std::size_t size() const { return textures_.size(); }
  /// Levels of a texture, finest first.
  const std::vector<core::Image8>& levels(std::size_t row) const { return textures_[row]; }

 private:
  std::vector<std::vector<core::Image8>> textures_;
};

/// Linear albedo of a surface of Material::Textured: its texture's colour, white where the texture is transparent, times
/// the finish's. Bilinear in the two levels whose pixels are next to the footprint, linear
/// between them; the texture repeats.
/// footprint_uv   width of an image sample in lengths of the texture; 0: the finest level
/// throws         Input: a texture that the world lacks
/// threads        safe
Color textured_albedo(const TextureLibrary& textures, const world::Finish& finish,
                      const Eigen::Vector2f& uv, float footprint_uv);

}  // namespace terracast::scene
