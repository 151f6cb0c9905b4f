#include <gdal_priv.h>
#include <ogr_spatialref.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <unordered_map>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/progress.h"
#include "core/semantic_class.h"
#include "export/world/ground_baker.h"
#include "export/world/tile_ground.h"
#include "export/world/tile_model.h"
#include "export/world/world_format.h"

// Three rasters in the UTM zone of the region's centre: heights of the ground above the WGS84 ellipsoid at the pixels'
// centres, and beside them what covers the ground or is painted on it there, and its mean albedo over each pixel.

namespace terracast::world_export {
namespace {

using core::ErrorKind;
using core::fail;
using world::TileId;

constexpr double kMostPixels = 4e8;
constexpr float kNoHeight = -9999.0F;

struct DatasetCloser {
  void operator()(GDALDataset* dataset) const { GDALClose(dataset); }
};
using DatasetPtr = std::unique_ptr<GDALDataset, DatasetCloser>;

/// The ground of a cut's tiles, by place.
class CutGround {
 public:
  CutGround(const world::TileStore& store, const std::vector<world::CutTile>& cut) {
    for (const world::CutTile& cut_tile : cut) {
      finest_level_ = std::min(finest_level_, cut_tile.id.level);
      coarsest_level_ = std::max(coarsest_level_, cut_tile.id.level);
      tiles_.try_emplace(cut_tile.id, store.load(cut_tile.id), cut_tile.coarser_sides);
    }
  }
  /// Null where no tile is.
  const TileGround* find(double x_world, double y_world) const {
    for (int level = finest_level_; level <= coarsest_level_; ++level) {
      const auto found = tiles_.find(world::tile_at(level, x_world, y_world));
      if (found != tiles_.end()) return &found->second;
    }
    return nullptr;
  }

