#include "world/tile_store.h"

#include <algorithm>
#include <limits>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/image_io.h"
#include "core/json.h"
#include "world/manifest_parts.h"
#include "world/objects_file.h"
#include "world/tile_file.h"

namespace terracast::world {
namespace {

using core::ErrorKind;
using core::fail;
using core::Json;

constexpr int kManifestVersion = 3;
constexpr const char* kManifestName = "manifest.json";
/// No tile of a level within these has a side that a double, or an int32 address, could not hold.
constexpr int kFinestLevel = -10;
constexpr int kCoarsestLevel = 20;
constexpr std::int32_t kMaxAddress = 1 << 24;
constexpr double kMaxHeight_m = 1e6;
constexpr std::size_t kMaxTileBytes = std::size_t{1} << 30;
constexpr std::size_t kMaxLayers = 250;
constexpr std::size_t kMaxPrototypes = 65535;
constexpr std::size_t kMaxTextures = 65535;
/// Textures are written once and read often.
constexpr int kTexturePngLevel = 7;

Json json_of(const SourceInfo& source) {
  Json json = Json::object();
  json.set("name", source.name)
      .set("kind", source.kind)
      .set("horizontal_crs", source.horizontal_crs)
      .set("vertical_datum", source.vertical_datum)
      .set("pipeline", source.pipeline)
      .set("spacing_m", source.spacing_m)
      .set("content_hash", source.content_hash)
      .set("licence", source.licence)
      .set("accuracy", source.accuracy)
      .set("num_voids", source.num_voids)
      .set("num_voids_filled", source.num_voids_filled);
  if (!source.ledger.is_empty()) json.set("ledger", source.ledger.json());
  return json;
}

SourceInfo source_of(const Json& json) {
  SourceInfo source;
  source.name = json.at("name").string();
  source.kind = json.at("kind").string();
  source.horizontal_crs = json.at("horizontal_crs").string();
  source.vertical_datum = json.at("vertical_datum").string();
  source.pipeline = json.at("pipeline").string();
  source.spacing_m = json.at("spacing_m").number();
  source.content_hash = json.at("content_hash").string();
  source.licence = json.at("licence").string();
  source.accuracy = json.at("accuracy").string();
  source.num_voids = json.at("num_voids").integer();
  source.num_voids_filled = json.at("num_voids_filled").integer();
  if (json.has("ledger")) source.ledger = core::Ledger::of(json.at("ledger"));
  return source;
}

Json json_of(const LayerInfo& layer) {
  Json counts = Json::object();
  for (const auto& [what, count] : layer.counts) counts.set(what, count);
  Json json = Json::object();
  json.set("name", layer.name)
      .set("kind", layer.kind)
      .set("source", layer.source)
      .set("content_hash", layer.content_hash)
      .set("licence", layer.licence)
      .set("accuracy", layer.accuracy)
      .set("counts", std::move(counts));
  if (!layer.ledger.is_empty()) json.set("ledger", layer.ledger.json());
  return json;
}

LayerInfo layer_of(const Json& json) {
  LayerInfo layer;
  layer.name = json.at("name").string();
  layer.kind = json.at("kind").string();
  layer.source = json.at("source").string();
  layer.content_hash = json.at("content_hash").string();
  layer.licence = json.at("licence").string();
  layer.accuracy = json.at("accuracy").string();
  for (const auto& [what, count] : json.at("counts").members())
    layer.counts.emplace_back(what, count.integer());
  if (json.has("ledger")) layer.ledger = core::Ledger::of(json.at("ledger"));
  return layer;
}

Json json_of(const TileInfo& tile) {
  Json json = Json::object();
  json.set("level", tile.id.level)
      .set("x", tile.id.x)
      .set("y", tile.id.y)
      .set("lowest_z_world_m", tile.lowest_z_world)
      .set("highest_z_world_m", tile.highest_z_world)
      .set("num_bytes", tile.num_bytes)
      .set("objects_bytes", tile.objects_bytes)
      .set("content_hash", tile.content_hash);
  return json;
}

Json json_of(const PrototypeInfo& prototype) {
  Json json = Json::object();
  json.set("name", prototype.name).set("content_hash", prototype.content_hash);
  if (prototype.is_model) json.set("is_model", true);
  return json;
}

PrototypeInfo prototype_of(const Json& json) {
  return {.name = json.at("name").string(),
          .content_hash = json.at("content_hash").string(),
          .is_model = json.has("is_model") && json.at("is_model").boolean()};
}

Json json_of(const TextureInfo& texture) {
  Json json = Json::object();
  json.set("name", texture.name)
      .set("width_px", texture.width_px)
      .set("height_px", texture.height_px)
      .set("channels", texture.channels)
      .set("content_hash", texture.content_hash);
  return json;
}

std::int32_t integer_within(const Json& json, const char* member, std::int64_t lowest,
                            std::int64_t highest) {
  const std::int64_t value = json.at(member).integer();
  if (value < lowest || value > highest)
    fail(ErrorKind::Input, "{} = {} is outside {} to {}", member, value, lowest, highest);
  return static_cast<std::int32_t>(value);
}

double number_within(const Json& json, const char* member, double lowest, double highest) {
  const double value = json.at(member).number();
  if (!(value >= lowest && value <= highest))
    fail(ErrorKind::Input, "{} = {} is outside {} to {}", member, value, lowest, highest);
  return value;
}

std::uint64_t unsigned_of(const Json& json, const char* member) {
  return static_cast<std::uint64_t>(
      integer_within(json, member, 0, std::numeric_limits<std::int32_t>::max()));
}

TextureInfo texture_of(const Json& json) {
  TextureInfo texture;
  texture.name = json.at("name").string();
  texture.width_px = integer_within(json, "width_px", 1, kMaxTextureSide_px);
  texture.height_px = integer_within(json, "height_px", 1, kMaxTextureSide_px);
  texture.channels = integer_within(json, "channels", 3, 4);
  texture.content_hash = json.at("content_hash").string();
  check_texture(texture.name, texture.width_px, texture.height_px, texture.channels);
  return texture;
}

TileInfo tile_info_of(const Json& json) {
  TileInfo tile;
  tile.id.level = integer_within(json, "level", kFinestLevel, kCoarsestLevel);
  tile.id.x = integer_within(json, "x", -kMaxAddress, kMaxAddress);
  tile.id.y = integer_within(json, "y", -kMaxAddress, kMaxAddress);
  tile.lowest_z_world = number_within(json, "lowest_z_world_m", -kMaxHeight_m, kMaxHeight_m);
  tile.highest_z_world =
      number_within(json, "highest_z_world_m", tile.lowest_z_world, kMaxHeight_m);
  tile.num_bytes = unsigned_of(json, "num_bytes");
  tile.objects_bytes = unsigned_of(json, "objects_bytes");
  tile.content_hash = json.at("content_hash").string();
  return tile;
}

Json json_of(const WorldManifest& manifest) {
  Json origin = Json::object();
  origin.set("lat_deg", manifest.origin.lat_deg)
      .set("lon_deg", manifest.origin.lon_deg)
      .set("height_m", manifest.origin.height_m);
  Json sources = Json::array();
  for (const SourceInfo& source : manifest.sources) sources.push(json_of(source));
  Json layers = Json::array();
  for (const LayerInfo& layer : manifest.layers) layers.push(json_of(layer));
  Json prototypes = Json::array();
  for (const PrototypeInfo& prototype : manifest.prototypes) prototypes.push(json_of(prototype));
  Json textures = Json::array();
  for (const TextureInfo& texture : manifest.textures) textures.push(json_of(texture));
  Json imagery = Json::array();
  for (const ImageryInfo& one : manifest.imagery) imagery.push(json_of(one));
  Json volumes = Json::array();
  for (const VolumeInfo& volume : manifest.volumes) volumes.push(json_of(volume));
  Json volume_places = Json::array();
  for (const VolumePlace& place : manifest.volume_places) volume_places.push(json_of(place));
  Json tiles = Json::array();
  for (const TileInfo& tile : manifest.tiles) tiles.push(json_of(tile));
  Json json = Json::object();
  json.set("format", "terracast world")
      .set("version", kManifestVersion)
      .set("name", manifest.name)
      .set("input_hash", manifest.input_hash)
      .set("origin", std::move(origin))
      .set("size_m", manifest.size_m)
      .set("finest_level", manifest.finest_level)
      .set("base_level", manifest.base_level)
      .set("coarsest_level", manifest.coarsest_level)
      .set("measured_level", manifest.measured_level)
      .set("apron_radius_m", manifest.apron_radius_m)
      .set("outside", manifest.outside)
      // As text: JSON readers in other languages round integers above 2^53.
      .set("seed", std::to_string(manifest.seed))
      .set("sources", std::move(sources))
      .set("layers", std::move(layers))
      .set("prototypes", std::move(prototypes))
      .set("textures", std::move(textures))
      .set("imagery", std::move(imagery))
      .set("volumes", std::move(volumes))
      .set("volume_places", std::move(volume_places));
  if (!manifest.aridity_ledger.is_empty())
    json.set("aridity_ledger", manifest.aridity_ledger.json());
  if (manifest.ways.num_parts > 0)
    json.set("ways", std::move(Json::object()
                                   .set("num_parts", manifest.ways.num_parts)
                                   .set("content_hash", manifest.ways.content_hash)));
  json.set("tiles", std::move(tiles));
  return json;
}

std::uint64_t seed_of(const std::string& text) {
  std::uint64_t seed = 0;
  for (const char c : text) {
    const auto digit = static_cast<std::uint64_t>(c - '0');
    if (c < '0' || c > '9' || seed > (std::numeric_limits<std::uint64_t>::max() - digit) / 10)
      fail(ErrorKind::Input, "seed = \"{}\" is not a number of 64 bits", text);
    seed = 10 * seed + digit;
  }
  return seed;
}

WorldManifest manifest_of(const Json& json) {
  if (!json.is_object() || !json.has("format") || json.at("format").string() != "terracast world")
    fail(ErrorKind::Input, "not a terracast world");
  if (const std::int64_t version = json.at("version").integer(); version != kManifestVersion)
    fail(ErrorKind::Input, "world format version {}, this build reads {}", version,
         kManifestVersion);
  core::check_content_hash(json);
  WorldManifest manifest;
  manifest.name = json.at("name").string();
  manifest.input_hash = json.at("input_hash").string();
  const Json& origin = json.at("origin");
  manifest.origin = {.lat_deg = number_within(origin, "lat_deg", -90.0, 90.0),
                     .lon_deg = number_within(origin, "lon_deg", -360.0, 360.0),
                     .height_m = number_within(origin, "height_m", -kMaxHeight_m, kMaxHeight_m)};
  manifest.size_m = number_within(json, "size_m", 0.0, 1e8);
  manifest.coarsest_level = integer_within(json, "coarsest_level", kFinestLevel, kCoarsestLevel);
  manifest.finest_level =
      integer_within(json, "finest_level", kFinestLevel, manifest.coarsest_level);
  manifest.base_level = integer_within(json, "base_level", kFinestLevel, kCoarsestLevel);
  manifest.measured_level = integer_within(json, "measured_level", kFinestLevel, kCoarsestLevel);
  manifest.apron_radius_m = number_within(json, "apron_radius_m", 0.0, 1e8);
  manifest.outside = json.at("outside").string();
  manifest.seed = seed_of(json.at("seed").string());
  const Json& sources = json.at("sources");
  for (std::size_t i = 0; i < sources.size(); ++i)
    manifest.sources.push_back(source_of(sources.at(i)));
  const Json& layers = json.at("layers");
  if (layers.size() > kMaxLayers) fail(ErrorKind::Input, "{} layers", layers.size());
  for (std::size_t i = 0; i < layers.size(); ++i) manifest.layers.push_back(layer_of(layers.at(i)));
  if (json.has("aridity_ledger"))
    manifest.aridity_ledger = core::Ledger::of(json.at("aridity_ledger"));
  const Json& prototypes = json.at("prototypes");
  if (prototypes.size() > kMaxPrototypes)
    fail(ErrorKind::Input, "{} prototypes", prototypes.size());
  for (std::size_t i = 0; i < prototypes.size(); ++i)
    manifest.prototypes.push_back(prototype_of(prototypes.at(i)));
  const Json& textures = json.at("textures");
  if (textures.size() > kMaxTextures) fail(ErrorKind::Input, "{} textures", textures.size());
  for (std::size_t i = 0; i < textures.size(); ++i)
    manifest.textures.push_back(texture_of(textures.at(i)));
  if (num_bytes_of(manifest.textures) > kMaxTexturesBytes)
    fail(ErrorKind::Input, "its textures would take {} bytes of memory",
         num_bytes_of(manifest.textures));
  const auto check_layer = [&](int layer) {
    if (static_cast<std::size_t>(layer) >= manifest.layers.size())
      fail(ErrorKind::Input, "layer {} of {}", layer, manifest.layers.size());
  };
  const Json& imagery = json.at("imagery");
  if (imagery.size() > kMaxLayers) fail(ErrorKind::Input, "{} rows of imagery", imagery.size());
  for (std::size_t i = 0; i < imagery.size(); ++i) {
    manifest.imagery.push_back(imagery_of(imagery.at(i)));
    check_layer(manifest.imagery.back().layer);
  }
  const Json& volumes = json.at("volumes");
  std::size_t num_voxels = 0;
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    manifest.volumes.push_back(volume_of(volumes.at(i)));
    num_voxels += static_cast<std::size_t>(manifest.volumes.back().size.cast<double>().prod());
    if (num_voxels > kMaxVoxels) fail(ErrorKind::Input, "more than {} voxels", kMaxVoxels);
  }
  const Json& volume_places = json.at("volume_places");
  for (std::size_t i = 0; i < volume_places.size(); ++i) {
    manifest.volume_places.push_back(volume_place_of(volume_places.at(i)));
    const VolumePlace& place = manifest.volume_places.back();
    check_layer(place.layer);
    if (static_cast<std::size_t>(place.volume) >= manifest.volumes.size())
      fail(ErrorKind::Input, "volume {} of {}", place.volume, manifest.volumes.size());
  }
  if (json.has("ways"))
    manifest.ways = {.num_parts = integer_within(json.at("ways"), "num_parts", 1,
                                                 std::numeric_limits<std::int32_t>::max()),
                     .content_hash = json.at("ways").at("content_hash").string()};
  const Json& tiles = json.at("tiles");
  manifest.tiles.reserve(tiles.size());
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    manifest.tiles.push_back(tile_info_of(tiles.at(i)));
    if (i > 0 && !(manifest.tiles[i - 1].id < manifest.tiles[i].id))
      fail(ErrorKind::Input, "tile {} is listed twice or out of order",
           manifest.tiles[i].id.name());
  }
  return manifest;
}

