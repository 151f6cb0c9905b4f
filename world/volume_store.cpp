#include <filesystem>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "world/tile_store.h"

// Volumes in a world's folder.
namespace terracast::world {
namespace {

std::filesystem::path volume_path(const std::filesystem::path& store, std::size_t row) {
  return store / "volumes" / fmt::format("{}.volume", row);
}

}  // namespace

VolumeInfo write_volume(const std::filesystem::path& store, std::size_t row, const Volume& volume) {
  check_volume(volume.name, volume.size);
  const std::vector<std::byte> bytes = encode_volume(volume);
  core::write_file(volume_path(store, row), bytes);
  return {.name = volume.name, .size = volume.size, .content_hash = core::content_hash(bytes)};
}

Volume TileStore::load_volume(std::size_t row) const {
  TERRACAST_CHECK(row < manifest_.volumes.size(), "volume {} of {}", row, manifest_.volumes.size());
  const std::filesystem::path file = volume_path(folder_, row);
  const VolumeInfo& info = manifest_.volumes[row];
  const std::vector<std::byte> bytes = core::read_file(file, 2 * kMaxVoxels);
  if (core::content_hash(bytes) != info.content_hash)
    core::fail(core::ErrorKind::Input,
               "{}: damaged, or not the volume that manifest.json lists (hash {}); tile the world "
               "again",
               file.string(), info.content_hash);
  Volume volume = decode_volume(bytes, file.string());
  if (volume.size != info.size)
    core::fail(core::ErrorKind::Input, "{}: another size than manifest.json says", file.string());
  volume.name = info.name;
  return volume;
}

}  // namespace terracast::world
