#include <filesystem>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "world/tile_store.h"

// Ways in a world's folder.
namespace terracast::world {
namespace {

constexpr const char* kWaysFile = "ways.bin";
constexpr std::size_t kMaxFileBytes = std::size_t{1} << 31;

}  // namespace

WaysInfo write_ways(const std::filesystem::path& store, const WayNetwork& network) {
  if (network.parts.empty()) return {};
  const std::vector<std::byte> bytes = encode_ways(network);
  core::write_file(store / kWaysFile, bytes);
  return {.num_parts = static_cast<std::int64_t>(network.parts.size()),
          .content_hash = core::content_hash(bytes)};
}

WayNetwork TileStore::load_ways() const {
  if (manifest_.ways.num_parts == 0) return {};
  const std::filesystem::path file = folder_ / kWaysFile;
  const std::vector<std::byte> bytes = core::read_file(file, kMaxFileBytes);
  if (core::content_hash(bytes) != manifest_.ways.content_hash)
    core::fail(
        core::ErrorKind::Input,
        "{}: damaged, or not the ways that manifest.json lists (hash {}); tile the world again",
        file.string(), manifest_.ways.content_hash);
  return decode_ways(bytes, file.string());
}

}  // namespace terracast::world
