#include "world/tile_cover.h"

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "world/tile_file.h"

namespace terracast::world {
namespace {

constexpr std::size_t kMaxCoverTileBytes = std::size_t{1} << 30;

}  // namespace

std::vector<Cover> load_cover(const TileStore& store, const TileId& id) {
  const TileInfo* info = store.find(id);
  TERRACAST_CHECK(info != nullptr, "{}: no tile {}", store.folder().string(), id.name());
  const std::filesystem::path file = tile_path(store.folder(), id);
  const std::vector<std::byte> bytes = core::read_file(file, kMaxCoverTileBytes);
  std::vector<Cover> cover = decode_cover(bytes, id, file.string());
  if (bytes.size() != info->num_bytes || core::content_hash(bytes) != info->content_hash)
    core::fail(core::ErrorKind::Input,
               "{}: a whole tile, but not the one that manifest.json lists (hash {}); tile the "
               "world again",
               file.string(), info->content_hash);
  return cover;
}

}  // namespace terracast::world
