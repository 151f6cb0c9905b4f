#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "export/world/tile_ground.h"
#include "world/shape.h"
#include "world/tile_store.h"

namespace terracast::world_export {

class GroundBaker;

/// A picture on surfaces.
struct ModelTexture {
  std::string name;            ///< fit for a file; unlike the others'
  std::vector<std::byte> png;  ///< sRGB of three channels
  bool repeats = false;        ///< beyond its edges; else its edges go on
};

/// The pictures of a model, each once.
class ModelTextures {
 public:
  explicit ModelTextures(const world::TileStore& store) : store_(store) {}

  /// The picture of a finish of Material::Textured: the world's texture, white where it is transparent; -1 of other
  /// finishes. A finish's colour multiplies it, as a factor of a material does (glTF's baseColorFactor, OBJ's Kd).
  /// throws   Input, Io: as TileStore::load_texture
  int of(const world::Finish& finish);
  /// A picture of a tile's ground, made now.
  int add_ground(const GroundBaker& baker, const TileGround& ground, int side_px);

  std::vector<ModelTexture> take() { return std::move(textures_); }

 private:
  const world::TileStore& store_;
  std::vector<ModelTexture> textures_;
  std::map<std::uint16_t, int> rows_;  ///< by the world's textures
};

}  // namespace terracast::world_export
