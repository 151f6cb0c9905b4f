#include "validate/oracle/shown_geometry.h"

#include <charconv>
#include <cmath>
#include <cstddef>
#include <string_view>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/json.h"
#include "core/printable.h"

namespace terracast::oracle {
namespace {

using core::ErrorKind;
using core::fail;
using core::Json;

constexpr int kVersion = 1;
constexpr std::size_t kMostTiles = (std::size_t{1} << 15) - 1;
/// Three numbers, a hash and what stands between, for each tile: 64 bytes would be many.
constexpr std::size_t kMostBytes = (kMostTiles + 100) * 96;
/// Of no world are tiles finer, coarser or farther.
constexpr int kFinestLevel = -10;
constexpr int kCoarsestLevel = 20;
constexpr int kFarthest = 1 << 24;

ShownTile tile_of(const std::string& text, const std::string& name) {
  ShownTile tile;
  std::string_view rest = text;
  const auto take = [&](int& number, char end, int least, int most) {
    const auto [stop, error] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
    if (error != std::errc() || stop == rest.data() + rest.size() || *stop != end ||
        number < least || number > most)
      fail(ErrorKind::Input, "{}: \"{}\" is not \"level/x/y hash\" of a tile", name,
           core::first_letters(text, 80));
    rest.remove_prefix(static_cast<std::size_t>(stop - rest.data()) + 1);
  };
  take(tile.key.level, '/', kFinestLevel, kCoarsestLevel);
  take(tile.key.x, '/', -kFarthest, kFarthest);
  take(tile.key.y, ' ', -kFarthest, kFarthest);
  if (rest.size() != 32 || rest.find_first_not_of("0123456789abcdef") != std::string_view::npos)
    fail(ErrorKind::Input, "{}: tile {} has no hash of 32 hexadecimal digits", name,
         tile.key.name());
  tile.content_hash = rest;
  return tile;
}

double positive(const Json& json, const char* member, const std::string& name) {
  const double value = json.at(member).number();
  if (!(value > 0.0) || !std::isfinite(value))
    fail(ErrorKind::Input, "{}: {} = {}; more than 0 is right", name, member, value);
  return value;
}

}  // namespace

ShownGeometry read_shown_geometry(const std::filesystem::path& file, const std::string& name) {
  const std::vector<std::byte> bytes = core::read_file(file, kMostBytes);
  const Json json = Json::parse({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, name);
  if (!json.is_object() || !json.has("format") ||
      json.at("format").string() != "terracast-geometry")
    fail(ErrorKind::Input, "{}: not a terracast-geometry", name);
  if (const std::int64_t version = json.at("version").integer(); version != kVersion)
    fail(ErrorKind::Input, "{}: version {}; this program reads version {}", name, version,
         kVersion);
  ShownGeometry geometry{.cell_px = positive(json, "cell_px", name),
                         .finest_spacing_m = positive(json, "finest_spacing_m", name),
                         .tiles = {}};
  for (const std::string& tile : json.at("tiles").strings())
    geometry.tiles.push_back(tile_of(tile, name));
  if (geometry.tiles.empty() || geometry.tiles.size() > kMostTiles)
    fail(ErrorKind::Input, "{}: {} tiles; 1 to {} are right", name, geometry.tiles.size(),
         kMostTiles);
  return geometry;
}

}  // namespace terracast::oracle