TileInfo info_of(const Tile& tile, std::span<const std::byte> bytes) {
  return {.id = tile.id,
          .lowest_z_world = tile.lowest_z_world(),
          .highest_z_world = tile.highest_z_world(),
          .num_bytes = bytes.size(),
          .objects_bytes = objects_bytes_of(bytes),
          .content_hash = core::content_hash(bytes)};
}

std::filesystem::path prototype_path(const std::filesystem::path& store, std::size_t row) {
  return store / "prototypes" / fmt::format("{}.prototype", row);
}

std::filesystem::path texture_path(const std::filesystem::path& store, std::size_t row) {
  return store / "textures" / fmt::format("{}.png", row);
}

/// A tile and its manifest may each be whole, and not of one world.
void check_prototypes(const Tile& tile, std::size_t num_prototypes, const std::string& file) {
  for (const Instance& instance : tile.objects.instances)
    if (instance.prototype >= num_prototypes)
      fail(ErrorKind::Input,
           "{}: object {} is an instance of prototype {}, and {} lists {}; tile the world again",
           file, instance.provenance.instance_id, instance.prototype, kManifestName,
           num_prototypes);
}

[[noreturn]] void fail_not_listed(const std::filesystem::path& file, const TileInfo& info) {
  fail(ErrorKind::Input,
       "{}: a whole tile, but not the one that {} lists (hash {}); tile the world again",
       file.string(), kManifestName, info.content_hash);
}

}  // namespace