 private:
  std::unordered_map<TileId, TileGround> tiles_;
  int finest_level_ = std::numeric_limits<int>::max();
  int coarsest_level_ = std::numeric_limits<int>::min();
};

/// Codes of _cover.tif beside those of world::Cover.
constexpr std::uint8_t kNoCover = 255;
constexpr int kFirstPaintedCode = 100;
static_assert(kFirstPaintedCode + core::kNumSemanticClasses < kNoCover);

struct Pixel {
  const TileGround* ground = nullptr;
  Eigen::Vector2d place_world = Eigen::Vector2d::Zero();
  float height_m = kNoHeight;
};

/// The ground at a latitude and longitude: the fixed point of height -> place -> ground's height.
Pixel pixel_at(const geo::WorldFrame& frame, const CutGround& cut, double lat_deg, double lon_deg) {
  double height_m = 0.0;
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d place =
        frame.world_from_geodetic({.lat_deg = lat_deg, .lon_deg = lon_deg, .height_m = height_m});
    const TileGround* ground = cut.find(place.x(), place.y());
    if (ground == nullptr) return {};
    const double next_m =
        frame.geodetic_from_world({place.x(), place.y(), ground->z_world(place.x(), place.y())})
            .height_m;
    if (std::abs(next_m - height_m) < 1e-4)
      return {ground, place.head<2>(), static_cast<float>(next_m)};
    height_m = next_m;
  }
  return {};
}

/// What is painted there, or what covers the ground.
std::uint8_t cover_code(const Pixel& pixel) {
  if (pixel.ground == nullptr) return kNoCover;
  const world::SurfaceSample surface =
      pixel.ground->at(pixel.place_world.x(), pixel.place_world.y()).surface;
  if (!surface.paint.is_painted) return static_cast<std::uint8_t>(surface.cover);
  return static_cast<std::uint8_t>(kFirstPaintedCode +
                                   static_cast<int>(surface.paint.coating.semantic_class));
}

struct RasterGrid {
  double west_m, north_m, spacing_m;
  int width, height;
};

/// The bands of a raster of one type, each after the other.
template <class Value>
struct Bands {
  GDALDataType type;
  int count;
  const std::vector<Value>& values;
};

/// Writes a raster atomically.
/// options    of GDAL's driver, beside the compression's
/// describe   says what the file shall tell of its bands, before they are written
template <class Value, class Describe>
void write_raster(const std::filesystem::path& file, const RasterGrid& grid, const std::string& wkt,
                  const Bands<Value>& bands, std::vector<const char*> options,
                  Describe&& describe) {
  core::write_file_by(file, [&](const std::filesystem::path& temporary) {
    GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
    TERRACAST_CHECK(driver != nullptr, "GDAL has no GeoTIFF driver");
    for (const char* option : {"COMPRESS=DEFLATE", "TILED=YES", "PREDICTOR=1"})
      options.push_back(option);
    options.push_back(nullptr);
    const DatasetPtr dataset(driver->Create(temporary.c_str(), grid.width, grid.height, bands.count,
                                            bands.type, const_cast<char**>(options.data())));
    if (!dataset) fail(ErrorKind::Io, "{}: {}", file.string(), CPLGetLastErrorMsg());
    double transform[6] = {grid.west_m, grid.spacing_m, 0.0, grid.north_m, 0.0, -grid.spacing_m};
    dataset->SetGeoTransform(transform);
    dataset->SetProjection(wkt.c_str());
    describe(*dataset);
    if (dataset->RasterIO(GF_Write, 0, 0, grid.width, grid.height,
                          const_cast<Value*>(bands.values.data()), grid.width, grid.height,
                          bands.type, bands.count, nullptr, 0, 0, 0) != CE_None)
      fail(ErrorKind::Io, "{}: {}", file.string(), CPLGetLastErrorMsg());
  });
}

void describe_heights(GDALDataset& dataset) {
  GDALRasterBand& band = *dataset.GetRasterBand(1);
  band.SetDescription("height above the WGS84 ellipsoid, m");
  band.SetNoDataValue(static_cast<double>(kNoHeight));
  band.SetUnitType("m");
}

void describe_covers(GDALDataset& dataset) {
  GDALRasterBand& band = *dataset.GetRasterBand(1);
  band.SetDescription("what covers the ground");
  band.SetNoDataValue(kNoCover);
  GDALColorTable colors;
  const auto tell = [&](int code, std::string_view name, const std::array<std::uint8_t, 3>& rgb) {
    const GDALColorEntry entry{rgb[0], rgb[1], rgb[2], 255};
    colors.SetColorEntry(code, &entry);
    // Category names would go into a file of their own.
    dataset.SetMetadataItem(fmt::format("COVER_{}", code).c_str(), std::string(name).c_str());
  };
  for (int code = 0; code < world::kNumCovers; ++code)
    tell(code, cover_name(static_cast<world::Cover>(code)),
         ground_color_srgb(static_cast<world::Cover>(code)));
  for (const core::SemanticClassInfo& info : core::semantic_classes())
    tell(kFirstPaintedCode + static_cast<int>(info.id), fmt::format("painted_{}", info.name),
         info.color_srgb);
  band.SetColorTable(&colors);
}

void describe_albedo(GDALDataset& dataset) {
  dataset.GetRasterBand(1)->SetDescription("albedo, sRGB red");
  dataset.GetRasterBand(2)->SetDescription("albedo, sRGB green");
  dataset.GetRasterBand(3)->SetDescription("albedo, sRGB blue");
  dataset.GetRasterBand(4)->SetDescription("255 where the ground is known, else 0");
}

/// The pixels that hold a region, on whole multiples of their spacing.
/// throws   Input: no place in UTM, or too many pixels
RasterGrid grid_of(const WorldExportInputs& inputs, OGRCoordinateTransformation& utm_from_wgs84) {
  const Region& region = inputs.region;
  const double middle_deg = region.center().lon_deg;
  RasterGrid grid{.west_m = std::numeric_limits<double>::infinity(),
                  .north_m = -std::numeric_limits<double>::infinity(),
                  .spacing_m = inputs.finest_spacing_m,
                  .width = 0,
                  .height = 0};
  double east_m = -std::numeric_limits<double>::infinity();
  double south_m = std::numeric_limits<double>::infinity();
  for (const auto& [lat_deg, lon_deg] :
       {std::pair(region.south_deg, region.west_deg), std::pair(region.south_deg, region.east_deg),
        std::pair(region.north_deg, region.west_deg), std::pair(region.north_deg, region.east_deg),
        std::pair(region.south_deg, middle_deg), std::pair(region.north_deg, middle_deg)}) {
    double x = lon_deg;
    double y = lat_deg;
    if (!utm_from_wgs84.Transform(1, &x, &y))
      fail(ErrorKind::Input, "latitude {}, longitude {} has no place in UTM", lat_deg, lon_deg);
    grid.west_m = std::min(grid.west_m, x);
    east_m = std::max(east_m, x);
    south_m = std::min(south_m, y);
    grid.north_m = std::max(grid.north_m, y);
  }
  // Pixels lie on whole multiples of their spacing.
  grid.west_m = std::floor(grid.west_m / grid.spacing_m) * grid.spacing_m;
  grid.north_m = std::ceil(grid.north_m / grid.spacing_m) * grid.spacing_m;
  const double width = std::ceil((east_m - grid.west_m) / grid.spacing_m);
  const double height = std::ceil((grid.north_m - south_m) / grid.spacing_m);
  if (width * height > kMostPixels)
    fail(
        ErrorKind::Input,
        "{:.0f} x {:.0f} pixels, where a raster holds {:.0f}; give a smaller --region or a coarser "
        "--spacing",
        width, height, kMostPixels);
  grid.width = static_cast<int>(width);
  grid.height = static_cast<int>(height);
  return grid;
}

/// All rasters' pixels, each raster's row by row.
struct Rasters {
  Rasters(const RasterGrid& grid, bool has_albedo)
      : row_px(static_cast<std::size_t>(grid.width)),
        count(row_px * static_cast<std::size_t>(grid.height)),
        heights_m(count),
        covers(count),
        albedo(has_albedo ? 4 * count : 0) {}

