#include "world/raster_info.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <variant>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/image_io.h"
#include "core/json.h"
#include "core/png_rows.h"
#include "world/tile.h"
#include "world/tile_store.h"

namespace terracast::world {
namespace {

using core::ErrorKind;
using core::fail;
using core::Json;

constexpr int kRastersVersion = 1;
constexpr const char* kRastersName = "rasters.json";
constexpr int kPngLevel = 7;
/// GDAL counts no more pixels a side.
constexpr std::int64_t kMaxSide_px = 2147483647;
constexpr double kMaxBorder_px = 8.0;

std::filesystem::path covers_path(const std::filesystem::path& store, std::size_t layer,
                                  std::size_t raster) {
  return store / "land_cover" / fmt::format("{}_{}.png", layer, raster);
}

Json json_of(const RasterInfo& raster) {
  return Json::object()
      .set("name", raster.name)
      .set("horizontal_crs", raster.horizontal_crs)
      .set("pipeline", raster.pipeline)
      .set("is_geographic", raster.is_geographic)
      .set("geotransform", Json::array_of(std::vector<double>(raster.geotransform.begin(),
                                                              raster.geotransform.end())))
      .set("width_px", raster.width_px)
      .set("height_px", raster.height_px);
}

int integer_within(const Json& json, const char* member, std::int64_t lowest,
                   std::int64_t highest) {
  const std::int64_t value = json.at(member).integer();
  if (value < lowest || value > highest)
    fail(ErrorKind::Input, "{} = {} is outside {} to {}", member, value, lowest, highest);
  return static_cast<int>(value);
}

RasterInfo raster_of(const Json& json) {
  RasterInfo raster;
  raster.name = json.at("name").string();
  raster.horizontal_crs = json.at("horizontal_crs").string();
  raster.pipeline = json.at("pipeline").string();
  raster.is_geographic = json.at("is_geographic").boolean();
  const std::vector<double> numbers = json.at("geotransform").numbers();
  if (numbers.size() != raster.geotransform.size())
    fail(ErrorKind::Input, "a geotransform of {} numbers; six are right", numbers.size());
  std::copy(numbers.begin(), numbers.end(), raster.geotransform.begin());
  const double determinant = numbers[1] * numbers[5] - numbers[2] * numbers[4];
  if (!(std::abs(determinant) > 0.0) || !std::isfinite(numbers[0] + numbers[3] + determinant))
    fail(ErrorKind::Input, "the geotransform of {} cannot be inverted", raster.name);
  raster.width_px = integer_within(json, "width_px", 1, kMaxSide_px);
  raster.height_px = integer_within(json, "height_px", 1, kMaxSide_px);
  return raster;
}

Json json_of(const CoverRasterInfo& cover, const std::string& content_hash) {
  Json json = Json::object();
  json.set("raster", json_of(cover.raster))
      .set("border_px", cover.border_px)
      .set("first_column", cover.first_column)
      .set("first_row", cover.first_row)
      .set("num_columns", cover.num_columns)
      .set("num_rows", cover.num_rows);
  if (!content_hash.empty()) json.set("content_hash", content_hash);
  return json;
}

CoverRasterInfo cover_of(const Json& json) {
  CoverRasterInfo cover;
  cover.raster = raster_of(json.at("raster"));
  cover.border_px = json.at("border_px").number();
  if (!(cover.border_px >= 0.0 && cover.border_px <= kMaxBorder_px))
    fail(ErrorKind::Input, "border_px = {} is outside 0 to {}", cover.border_px, kMaxBorder_px);
  cover.first_column = integer_within(json, "first_column", 0, kMaxSide_px);
  cover.first_row = integer_within(json, "first_row", 0, kMaxSide_px);
  cover.num_columns = integer_within(json, "num_columns", 0, kMaxSide_px);
  cover.num_rows = integer_within(json, "num_rows", 0, kMaxSide_px);
  if (std::int64_t{cover.num_columns} * cover.num_rows > kMaxCoverPixels)
    fail(ErrorKind::Input, "{} x {} pixels of land cover are more than the {} that a world takes",
         cover.num_columns, cover.num_rows, kMaxCoverPixels);
  return cover;
}

Json read_json(const TileStore& store) {
  Json json = Json::read(store.folder() / kRastersName);
  core::with_context(
      [&] {
        if (!json.is_object() || !json.has("format") ||
            json.at("format").string() != "terracast rasters")
          fail(ErrorKind::Input, "not the rasters of a terracast world");
        if (const std::int64_t version = json.at("version").integer(); version != kRastersVersion)
          fail(ErrorKind::Input, "version {}, this build reads {}", version, kRastersVersion);
        core::check_content_hash(json);
        if (json.at("input_hash").string() != store.manifest().input_hash)
          fail(ErrorKind::Input, "of another world (hash {}) than its manifest ({})",
               json.at("input_hash").string(), store.manifest().input_hash);
      },
      fmt::format("reading {} (tile the world again)", (store.folder() / kRastersName).string()));
  return json;
}

void check_rows(const Json& json, const char* member, std::size_t expected) {
  if (json.at(member).size() != expected)
    fail(ErrorKind::Input, "{} of {} rows, and the manifest has {}", member, json.at(member).size(),
         expected);
}

WorldRasters rasters_of(const Json& json, const WorldManifest& manifest) {
  check_rows(json, "sources", manifest.sources.size());
  check_rows(json, "land_cover", manifest.layers.size());
  check_rows(json, "imagery", manifest.imagery.size());
  WorldRasters rasters;
  for (std::size_t row = 0; row < manifest.sources.size(); ++row) {
    const Json& one = json.at("sources").at(row);
    rasters.sources.push_back(one.is_null() ? std::nullopt : std::optional(raster_of(one)));
  }
  for (std::size_t row = 0; row < manifest.layers.size(); ++row) {
    const Json& all = json.at("land_cover").at(row);
    rasters.land_cover.emplace_back();
    for (std::size_t i = 0; i < all.size(); ++i)
      rasters.land_cover.back().push_back(cover_of(all.at(i)));
  }
  for (std::size_t row = 0; row < manifest.imagery.size(); ++row) {
    const Json& all = json.at("imagery").at(row);
    if (all.size() != manifest.imagery[row].sources.size())
      fail(ErrorKind::Input, "imagery {} of {} files, and the manifest has {}", row, all.size(),
           manifest.imagery[row].sources.size());
    rasters.imagery.emplace_back();
    for (std::size_t i = 0; i < all.size(); ++i)
      rasters.imagery.back().push_back(raster_of(all.at(i)));
  }
  return rasters;
}

}  // namespace

void write_rasters(const std::filesystem::path& store, const std::string& input_hash,
                   const WorldRasters& rasters, const CoverRows& cover_rows) {
  Json sources = Json::array();
  for (const auto& raster : rasters.sources) sources.push(raster ? json_of(*raster) : Json());
  Json land_cover = Json::array();
  for (std::size_t layer = 0; layer < rasters.land_cover.size(); ++layer) {
    Json all = Json::array();
    for (std::size_t i = 0; i < rasters.land_cover[layer].size(); ++i) {
      const CoverRasterInfo& cover = rasters.land_cover[layer][i];
      std::string hash;
      if (cover.num_columns > 0 && cover.num_rows > 0) {
        const std::vector<std::byte> bytes = core::encode_png_rows(
            cover.num_columns, cover.num_rows,
            [&](int row, std::span<std::uint8_t> covers) { cover_rows(layer, i, row, covers); },
            kPngLevel);
        core::write_file(covers_path(store, layer, i), bytes);
        hash = core::content_hash(bytes);
      }
      all.push(json_of(cover, hash));
    }
    land_cover.push(std::move(all));
  }
  Json imagery = Json::array();
  for (const auto& files : rasters.imagery) {
    Json all = Json::array();
    for (const RasterInfo& raster : files) all.push(json_of(raster));
    imagery.push(std::move(all));
  }
  Json json = Json::object();
  json.set("format", "terracast rasters")
      .set("version", kRastersVersion)
      .set("input_hash", input_hash)
      .set("sources", std::move(sources))
      .set("land_cover", std::move(land_cover))
      .set("imagery", std::move(imagery));
  core::add_content_hash(json);
  json.write(store / kRastersName, 1);
}

std::optional<WorldRasters> read_rasters(const TileStore& store) {
  std::error_code ignored;
  if (!std::filesystem::exists(store.folder() / kRastersName, ignored)) return std::nullopt;
  const Json json = read_json(store);
  return core::with_context(
      [&] { return rasters_of(json, store.manifest()); },
      fmt::format("reading {} (tile the world again)", (store.folder() / kRastersName).string()));
}

void read_covers(const TileStore& store, std::size_t layer, std::size_t raster,
                 WorldRasters& rasters) {
  CoverRasterInfo& info = rasters.land_cover.at(layer).at(raster);
  if (!info.covers.empty()) return;
  const Json json = read_json(store);
  const Json& listed = json.at("land_cover").at(layer).at(raster);
  if (!listed.has("content_hash")) return;
  const std::filesystem::path file = covers_path(store.folder(), layer, raster);
  constexpr auto kMaxPixels = static_cast<std::size_t>(kMaxCoverPixels);
  const std::vector<std::byte> bytes = core::read_file(file, 2 * kMaxPixels);
  if (core::content_hash(bytes) != listed.at("content_hash").string())
    fail(ErrorKind::Input, "{}: damaged, or not the one that {} lists; tile the world again",
         file.string(), kRastersName);
  auto image = core::decode_png(bytes, file.string(), kMaxPixels);
  auto* covers = std::get_if<core::Image8>(&image);
  if (covers == nullptr || covers->channels() != 1 || covers->width() != info.num_columns ||
      covers->height() != info.num_rows)
    fail(ErrorKind::Input, "{}: not of the size that {} says; tile the world again", file.string(),
         kRastersName);
  info.covers = std::move(*covers);
}

}  // namespace terracast::world
