#include "world/manifest_parts.h"

#include <cmath>
#include <limits>

#include "core/error.h"
#include "world/volume.h"

namespace terracast::world {
namespace {

using core::ErrorKind;
using core::fail;
using core::Json;

/// No tile of a level within these has a side or an address that is out of hand.
constexpr int kFinestImagery = -8;
constexpr int kCoarsestImagery = 20;
constexpr int kMaxAddress = 1 << 24;
constexpr std::size_t kMaxImagerySources = 1 << 20;
constexpr int kMaxRows = 1 << 20;

int integer_within(const Json& json, const char* member, std::int64_t lowest,
                   std::int64_t highest) {
  const std::int64_t value = json.at(member).integer();
  if (value < lowest || value > highest)
    fail(ErrorKind::Input, "{} = {} is outside {} to {}", member, value, lowest, highest);
  return static_cast<int>(value);
}

double number_within(const Json& json, const char* member, double lowest, double highest) {
  const double value = json.at(member).number();
  if (!(value >= lowest && value <= highest))
    fail(ErrorKind::Input, "{} = {} is outside {} to {}", member, value, lowest, highest);
  return value;
}

}  // namespace

Json json_of(const ImageryInfo& imagery) {
  Json sources = Json::array();
  for (const std::string& source : imagery.sources) sources.push(source);
  Json tiles = Json::array();
  for (const ImageryTileInfo& tile : imagery.tiles) {
    Json shown = Json::array();
    for (const int source : tile.sources) shown.push(source);
    tiles.push(std::move(Json::object()
                             .set("level", tile.id.level)
                             .set("x", tile.id.x)
                             .set("y", tile.id.y)
                             .set("sources", std::move(shown))
                             .set("num_bytes", tile.num_bytes)
                             .set("content_hash", tile.content_hash)));
  }
  return std::move(Json::object()
                       .set("layer", imagery.layer)
                       .set("finest_level", imagery.finest_level)
                       .set("coarsest_level", imagery.coarsest_level)
                       .set("sources", std::move(sources))
                       .set("tiles", std::move(tiles)));
}

ImageryInfo imagery_of(const Json& json) {
  ImageryInfo imagery;
  imagery.layer = integer_within(json, "layer", 0, kMaxRows);
  imagery.coarsest_level = integer_within(json, "coarsest_level", kFinestImagery, kCoarsestImagery);
  imagery.finest_level =
      integer_within(json, "finest_level", kFinestImagery, imagery.coarsest_level);
  const Json& sources = json.at("sources");
  if (sources.size() > kMaxImagerySources)
    fail(ErrorKind::Input, "{} sources of imagery", sources.size());
  for (std::size_t i = 0; i < sources.size(); ++i)
    imagery.sources.push_back(sources.at(i).string());
  const Json& tiles = json.at("tiles");
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    const Json& one = tiles.at(i);
    ImageryTileInfo tile;
    tile.id.level = integer_within(one, "level", imagery.finest_level, imagery.coarsest_level);
    tile.id.x = integer_within(one, "x", -kMaxAddress, kMaxAddress);
    tile.id.y = integer_within(one, "y", -kMaxAddress, kMaxAddress);
    const Json& shown = one.at("sources");
    for (std::size_t k = 0; k < shown.size(); ++k) {
      const std::int64_t source = shown.at(k).integer();
      if (source < 0 || source >= static_cast<std::int64_t>(imagery.sources.size()))
        fail(ErrorKind::Input, "a tile of imagery shows source {} of {}", source,
             imagery.sources.size());
      tile.sources.push_back(static_cast<int>(source));
    }
    tile.num_bytes = static_cast<std::uint64_t>(
        integer_within(one, "num_bytes", 0, std::numeric_limits<std::int32_t>::max()));
    tile.content_hash = one.at("content_hash").string();
    if (i > 0 && !(imagery.tiles.back().id < tile.id))
      fail(ErrorKind::Input, "tile {}/{}_{} of imagery is listed twice or out of order",
           tile.id.level, tile.id.x, tile.id.y);
    imagery.tiles.push_back(std::move(tile));
  }
  return imagery;
}

Json json_of(const VolumeInfo& volume) {
  return std::move(Json::object()
                       .set("name", volume.name)
                       .set("size", Json::array_of({static_cast<double>(volume.size.x()),
                                                    static_cast<double>(volume.size.y()),
                                                    static_cast<double>(volume.size.z())}))
                       .set("content_hash", volume.content_hash));
}

VolumeInfo volume_of(const Json& json) {
  VolumeInfo volume;
  volume.name = json.at("name").string();
  const std::vector<double> size = json.at("size").numbers();
  if (size.size() != 3) fail(ErrorKind::Input, "a volume with {} sides", size.size());
  for (std::size_t k = 0; k < 3; ++k) {
    if (!(size[k] >= 1.0 && size[k] <= kMaxVolumeSide))
      fail(ErrorKind::Input, "a volume of {} voxels a side", size[k]);
    volume.size[static_cast<int>(k)] = static_cast<int>(size[k]);
  }
  check_volume(volume.name, volume.size);
  volume.content_hash = json.at("content_hash").string();
  return volume;
}

Json json_of(const VolumePlace& place) {
  const Eigen::Vector3d& at = place.place_world;
  return std::move(Json::object()
                       .set("volume", place.volume)
                       .set("layer", place.layer)
                       .set("place_world", Json::array_of({at.x(), at.y(), at.z()}))
                       .set("heading_rad", place.heading_rad)
                       .set("scale", place.scale)
                       .set("extinction_per_m", place.extinction_per_m)
                       .set("albedo", place.albedo)
                       .set("anisotropy", place.anisotropy));
}

VolumePlace volume_place_of(const Json& json) {
  VolumePlace place;
  place.volume = integer_within(json, "volume", 0, kMaxRows);
  place.layer = integer_within(json, "layer", 0, kMaxRows);
  const std::vector<double> at = json.at("place_world").numbers();
  if (at.size() != 3) fail(ErrorKind::Input, "a place of {} coordinates", at.size());
  for (std::size_t k = 0; k < 3; ++k) {
    if (!(std::abs(at[k]) <= 1e8)) fail(ErrorKind::Input, "a volume at {} m", at[k]);
    place.place_world[static_cast<int>(k)] = at[k];
  }
  place.heading_rad = number_within(json, "heading_rad", -10.0, 10.0);
  place.scale = number_within(json, "scale", 1e-3, 1e3);
  place.extinction_per_m = number_within(json, "extinction_per_m", 0.0, 1e3);
  place.albedo = number_within(json, "albedo", 0.0, 1.0);
  place.anisotropy = number_within(json, "anisotropy", -0.99, 0.99);
  return place;
}

}  // namespace terracast::world
