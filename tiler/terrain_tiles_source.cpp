#include "tiler/terrain_tiles_source.h"

#include <cpl_conv.h>
#include <fmt/format.h>
#include <gdal_priv.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "core/error.h"

namespace terracast::tiler {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

constexpr double kHalfWorld_m = 20037508.342789244;  // pi times the semi-major axis of WGS84
constexpr int kDeepest = 24;
constexpr std::size_t kMostTiles = 100'000;

struct TileFile {
  int x = 0;
  int y = 0;
  fs::path file;
};

std::optional<int> whole_number(const std::string& text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < 0) return std::nullopt;
  return value;
}

/// Entries of a folder whose names are whole numbers (before `extension`), by number.
std::map<int, fs::path> numbered(const fs::path& folder, const std::string& extension) {
  std::map<int, fs::path> found;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const fs::path& path = entry->path();
    if (path.extension() != extension) continue;
    if (const auto number = whole_number(path.stem().string())) found.emplace(*number, path);
  }
  if (error) fail(ErrorKind::Io, "{}: {}", folder.string(), error.message());
  return found;
}

std::vector<TileFile> tiles_of_zoom(const fs::path& folder, int zoom, const std::string& written) {
  std::vector<TileFile> tiles;
  const int count = 1 << zoom;
  for (const auto& [x, column] : numbered(folder, ""))
    for (const auto& [y, file] : numbered(column, ".png")) {
      if (x >= count || y >= count)
        fail(ErrorKind::Input, "{}: tile {}/{}/{} lies off the map: zoom {} has {} tiles a side",
             written, zoom, x, y, zoom, count);
      tiles.push_back({x, y, file});
      if (tiles.size() > kMostTiles)
        fail(ErrorKind::Input, "{}: more than {} tiles of zoom {}; give a folder of fewer", written,
             kMostTiles, zoom);
    }
  return tiles;
}

struct TileShape {
  int side_px = 0;
  int num_bands = 0;
  bool operator==(const TileShape&) const = default;
};

TileShape shape_of(const fs::path& file) {
  struct Closer {
    void operator()(GDALDataset* dataset) const { GDALClose(dataset); }
  };
  const char* const drivers[] = {"PNG", nullptr};
  const std::unique_ptr<GDALDataset, Closer> dataset(
      GDALDataset::Open(file.c_str(), GDAL_OF_RASTER, drivers));
  if (!dataset) fail(ErrorKind::Input, "{}: is no PNG; is it damaged?", file.string());
  const TileShape shape{dataset->GetRasterXSize(), dataset->GetRasterCount()};
  if (dataset->GetRasterYSize() != shape.side_px || (shape.num_bands != 3 && shape.num_bands != 4))
    fail(ErrorKind::Input,
         "{}: {} x {} pixels of {} bands are no terrain tile: it is square, of red, "
         "green and blue",
         file.string(), shape.side_px, dataset->GetRasterYSize(), shape.num_bands);
  return shape;
}

std::string escaped(const fs::path& file) {
  char* text = CPLEscapeString(file.c_str(), -1, CPLES_XML);
  std::string result = text;
  CPLFree(text);
  return result;
}

/// One tile's share of a band; of alpha, 255 where the tiles have none of their own.
std::string source_text(const TileFile& tile, int column, int row, const TileShape& shape,
                        int band) {
  const bool is_made_up = band > shape.num_bands;
  const int side_px = shape.side_px;
  return fmt::format(
      "<{0}><SourceFilename relativeToVRT=\"0\">{1}</SourceFilename><SourceBand>{2}</SourceBand>"
      "<SrcRect xOff=\"0\" yOff=\"0\" xSize=\"{3}\" ySize=\"{3}\"/>"
      "<DstRect xOff=\"{4}\" yOff=\"{5}\" xSize=\"{3}\" ySize=\"{3}\"/>{6}</{0}>\n",
      is_made_up ? "ComplexSource" : "SimpleSource", escaped(tile.file), is_made_up ? 1 : band,
      side_px, column * side_px, row * side_px,
      is_made_up ? "<ScaleOffset>255</ScaleOffset><ScaleRatio>0</ScaleRatio>" : "");
}

}  // namespace

std::string vrt_of_terrain_tiles(const fs::path& folder, const std::string& written) {
  std::vector<TileFile> tiles;
  int zoom = 0;
  const std::map<int, fs::path> zooms = numbered(folder, "");
  for (auto entry = zooms.rbegin(); entry != zooms.rend() && tiles.empty(); ++entry) {
    zoom = entry->first;
    if (zoom <= kDeepest) tiles = tiles_of_zoom(entry->second, zoom, written);
  }
  if (tiles.empty())
    fail(ErrorKind::Input,
         "{}: a folder, and without tiles (z/x/y.png) as a source of heights may be one; give a "
         "file",
         written);
  const TileShape shape = shape_of(tiles.front().file);
  int first_x = tiles.front().x;
  int last_x = first_x;
  int first_y = tiles.front().y;
  int last_y = first_y;
  for (const TileFile& tile : tiles) {
    if (shape_of(tile.file) != shape)
      fail(ErrorKind::Input,
           "{}: its size or its bands are not those of {}; give tiles of one kind",
           tile.file.string(), tiles.front().file.string());
    first_x = std::min(first_x, tile.x);
    last_x = std::max(last_x, tile.x);
    first_y = std::min(first_y, tile.y);
    last_y = std::max(last_y, tile.y);
  }
  const std::int64_t width_px = std::int64_t{last_x - first_x + 1} * shape.side_px;
  const std::int64_t height_px = std::int64_t{last_y - first_y + 1} * shape.side_px;
  if (std::max(width_px, height_px) > (1 << 30))
    fail(ErrorKind::Input,
         "{}: its tiles of zoom {} lie {} x {} pixels apart; give a folder of "
         "tiles that are near each other",
         written, zoom, width_px, height_px);

  const double side_m = 2.0 * kHalfWorld_m / (1 << zoom);
  const double pixel_m = side_m / shape.side_px;
  std::string text = fmt::format(
      "<VRTDataset rasterXSize=\"{}\" rasterYSize=\"{}\"><SRS>EPSG:3857</SRS>"
      "<GeoTransform>{:.17g}, {:.17g}, 0, {:.17g}, 0, {:.17g}</GeoTransform>\n",
      width_px, height_px, first_x * side_m - kHalfWorld_m, pixel_m,
      kHalfWorld_m - first_y * side_m, -pixel_m);
  constexpr const char* kColours[] = {"Red", "Green", "Blue", "Alpha"};
  for (int band = 1; band <= 4; ++band) {
    text +=
        fmt::format("<VRTRasterBand dataType=\"Byte\" band=\"{}\"><ColorInterp>{}</ColorInterp>\n",
                    band, kColours[band - 1]);
    for (const TileFile& tile : tiles)
      text += source_text(tile, tile.x - first_x, tile.y - first_y, shape, band);
    text += "</VRTRasterBand>\n";
  }
  return text + "</VRTDataset>\n";
}

}  // namespace terracast::tiler