geo::Box3d TileInfo::box_world() const {
  const Eigen::Vector2d corner = id.corner_world();
  const double side_m = id.side_m();
  return {Eigen::Vector3d(corner.x(), corner.y(), lowest_z_world),
          Eigen::Vector3d(corner.x() + side_m, corner.y() + side_m, highest_z_world)};
}

TileStore TileStore::open(const std::filesystem::path& folder) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(folder, ignored))
    fail(ErrorKind::Io, "{}: no such world folder; give the folder that `terracast tile` made",
         folder.string());
  const std::filesystem::path file = folder / kManifestName;
  if (!std::filesystem::exists(file, ignored) &&
      std::filesystem::exists(folder / "world" / kManifestName, ignored))
    fail(ErrorKind::Input, "{}: no world, but one lies in it; give {}", folder.string(),
         (folder / "world").string());
  if (!std::filesystem::exists(file, ignored))
    fail(ErrorKind::Input,
         "{}: no {}: it is no world, or one whose tiling has not finished; give a world's folder, "
         "or "
         "run `terracast tile` again, which goes on where it stopped",
         folder.string(), kManifestName);
  TileStore store;
  store.folder_ = folder;
  const Json json = Json::read(file);
  store.manifest_ = core::with_context([&] { return manifest_of(json); },
                                       fmt::format("reading {} (if it is damaged, tile the world "
                                                   "again)",
                                                   file.string()));
  store.index_.reserve(store.manifest_.tiles.size());
  for (std::size_t i = 0; i < store.manifest_.tiles.size(); ++i)
    store.index_.emplace(store.manifest_.tiles[i].id, i);
  return store;
}

