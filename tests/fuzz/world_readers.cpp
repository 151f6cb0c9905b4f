// The files of a world's folder: as they lie there, and behind their checksums and compression.

#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/hash.h"
#include "core/json.h"
#include "tests/fuzz/scratch.h"
#include "world/deflated.h"
#include "world/objects_file.h"
#include "world/raster_info.h"
#include "world/sealed_file.h"
#include "world/tile_file.h"
#include "world/tile_store.h"
#include "world/vdb/vdb_lengths.h"
#include "world/volume.h"
#include "world/way_network.h"

namespace terracast::fuzz {
namespace {

namespace fs = std::filesystem;
using world::TileId;

constexpr TileId kTile = {1, -3, 2};

std::span<const std::uint8_t> octets(Bytes bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

/// The content in a sealed file of a magic.
std::vector<std::byte> sealed_as(const char* magic, std::uint16_t version, Bytes content) {
  world::SealedKind kind = {
      .magic = {}, .version = version, .most_bytes = std::size_t{1} << 26, .what = "an input"};
  std::memcpy(kind.magic.data(), magic, kind.magic.size());
  return world::sealed(kind, octets(content));
}

template <class Value>
void overwrite(std::vector<std::byte>& bytes, std::size_t at, const Value& value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

/// Writes the checksum of what lies from byte 16 on into bytes 8 to 15, as tiles and volumes have it.
void seal(std::vector<std::byte>& bytes) {
  overwrite(bytes, 8, core::content_hash64(std::span<const std::byte>(bytes).subspan(16)));
}

void read_tile(Bytes bytes) {
  world::decode_tile(bytes, kTile, "fuzz.tile", world::WaterDepth::Read);
  world::decode_cover(bytes, kTile, "fuzz.tile");
  world::objects_bytes_of(bytes);
}

/// Text of a JSON file with a content_hash that is right, where it is an object.
std::string sealed_text(Bytes input) {
  core::Json json = core::Json::parse(text_of(input), "fuzz.json");
  if (json.is_object()) core::add_content_hash(json);
  return json.text();
}

/// A world of one source and one layer, without files.
fs::path write_small_world(const fs::path& folder) {
  world::WorldManifest manifest;
  manifest.name = "fuzz";
  manifest.input_hash = std::string(32, '0');
  manifest.size_m = 1024.0;
  manifest.outside = "error";
  manifest.sources.resize(1);
  manifest.layers.resize(1);
  world::write_manifest(folder, manifest);
  return folder;
}

}  // namespace

void fuzz_tile(Bytes input) { read_tile(input); }

/// A header of 80 bytes, whose address, sizes and checksum are made right, then five layers, each behind its length of
/// two bytes, that are zeros from where the input ends; the rest is the objects. The input is not deflated.
void fuzz_tile_layers(Bytes input) {
  constexpr std::size_t kHeaderBytes = 80;
  constexpr std::size_t kNumSamples = std::size_t{world::kTileSamples} * world::kTileSamples;
  Front front(input);
  std::vector<std::byte> bytes(kHeaderBytes);
  const Bytes header = front.take(kHeaderBytes);
  std::copy(header.begin(), header.end(), bytes.begin());
  std::vector<std::uint32_t> sizes;
  for (const std::size_t samples : {4, 1, 1, 1, 4}) {
    const auto stated = static_cast<std::size_t>(front.number(2));
    const std::span<const std::uint8_t> front_bytes = octets(front.take(stated));
    if (samples == 4 && sizes.size() == 4 && front_bytes.empty()) {
      sizes.push_back(0);  // no water
      continue;
    }
    std::vector<std::uint8_t> layer(samples * kNumSamples);
    std::copy(front_bytes.begin(), front_bytes.end(), layer.begin());
    sizes.push_back(world::append_deflated(bytes, layer));
  }
  const Bytes objects = front.rest();
  sizes.push_back(objects.empty() ? 0 : world::append_deflated(bytes, octets(objects)));
  overwrite(bytes, 0, std::to_array({'T', 'C', 'T', 'I', 'L', 'E'}));
  overwrite(bytes, 6, static_cast<std::uint16_t>(world::kTileFileVersion));
  overwrite(bytes, 16, std::to_array({kTile.level, kTile.x, kTile.y, world::kTileSamples}));
  overwrite(bytes, 52, static_cast<std::uint32_t>(objects.size()));
  for (std::size_t i = 0; i < sizes.size(); ++i) overwrite(bytes, 56 + 4 * i, sizes[i]);
  seal(bytes);
  read_tile(bytes);
}

void fuzz_prototype(Bytes input) { world::decode_prototype(input, "fuzz.prototype"); }
void fuzz_prototype_shapes(Bytes input) {
  world::decode_prototype(sealed_as("TCPROT", world::kPrototypeFileVersion, input),
                          "fuzz.prototype");
}

void fuzz_ways(Bytes input) { world::decode_ways(input, "ways.bin"); }
/// What is read is written to the same bytes.
void fuzz_ways_parts(Bytes input) {
  const std::vector<std::byte> bytes = sealed_as("TCWAYS", world::kWayFileVersion, input);
  if (world::encode_ways(world::decode_ways(bytes, "ways.bin")) != bytes)
    core::fail(core::ErrorKind::Internal, "ways of {} bytes are written to other bytes",
               input.size());
}

void fuzz_volume(Bytes input) { world::decode_volume(input, "fuzz.volume"); }
/// A header of 64 bytes, whose magic and checksum are made right, then voxels.
void fuzz_volume_voxels(Bytes input) {
  constexpr std::size_t kHeaderBytes = 64;
  Front front(input);
  std::vector<std::byte> bytes(kHeaderBytes);
  const Bytes header = front.take(kHeaderBytes);
  std::copy(header.begin(), header.end(), bytes.begin());
  world::append_deflated(bytes, octets(front.rest()));
  overwrite(bytes, 0, std::uint64_t{0x31304c4f56435421});
  seal(bytes);
  world::decode_volume(bytes, "fuzz.volume");
}

/// The look at a file of OpenVDB before OpenVDB reads it, which it does in a process of its own.
void fuzz_vdb_lengths(Bytes input) { world::check_vdb_lengths(put("fuzz.vdb", input)); }

void fuzz_world_manifest(Bytes input) {
  const fs::path file = put("manifest.json", bytes_of(sealed_text(input)));
  const world::TileStore store = world::TileStore::open(file.parent_path());
  if (!store.manifest().tiles.empty()) store.find(store.manifest().tiles[0].id);
}

void fuzz_rasters_of_world(Bytes input) {
  static const fs::path folder = write_small_world(scratch_folder("world"));
  static const world::TileStore store = world::TileStore::open(folder);
  const std::string text = sealed_text(input);
  write_bytes(folder / "rasters.json", bytes_of(text));
  std::optional<world::WorldRasters> rasters = world::read_rasters(store);
  if (!rasters) return;
  for (std::size_t layer = 0; layer < rasters->land_cover.size(); ++layer)
    for (std::size_t raster = 0; raster < rasters->land_cover[layer].size(); ++raster)
      world::read_covers(store, layer, raster, *rasters);
}

}  // namespace terracast::fuzz
