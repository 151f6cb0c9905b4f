#include <cmath>
#include <filesystem>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/image_io.h"
#include "world/tile_store.h"

// Tiles of imagery in a world's folder.
namespace terracast::world {
namespace {

using core::ErrorKind;
using core::fail;

constexpr int kPngLevel = 4;
/// Of a PNG that holds a tile, however badly it packs.
constexpr std::size_t kMaxBytes = std::size_t{8} * kImageryTile_px * kImageryTile_px;

std::filesystem::path imagery_path(const std::filesystem::path& store, std::size_t row,
                                   const ImageryTileId& id) {
  return store / "imagery" / std::to_string(row) / std::to_string(id.level) /
         fmt::format("{}_{}.png", id.x, id.y);
}

core::Image8 without_alpha(const core::Image8& image) {
  core::Image8 rgb(image.width(), image.height(), 3);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x)
      for (int k = 0; k < 3; ++k) rgb(x, y, k) = image(x, y, k);
  return rgb;
}

bool is_opaque(const core::Image8& image) {
  for (std::size_t i = 3; i < image.data().size(); i += 4)
    if (image.data()[i] != 255) return false;
  return true;
}

}  // namespace

double ImageryTileId::pixel_m() const { return std::ldexp(1.0, level); }

ImageryTileInfo write_imagery_tile(const std::filesystem::path& store, std::size_t row,
                                   const ImageryTileId& id, const core::Image8& image) {
  TERRACAST_CHECK(image.width() == kImageryTile_px && image.height() == kImageryTile_px &&
                      image.channels() == 4,
                  "{} x {} x {}", image.width(), image.height(), image.channels());
  const std::vector<std::byte> bytes =
      core::encode_png(is_opaque(image) ? without_alpha(image) : image, kPngLevel);
  core::write_file(imagery_path(store, row, id), bytes);
  return {.id = id,
          .sources = {},
          .num_bytes = bytes.size(),
          .content_hash = core::content_hash(bytes)};
}

bool is_imagery_tile_whole(const std::filesystem::path& store, std::size_t row,
                           const ImageryTileInfo& tile) {
  const std::filesystem::path file = imagery_path(store, row, tile.id);
  std::error_code error;
  if (std::filesystem::file_size(file, error) != tile.num_bytes || error) return false;
  return core::content_hash_of_file(file) == tile.content_hash;
}

core::Image8 TileStore::load_imagery(std::size_t row, std::size_t tile) const {
  TERRACAST_CHECK(row < manifest_.imagery.size() && tile < manifest_.imagery[row].tiles.size(),
                  "tile {} of imagery {}", tile, row);
  const ImageryTileInfo& info = manifest_.imagery[row].tiles[tile];
  const std::filesystem::path file = imagery_path(folder_, row, info.id);
  const std::vector<std::byte> bytes = core::read_file(file, kMaxBytes);
  if (core::content_hash(bytes) != info.content_hash)
    fail(ErrorKind::Input,
         "{}: damaged, or not the imagery that manifest.json lists (hash {}); tile the world again",
         file.string(), info.content_hash);
  auto image =
      core::decode_png(bytes, file.string(), std::size_t{kImageryTile_px} * kImageryTile_px);
  auto* pixels = std::get_if<core::Image8>(&image);
  if (pixels == nullptr || pixels->width() != kImageryTile_px ||
      pixels->height() != kImageryTile_px || pixels->channels() < 3)
    fail(ErrorKind::Input, "{}: no tile of imagery ({} pixels a side, RGB or RGBA, are)",
         file.string(), kImageryTile_px);
  return std::move(*pixels);
}

}  // namespace terracast::world