const TileInfo* TileStore::find(const TileId& id) const {
  const auto found = index_.find(id);
  return found == index_.end() ? nullptr : &manifest_.tiles[found->second];
}

const TileInfo& TileStore::listed(const TileId& id) const {
  const TileInfo* info = find(id);
  if (info == nullptr)
    fail(ErrorKind::Input, "{}: the world has no tile {}", folder_.string(), id.name());
  return *info;
}

Tile TileStore::load(const TileId& id, WaterDepth depth) const {
  const TileInfo& info = listed(id);
  const std::filesystem::path file = tile_path(folder_, id);
  const std::vector<std::byte> bytes = core::read_file(file, kMaxTileBytes);
  Tile tile = decode_tile(bytes, id, file.string(), depth);
  if (bytes.size() != info.num_bytes || core::content_hash(bytes) != info.content_hash ||
      objects_bytes_of(bytes) != info.objects_bytes ||
      tile.lowest_z_world() != info.lowest_z_world ||
      tile.highest_z_world() != info.highest_z_world)
    fail_not_listed(file, info);
  check_prototypes(tile, manifest_.prototypes.size(), file.string());
  return tile;
}

Prototype TileStore::load_prototype(std::size_t row) const {
  TERRACAST_CHECK(row < manifest_.prototypes.size(), "prototype {} of {}", row,
                  manifest_.prototypes.size());
  const std::filesystem::path file = prototype_path(folder_, row);
  const std::vector<std::byte> bytes = core::read_file(file, kMaxTileBytes);
  Prototype prototype = decode_prototype(bytes, file.string());
  const PrototypeInfo& info = manifest_.prototypes[row];
  if (core::content_hash(bytes) != info.content_hash)
    fail(ErrorKind::Input,
         "{}: a whole prototype, but not the one that {} lists (hash {}); tile the world again",
         file.string(), kManifestName, info.content_hash);
  prototype.is_model = info.is_model;
  return prototype;
}

