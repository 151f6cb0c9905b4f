#include "tiler/kept_ground.h"

#include <bit>
#include <cmath>
#include <cstdint>

#include "core/atomic_file.h"
#include "core/error.h"
#include "world/byte_stream.h"
#include "world/sealed_file.h"

namespace terracast::tiler {
namespace {

constexpr const char* kGroundFile = "ground.bin";
constexpr std::size_t kMaxFileBytes = std::size_t{1} << 30;
constexpr std::size_t kMaxHashLength = 64;
constexpr int kMaxSide = 1 << 14;
constexpr double kMaxHeight_m = 1e6;
// GeodesyCells chooses within these.
constexpr double kFinestNodes_m = 32.0;
constexpr double kCoarsestNodes_m = 512.0;

const world::SealedKind kKind = {.magic = {'T', 'C', 'G', 'R', 'N', 'D'},
                                 .version = 1,
                                 .most_bytes = std::size_t{1} << 31,
                                 .what = "the ground of a world"};

void put_text(world::ByteWriter& writer, const std::string& text) {
  writer.put_count(text.size());
  for (const char letter : text) writer.put(letter);
}

std::string text_of(world::ByteReader& reader) {
  const std::size_t size = reader.get_count(1);
  if (size > kMaxHashLength) reader.refuse("a hash is too long");
  std::string text;
  for (std::size_t i = 0; i < size; ++i) text += reader.get<char>();
  return text;
}

/// Neighbours' bits differ little: what they differ by deflates far better, byte by byte.
void put_heights(world::ByteWriter& writer, const std::vector<float>& heights_m) {
  for (int byte = 0; byte < 4; ++byte) {
    std::uint32_t previous = 0;
    for (const float height_m : heights_m) {
      const auto bits = std::bit_cast<std::uint32_t>(height_m);
      writer.put(static_cast<std::uint8_t>((bits - previous) >> (8 * byte)));
      previous = bits;
    }
  }
}

std::vector<float> heights_of(world::ByteReader& reader, std::size_t count) {
  std::vector<std::uint32_t> steps(count, 0);
  for (int byte = 0; byte < 4; ++byte)
    for (std::uint32_t& step : steps)
      step |= std::uint32_t{reader.get<std::uint8_t>()} << (8 * byte);
  std::vector<float> heights_m(count);
  std::uint32_t bits = 0;
  for (std::size_t i = 0; i < count; ++i) {
    bits += steps[i];
    heights_m[i] = std::bit_cast<float>(bits);
    if (!(std::abs(heights_m[i]) <= static_cast<float>(kMaxHeight_m)))
      reader.refuse("a height is none");
  }
  return heights_m;
}

KeptLand land_of(world::ByteReader& reader) {
  KeptLand land;
  land.input_hash = text_of(reader);
  const auto width = reader.get<std::int32_t>();
  const auto height = reader.get<std::int32_t>();
  const std::size_t count = reader.get_count(4);
  if (width < 1 || height < 1 || width > kMaxSide || height > kMaxSide ||
      count != static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    reader.refuse("a land has another size than it says");
  land.heights_m.width = width;
  land.heights_m.height = height;
  land.heights_m.values = heights_of(reader, count);
  return land;
}

double number_of(world::ByteReader& reader, double lowest, double highest) {
  const auto value = reader.get<double>();
  if (!(value >= lowest && value <= highest)) reader.refuse("a number is out of bounds");
  return value;
}

KeptGround decoded(std::span<const std::byte> bytes, const std::string& file) {
  const std::vector<std::uint8_t> content = world::unsealed(kKind, bytes, file);
  world::ByteReader reader(content, file);
  KeptGround ground;
  ground.input_hash = text_of(reader);
  ground.lowest_m = number_of(reader, -kMaxHeight_m, kMaxHeight_m);
  ground.highest_m = number_of(reader, ground.lowest_m, kMaxHeight_m);
  ground.node_spacing_m = number_of(reader, kFinestNodes_m, kCoarsestNodes_m);
  ground.largest_probe_error_m = number_of(reader, 0.0, kMaxHeight_m);
  const std::size_t num_lands = reader.get_count(1);
  for (std::size_t i = 0; i < num_lands; ++i) ground.lands.push_back(land_of(reader));
  if (!reader.is_at_end()) reader.refuse("it goes on behind its end");
  return ground;
}

}  // namespace

void write_kept_ground(const std::filesystem::path& store, const KeptGround& ground) {
  world::ByteWriter writer;
  put_text(writer, ground.input_hash);
  writer.put(ground.lowest_m);
  writer.put(ground.highest_m);
  writer.put(ground.node_spacing_m);
  writer.put(ground.largest_probe_error_m);
  writer.put_count(ground.lands.size());
  for (const KeptLand& land : ground.lands) {
    put_text(writer, land.input_hash);
    writer.put(std::int32_t{land.heights_m.width});
    writer.put(std::int32_t{land.heights_m.height});
    writer.put_count(land.heights_m.values.size());
    put_heights(writer, land.heights_m.values);
  }
  core::write_file(store / kGroundFile, world::sealed(kKind, writer.bytes()));
}

std::optional<KeptGround> read_kept_ground(const std::filesystem::path& store,
                                           const core::Log& log) {
  if (store.empty()) return std::nullopt;
  const std::filesystem::path file = store / kGroundFile;
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return std::nullopt;
  try {
    return decoded(core::read_file(file, kMaxFileBytes), file.string());
  } catch (const core::Error& error) {
    if (error.kind() != core::ErrorKind::Input) throw;
    log.warn("{}: it is left aside, and the ground is made again", error.message());
    return std::nullopt;
  }
}

}  // namespace terracast::tiler
