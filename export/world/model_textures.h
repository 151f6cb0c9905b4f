#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
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

  /// The picture of a finish of Material::Textured: the world's texture, over the finish's colour where it is
  /// transparent; -1 of other finishes. What is opaque hides that colour and is one picture for all. Of others each
  /// colour has its own: a factor of a material (glTF's baseColorFactor, OBJ's Kd) multiplies all pixels alike, and alpha
  /// of a picture lets through what is behind the surface, not a colour of the surface's own.
  /// throws   Input, Io: as TileStore::load_texture
  int of(const world::Finish& finish);
  /// A picture of a tile's ground, made now.
  int add_ground(const GroundBaker& baker, const TileGround& ground, int side_px);

  std::vector<ModelTexture> take() { return std::move(textures_); }

 private:
  const world::TileStore& store_;
  std::vector<ModelTexture> textures_;
  // By the world's textures, and by these and colours.
  std::map<std::uint16_t, int> opaque_;
  std::map<std::pair<std::uint16_t, std::array<std::uint8_t, 3>>, int> over_color_;
};

}  // namespace terracast::world_export