Texture TileStore::load_texture(std::size_t row) const {
  TERRACAST_CHECK(row < manifest_.textures.size(), "texture {} of {}", row,
                  manifest_.textures.size());
  const std::filesystem::path file = texture_path(folder_, row);
  const TextureInfo& info = manifest_.textures[row];
  const std::vector<std::byte> bytes = core::read_file(file, kMaxTileBytes);
  if (core::content_hash(bytes) != info.content_hash)
    fail(ErrorKind::Input,
         "{}: damaged, or not the texture that {} lists (hash {}); tile the world again",
         file.string(), kManifestName, info.content_hash);
  auto image = core::decode_png(bytes, file.string(), kMaxTexturePixels);
  auto* pixels = std::get_if<core::Image8>(&image);
  if (pixels == nullptr || pixels->width() != info.width_px || pixels->height() != info.height_px ||
      pixels->channels() != info.channels)
    fail(ErrorKind::Input, "{}: not of the size and channels that {} says; tile the world again",
         file.string(), kManifestName);
  return {.name = info.name, .image = std::move(*pixels)};
}

std::filesystem::path tile_path(const std::filesystem::path& store, const TileId& id) {
  return store / "tiles" / std::to_string(id.level) / fmt::format("{}_{}.tile", id.x, id.y);
}

