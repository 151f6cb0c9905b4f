#include "world/tile_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "core/hash.h"
#include "world/deflated.h"
#include "world/objects_file.h"

// Layout, little-endian:
//    0  "TCTILE", u16 version
//    8  u64 XXH3 of every byte from 16 to the end
//   16  i32 level, x, y, number of samples along a side
//   32  f64 world z of the centre, m
//   40  i32 lowest, i32 highest height step
//   48  i32 highest height step of the tile's objects, -2^31 without such; u32 bytes of the objects,
//       inflated
//   56  6 x u32 deflated size: heights, cover, moisture, source, water depth, objects
//   80  the layers; that of the depth of water is absent, 0 bytes, where there is no water, that of the
//       objects where there are none
// Heights, and depths: each is predicted from its west, south and south-west neighbours as W + S - SW (a
// plane); the residuals, zigzag coded, are split into four byte planes, lowest first. The other
// layers: difference to the western neighbour, modulo 256. The objects: objects_file.cpp.

namespace terracast::world {
namespace {

using core::ErrorKind;
using core::fail;

static_assert(std::endian::native == std::endian::little, "tile files are little-endian");

constexpr std::array<char, 6> kMagic = {'T', 'C', 'T', 'I', 'L', 'E'};
constexpr std::size_t kHashedFrom = 16;
constexpr std::size_t kHeaderBytes = 80;
constexpr std::size_t kNumSamples = static_cast<std::size_t>(kTileSamples) * kTileSamples;
constexpr std::size_t kNumLayers = 6;
constexpr std::size_t kWaterDepthLayer = 4;
constexpr std::size_t kObjectsLayer = 5;
constexpr std::size_t kMaxObjectsBytes = std::size_t{1} << 30;
/// Half steps of heights within this are exact in float: 2^23 steps are 2^24 half steps, 8192 m.
constexpr std::int32_t kMaxSteps = 1 << 23;

struct Header {
  std::array<char, 6> magic = kMagic;
  std::uint16_t version = kTileFileVersion;
  std::uint64_t checksum = 0;
  std::int32_t level = 0;
  std::int32_t x = 0;
  std::int32_t y = 0;
  std::int32_t num_samples = kTileSamples;
  double center_z_m = 0.0;
  std::int32_t lowest_steps = 0;
  std::int32_t highest_steps = 0;
  std::int32_t objects_top_steps = Tile::kNoObjects;
  std::uint32_t objects_bytes = 0;
  std::array<std::uint32_t, kNumLayers> layer_bytes = {};
};
static_assert(sizeof(Header) == kHeaderBytes);

std::uint32_t predicted(const std::vector<std::uint32_t>& steps, int i, int j) {
  const std::size_t at = Tile::sample(i, j);
  if (i == 0 && j == 0) return 0;
  if (j == 0) return steps[at - 1];
  if (i == 0) return steps[at - kTileSamples];
  return steps[at - 1] + steps[at - kTileSamples] - steps[at - kTileSamples - 1];
}

std::vector<std::uint8_t> planes_from_heights(const std::vector<std::int32_t>& height_steps) {
  const std::vector<std::uint32_t> steps(height_steps.begin(), height_steps.end());
  std::vector<std::uint8_t> planes(4 * kNumSamples);
  for (int j = 0; j < kTileSamples; ++j) {
    for (int i = 0; i < kTileSamples; ++i) {
      const std::size_t at = Tile::sample(i, j);
      const std::uint32_t residual = steps[at] - predicted(steps, i, j);
      const std::uint32_t sign = (residual >> 31) != 0 ? 0xffffffffU : 0U;
      const std::uint32_t zigzag = (residual << 1) ^ sign;
      for (std::size_t plane = 0; plane < 4; ++plane)
        planes[plane * kNumSamples + at] = static_cast<std::uint8_t>(zigzag >> (8 * plane));
    }
  }
  return planes;
}

std::vector<std::int32_t> heights_from_planes(const std::vector<std::uint8_t>& planes) {
  std::vector<std::uint32_t> steps(kNumSamples);
  for (int j = 0; j < kTileSamples; ++j) {
    for (int i = 0; i < kTileSamples; ++i) {
      const std::size_t at = Tile::sample(i, j);
      std::uint32_t zigzag = 0;
      for (std::size_t plane = 0; plane < 4; ++plane)
        zigzag |= static_cast<std::uint32_t>(planes[plane * kNumSamples + at]) << (8 * plane);
      const std::uint32_t sign = (zigzag & 1U) != 0 ? 0xffffffffU : 0U;
      steps[at] = predicted(steps, i, j) + ((zigzag >> 1) ^ sign);
    }
  }
  std::vector<std::int32_t> height_steps(kNumSamples);
  std::transform(steps.begin(), steps.end(), height_steps.begin(),
                 [](std::uint32_t step) { return static_cast<std::int32_t>(step); });
  return height_steps;
}

std::vector<std::uint8_t> differences(const std::vector<std::uint8_t>& values) {
  std::vector<std::uint8_t> result(values.size());
  std::uint8_t last = 0;
  for (std::size_t at = 0; at < values.size(); ++at) {
    result[at] = static_cast<std::uint8_t>(values[at] - last);
    last = values[at];
  }
  return result;
}

std::vector<std::uint8_t> sums(std::vector<std::uint8_t> values) {
  std::uint8_t last = 0;
  for (std::uint8_t& value : values) last = value = static_cast<std::uint8_t>(value + last);
  return values;
}

std::vector<std::uint8_t> codes_of(const std::vector<Cover>& cover) {
  std::vector<std::uint8_t> codes(cover.size());
  std::transform(cover.begin(), cover.end(), codes.begin(),
                 [](Cover value) { return static_cast<std::uint8_t>(value); });
  return codes;
}

std::vector<Cover> cover_of(std::vector<std::uint8_t> layer, const std::string& file) {
  const std::vector<std::uint8_t> codes = sums(std::move(layer));
  if (std::any_of(codes.begin(), codes.end(), [](std::uint8_t code) { return code >= kNumCovers; }))
    fail(ErrorKind::Input, "{}: unknown code in the cover layer; tile the world again", file);
  std::vector<Cover> cover(codes.size());
  std::transform(codes.begin(), codes.end(), cover.begin(),
                 [](std::uint8_t code) { return static_cast<Cover>(code); });
  return cover;
}

Header read_header(std::span<const std::byte> bytes, const TileId& expected,
                   const std::string& file) {
  Header header;
  if (bytes.size() < sizeof header)
    fail(ErrorKind::Input,
         "{}: {} bytes are too few for a tile (at least {}); tile the world again", file,
         bytes.size(), sizeof header);
  std::memcpy(&header, bytes.data(), sizeof header);
  if (header.magic != kMagic)
    fail(ErrorKind::Input, "{}: not a tile (it does not start with TCTILE); tile the world again",
         file);
  if (header.version != kTileFileVersion)
    fail(ErrorKind::Input, "{}: tile format version {}, this build reads {}; tile the world again",
         file, header.version, kTileFileVersion);
  const std::uint64_t checksum = core::content_hash64(bytes.subspan(kHashedFrom));
  if (header.checksum != checksum)
    fail(ErrorKind::Input,
         "{}: damaged: checksum {:016x} where its content has {:016x}; tile the world again", file,
         header.checksum, checksum);
  const TileId id{header.level, header.x, header.y};
  if (id != expected)
    fail(ErrorKind::Input, "{}: holds tile {} where {} belongs; tile the world again", file,
         id.name(), expected.name());
  std::size_t total_bytes = sizeof header;
  for (const std::uint32_t layer_bytes : header.layer_bytes) total_bytes += layer_bytes;
  if (header.num_samples != kTileSamples || total_bytes != bytes.size())
    fail(ErrorKind::Input,
         "{}: {} samples a side and {} bytes, where {} samples and {} bytes would be right; tile "
         "the world again",
         file, header.num_samples, bytes.size(), kTileSamples, total_bytes);
  return header;
}

bool is_whole(double value_m) {
  return std::abs(value_m) < 1e7 && value_m == std::nearbyint(value_m);
}

bool is_near_middle(std::int32_t lowest_steps, std::int32_t highest_steps) {
  return std::abs(std::int64_t{lowest_steps} + highest_steps) * kHeightStep_m <=
         2.0 * kCenterReach_m;
}

/// None at all, or one of each sample, none above the sea.
bool are_depths(const std::vector<std::int32_t>& steps) {
  return steps.empty() || (steps.size() == kNumSamples &&
                           std::all_of(steps.begin(), steps.end(), [](std::int32_t depth) {
                             return depth >= 0 && depth <= 2 * kMaxSteps;
                           }));
}

}  // namespace

std::vector<std::byte> encode_tile(const Tile& tile) {
  TERRACAST_CHECK(tile.height_steps.size() == kNumSamples && tile.cover.size() == kNumSamples &&
                      tile.moisture.size() == kNumSamples && tile.source.size() == kNumSamples,
                  "tile {} has layers of another size than {}", tile.id.name(), kNumSamples);
  TERRACAST_CHECK(are_depths(tile.water_depth_steps), "tile {}: depths of water that are none",
                  tile.id.name());
  TERRACAST_CHECK(is_whole(tile.center_z_m), "tile {}: centre at {} m is not a whole number",
                  tile.id.name(), tile.center_z_m);
  const auto [lowest, highest] =
      std::minmax_element(tile.height_steps.begin(), tile.height_steps.end());
  TERRACAST_CHECK(is_near_middle(*lowest, *highest),
                  "tile {}: centre {} m from the middle of its heights", tile.id.name(),
                  0.5 * (1.0 * *lowest + *highest) * kHeightStep_m);
  TERRACAST_CHECK(*lowest >= -kMaxSteps && *highest <= kMaxSteps,
                  "tile {}: heights from {} to {} m about its centre; floats are exact to {} m",
                  tile.id.name(), *lowest * kHeightStep_m, *highest * kHeightStep_m,
                  kMaxSteps * kHeightStep_m);

  Header header;
  header.level = tile.id.level;
  header.x = tile.id.x;
  header.y = tile.id.y;
  header.center_z_m = tile.center_z_m;
  header.lowest_steps = *lowest;
  header.highest_steps = *highest;
  std::vector<std::byte> bytes(sizeof header);
  header.layer_bytes[0] = append_deflated(bytes, planes_from_heights(tile.height_steps));
  header.layer_bytes[1] = append_deflated(bytes, differences(codes_of(tile.cover)));
  header.layer_bytes[2] = append_deflated(bytes, differences(tile.moisture));
  header.layer_bytes[3] = append_deflated(bytes, differences(tile.source));
  if (!tile.water_depth_steps.empty())
    header.layer_bytes[kWaterDepthLayer] =
        append_deflated(bytes, planes_from_heights(tile.water_depth_steps));
  header.objects_top_steps = tile.objects_top_steps;
  if (!tile.objects.is_empty()) {
    const std::vector<std::uint8_t> objects = bytes_of_objects(tile.objects);
    TERRACAST_CHECK(objects.size() <= kMaxObjectsBytes, "tile {}: objects of {} bytes",
                    tile.id.name(), objects.size());
    header.objects_bytes = static_cast<std::uint32_t>(objects.size());
    header.layer_bytes[kObjectsLayer] = append_deflated(bytes, objects);
  }
  std::memcpy(bytes.data(), &header, sizeof header);
  header.checksum = core::content_hash64(std::span<const std::byte>(bytes).subspan(kHashedFrom));
  std::memcpy(bytes.data(), &header, sizeof header);
  return bytes;
}

Tile decode_tile(std::span<const std::byte> bytes, const TileId& expected, const std::string& file,
                 WaterDepth depth) {
  const Header header = read_header(bytes, expected, file);
  std::span<const std::byte> rest = bytes.subspan(sizeof header);
  const auto next_layer = [&](std::size_t layer, std::size_t num_bytes) {
    const std::span<const std::byte> deflated = rest.first(header.layer_bytes[layer]);
    rest = rest.subspan(header.layer_bytes[layer]);
    return inflated(deflated, num_bytes, file);
  };

  Tile tile;
  tile.id = expected;
  tile.center_z_m = header.center_z_m;
  tile.height_steps = heights_from_planes(next_layer(0, 4 * kNumSamples));
  tile.cover = cover_of(next_layer(1, kNumSamples), file);
  tile.moisture = sums(next_layer(2, kNumSamples));
  tile.source = sums(next_layer(3, kNumSamples));

  const auto [lowest, highest] =
      std::minmax_element(tile.height_steps.begin(), tile.height_steps.end());
  if (!is_whole(tile.center_z_m) || *lowest != header.lowest_steps ||
      *highest != header.highest_steps || *lowest < -kMaxSteps || *highest > kMaxSteps ||
      !is_near_middle(*lowest, *highest))
    fail(ErrorKind::Input,
         "{}: heights do not agree with the header's bounds; tile the world again", file);
  tile.objects_top_steps = header.objects_top_steps;
  if ((header.layer_bytes[kObjectsLayer] == 0) != (header.objects_bytes == 0))
    fail(ErrorKind::Input, "{}: objects of {} bytes in {}; tile the world again", file,
         header.objects_bytes, header.layer_bytes[kObjectsLayer]);
  if (header.layer_bytes[kObjectsLayer] != 0) {
    if (header.objects_bytes > kMaxObjectsBytes)
      fail(ErrorKind::Input, "{}: objects of {} bytes; tile the world again", file,
           header.objects_bytes);
    const std::span<const std::byte> deflated = bytes.last(header.layer_bytes[kObjectsLayer]);
    tile.objects = objects_from_bytes(inflated(deflated, header.objects_bytes, file), file);
  }
  if (depth == WaterDepth::Read && header.layer_bytes[kWaterDepthLayer] != 0) {
    tile.water_depth_steps = heights_from_planes(next_layer(kWaterDepthLayer, 4 * kNumSamples));
    if (!are_depths(tile.water_depth_steps))
      fail(ErrorKind::Input, "{}: depths of water that are none; tile the world again", file);
  }
  return tile;
}

std::vector<Cover> decode_cover(std::span<const std::byte> bytes, const TileId& expected,
                                const std::string& file) {
  const Header header = read_header(bytes, expected, file);
  const std::span<const std::byte> deflated =
      bytes.subspan(sizeof header + header.layer_bytes[0], header.layer_bytes[1]);
  return cover_of(inflated(deflated, kNumSamples, file), file);
}

std::size_t objects_bytes_of(std::span<const std::byte> bytes) {
  Header header;
  TERRACAST_CHECK(bytes.size() >= sizeof header, "{} bytes of a tile", bytes.size());
  std::memcpy(&header, bytes.data(), sizeof header);
  return header.objects_bytes;
}

}  // namespace terracast::world
