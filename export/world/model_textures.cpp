#include "export/world/model_textures.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "core/image_io.h"
#include "core/srgb.h"
#include "export/world/ground_baker.h"

namespace terracast::world_export {
namespace {

/// libdeflate's scale; noise gets hardly smaller above.
constexpr int kPngLevel = 6;

/// A picture of three channels, over a colour where it is transparent; mixed in linear light.
core::Image8 over(const core::Image8& image, const std::array<std::uint8_t, 3>& color_srgb) {
  if (image.channels() == 3) return image;
  core::Image8 flat(image.width(), image.height(), 3);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) {
      const float alpha = static_cast<float>(image(x, y, 3)) / 255.0F;
      for (int c = 0; c < 3; ++c)
        flat(x, y, c) = core::srgb8_from_linear(
            alpha * core::linear_from_srgb8(image(x, y, c)) +
            (1.0F - alpha) * core::linear_from_srgb8(color_srgb[static_cast<std::size_t>(c)]));
    }
  return flat;
}

bool is_opaque(const core::Image8& image) {
  if (image.channels() == 3) return true;
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x)
      if (image(x, y, 3) != 255) return false;
  return true;
}

}  // namespace

int ModelTextures::of(const world::Finish& finish) {
  if (finish.material != world::Material::Textured) return -1;
  const std::uint16_t row = finish.pattern;
  if (const auto known = opaque_.find(row); known != opaque_.end()) return known->second;
  const auto& color = finish.color_srgb;
  if (const auto known = over_color_.find({row, color}); known != over_color_.end())
    return known->second;
  if (row >= store_.manifest().textures.size())
    core::fail(core::ErrorKind::Input,
               "a surface shows texture {}; the world has {}; tile the world again", row,
               store_.manifest().textures.size());
  const world::Texture texture = store_.load_texture(row);
  const auto index = static_cast<int>(textures_.size());
  std::string name = fmt::format("texture_{}", row);
  if (is_opaque(texture.image)) {
    opaque_[row] = index;
  } else {
    name += fmt::format("_{:02x}{:02x}{:02x}", color[0], color[1], color[2]);
    over_color_[{row, color}] = index;
  }
  textures_.push_back({.name = std::move(name),
                       .png = core::encode_png(over(texture.image, color), kPngLevel),
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