TileInfo write_tile(const std::filesystem::path& store, const Tile& tile) {
  const std::vector<std::byte> bytes = encode_tile(tile);
  core::write_file(tile_path(store, tile.id), bytes);
  return info_of(tile, bytes);
}

PrototypeInfo write_prototype(const std::filesystem::path& store, std::size_t row,
                              const Prototype& prototype) {
  const std::vector<std::byte> bytes = encode_prototype(prototype);
  core::write_file(prototype_path(store, row), bytes);
  return {.name = prototype.name,
          .content_hash = core::content_hash(bytes),
          .is_model = prototype.is_model};
}

TextureInfo write_texture(const std::filesystem::path& store, std::size_t row,
                          const Texture& texture) {
  const core::Image8& image = texture.image;
  check_texture(texture.name, image.width(), image.height(), image.channels());
  const std::vector<std::byte> bytes = core::encode_png(image, kTexturePngLevel);
  core::write_file(texture_path(store, row), bytes);
  return {.name = texture.name,
          .width_px = image.width(),
          .height_px = image.height(),
          .channels = image.channels(),
          .content_hash = core::content_hash(bytes)};
}

std::size_t num_bytes_of(const std::vector<TextureInfo>& textures) {
  std::size_t bytes = 0;
  for (const TextureInfo& texture : textures)
    bytes += mip_bytes(texture.width_px, texture.height_px, texture.channels);
  return bytes;
}

std::optional<TileInfo> inspect_tile(const std::filesystem::path& store, const TileId& id) {
  const std::filesystem::path file = tile_path(store, id);
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return std::nullopt;
  try {
    const std::vector<std::byte> bytes = core::read_file(file, kMaxTileBytes);
    return info_of(decode_tile(bytes, id, file.string()), bytes);
  } catch (const core::Error& error) {
    if (error.kind() == ErrorKind::Input) return std::nullopt;
    throw;
  }
}

void write_manifest(const std::filesystem::path& store, WorldManifest manifest) {
  std::sort(manifest.tiles.begin(), manifest.tiles.end(),
            [](const TileInfo& a, const TileInfo& b) { return a.id < b.id; });
  Json json = json_of(manifest);
  core::add_content_hash(json);
  json.write(store / kManifestName, 1);
}

}  // namespace terracast::world