  std::size_t row_px;
  std::size_t count;
  std::vector<float> heights_m;
  std::vector<std::uint8_t> covers;
  std::vector<std::uint8_t> albedo;  ///< red, then green, blue, alpha
};

/// One row of all rasters.
/// baker   null: no albedo
void fill_row(std::size_t row, const std::vector<Pixel>& pixels, double spacing_m,
              const GroundBaker* baker, Rasters& rasters) {
  const std::size_t first = row * rasters.row_px;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    rasters.heights_m[first + i] = pixels[i].height_m;
    rasters.covers[first + i] = cover_code(pixels[i]);
  }
  if (baker == nullptr) return;
  std::vector<GroundBaker::Square> squares(pixels.size());
  std::vector<GroundBaker::Code> codes(pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i)
    squares[i] = {pixels[i].ground, pixels[i].place_world, spacing_m};
  baker->bake(squares, codes);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) rasters.albedo[c * rasters.count + first + i] = codes[i][c];
    rasters.albedo[3 * rasters.count + first + i] = pixels[i].ground != nullptr ? 255 : 0;
  }
}

void write(const WorldExportInputs& inputs) {
  GDALAllRegister();
  const geo::WorldFrame frame(inputs.store.manifest().origin);
  const auto cut = cut_of_region(inputs.store, inputs.region, inputs.finest_spacing_m);
  const geo::Geodetic center = inputs.region.center();
  OGRSpatialReference utm;
  OGRSpatialReference wgs84;
  wgs84.SetWellKnownGeogCS("WGS84");
  wgs84.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const int zone = static_cast<int>(std::floor((center.lon_deg + 180.0) / 6.0)) % 60 + 1;
  utm.importFromEPSG((center.lat_deg >= 0.0 ? 32600 : 32700) + zone);
  utm.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const auto transformation = [](OGRSpatialReference& from, OGRSpatialReference& to) {
    std::unique_ptr<OGRCoordinateTransformation> made(
        OGRCreateCoordinateTransformation(&from, &to));
    TERRACAST_CHECK(made != nullptr, "PROJ knows no way to UTM");
    return made;
  };
  const auto utm_from_wgs84 = transformation(wgs84, utm);

  const RasterGrid grid = grid_of(inputs, *utm_from_wgs84);
  const CutGround ground(inputs.store, cut);
  std::optional<GroundBaker> baker;
  if (inputs.texel_m != 0.0) baker.emplace(inputs.store);
  Rasters rasters(grid, baker.has_value());
  core::Progress progress(inputs.context, "rows", grid.height);
  core::parallel_for(grid.height, [&](std::int64_t row) {
    const auto wgs84_from_utm = transformation(utm, wgs84);
    std::vector<double> x(rasters.row_px);
    std::vector<double> y(x.size(),
                          grid.north_m - (static_cast<double>(row) + 0.5) * grid.spacing_m);
    for (std::size_t i = 0; i < x.size(); ++i)
      x[i] = grid.west_m + (static_cast<double>(i) + 0.5) * grid.spacing_m;
    wgs84_from_utm->Transform(grid.width, x.data(), y.data());
    std::vector<Pixel> pixels(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) {
      if (!inputs.region.contains({.lat_deg = y[i], .lon_deg = x[i], .height_m = 0.0})) continue;
      const Pixel pixel = pixel_at(frame, ground, y[i], x[i]);
      if (is_in_square(inputs.store.manifest(), pixel.place_world)) pixels[i] = pixel;
    }
    fill_row(static_cast<std::size_t>(row), pixels, grid.spacing_m, baker ? &*baker : nullptr,
             rasters);
    progress.advance();
  });
  char* text = nullptr;
  utm.exportToWkt(&text);
  const std::string wkt(text);
  CPLFree(text);
  const auto beside = [&](const char* ending) {
    std::filesystem::path file = inputs.destination;
    file.replace_filename(inputs.destination.stem().string() + ending);
    return file;
  };
  write_raster(inputs.destination, grid, wkt, Bands<float>{GDT_Float32, 1, rasters.heights_m}, {},
               describe_heights);
  write_raster(beside("_cover.tif"), grid, wkt, Bands<std::uint8_t>{GDT_Byte, 1, rasters.covers},
               {}, describe_covers);
  if (baker)
    write_raster(beside("_albedo.tif"), grid, wkt, Bands<std::uint8_t>{GDT_Byte, 4, rasters.albedo},
                 {"PHOTOMETRIC=RGB", "ALPHA=YES"}, describe_albedo);
}

}  // namespace

WorldFormatInfo geotiff_world_format() {
  return {
      "geotiff",
      "GeoTIFF in UTM: ellipsoidal heights of the ground, and beside it its cover (_cover.tif) and "
      "albedo (_albedo.tif).",
      ".tif", write};
}

}  // namespace terracast::world_export
