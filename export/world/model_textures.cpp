#include "export/world/model_textures.h"

#include <fmt/format.h>

#include "core/error.h"
#include "core/image_io.h"
#include "core/srgb.h"
#include "export/world/ground_baker.h"

namespace terracast::world_export {
namespace {

/// libdeflate's scale; noise gets hardly smaller above.
constexpr int kPngLevel = 6;

/// A picture of three channels, white where it is transparent; mixed in linear light.
core::Image8 over_white(const core::Image8& image) {
  if (image.channels() == 3) return image;
  core::Image8 flat(image.width(), image.height(), 3);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) {
      const float alpha = static_cast<float>(image(x, y, 3)) / 255.0F;
      for (int c = 0; c < 3; ++c)
        flat(x, y, c) = core::srgb8_from_linear(alpha * core::linear_from_srgb8(image(x, y, c)) +
                                                (1.0F - alpha));
    }
  return flat;
}

}  // namespace

int ModelTextures::of(const world::Finish& finish) {
  if (finish.material != world::Material::Textured) return -1;
  const std::uint16_t row = finish.pattern;
  if (const auto known = rows_.find(row); known != rows_.end()) return known->second;
  if (row >= store_.manifest().textures.size())
    core::fail(core::ErrorKind::Input,
               "a surface shows texture {}; the world has {}; tile the world again", row,
               store_.manifest().textures.size());
  const world::Texture texture = store_.load_texture(row);
  const auto index = static_cast<int>(textures_.size());
  rows_[row] = index;
  textures_.push_back({.name = fmt::format("texture_{}", row),
                       .png = core::encode_png(over_white(texture.image), kPngLevel),
                       .repeats = true});
  return index;
}

int ModelTextures::add_ground(const GroundBaker& baker, const TileGround& ground, int side_px) {
  const world::TileId& id = ground.tile().id;
  textures_.push_back({.name = fmt::format("ground_{}_{}_{}", id.level, id.x, id.y),
                       .png = core::encode_png(baker.picture_of(ground, side_px), kPngLevel)});
  return static_cast<int>(textures_.size()) - 1;
}

}  // namespace terracast::world_export
