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
#include "export/world/tile_model.h"
#include "export/world/world_format.h"

// Two rasters in the UTM zone of the region's centre: heights of the ground above the WGS84 ellipsoid at the pixels'
// centres, and beside them what covers the ground.

namespace terracast::world_export {
namespace {

using core::ErrorKind;
using core::fail;
using world::kHeightStep_m;
using world::kTileCells;
using world::Tile;
using world::TileId;

constexpr double kMostPixels = 4e8;
constexpr float kNoHeight = -9999.0F;

struct DatasetCloser {
  void operator()(GDALDataset* dataset) const { GDALClose(dataset); }
};
using DatasetPtr = std::unique_ptr<GDALDataset, DatasetCloser>;

/// The ground of a cut's tiles, by place.
class GroundHeights {
 public:
  GroundHeights(const world::TileStore& store, const std::vector<world::CutTile>& cut) {
    for (const world::CutTile& cut_tile : cut) {
      Loaded loaded{.tile = store.load(cut_tile.id), .half_steps = {}};
      loaded.half_steps = world::stitched_half_steps(loaded.tile, cut_tile.coarser_sides);
      finest_level_ = std::min(finest_level_, cut_tile.id.level);
      coarsest_level_ = std::max(coarsest_level_, cut_tile.id.level);
      tiles_.emplace(cut_tile.id, std::move(loaded));
    }
  }

  struct Sample {
    double z_world;
    world::Cover cover;
  };
  /// Nothing where no tile is.
  std::optional<Sample> at(double x_world, double y_world) const {
    for (int level = finest_level_; level <= coarsest_level_; ++level) {
      const auto found = tiles_.find(world::tile_at(level, x_world, y_world));
      if (found == tiles_.end()) continue;
      const Tile& tile = found->second.tile;
      const Eigen::Vector2d cell =
          (Eigen::Vector2d(x_world, y_world) - tile.id.corner_world()) / tile.id.spacing_m();
      const int i = std::clamp(static_cast<int>(cell.x()), 0, kTileCells - 1);
      const int j = std::clamp(static_cast<int>(cell.y()), 0, kTileCells - 1);
      const auto z = [&](int x, int y) {
        return found->second.half_steps[Tile::sample(i + x, j + y)] * (0.5 * kHeightStep_m);
      };
      const double fx = cell.x() - i;
      const double fy = cell.y() - j;
      const double above_center_m =
          fx + fy <= 1.0
              ? z(0, 0) + fx * (z(1, 0) - z(0, 0)) + fy * (z(0, 1) - z(0, 0))
              : z(1, 1) + (1.0 - fx) * (z(0, 1) - z(1, 1)) + (1.0 - fy) * (z(1, 0) - z(1, 1));
      return Sample{tile.center_z_m + above_center_m,
                    tile.cover[Tile::sample(i + (fx > 0.5 ? 1 : 0), j + (fy > 0.5 ? 1 : 0))]};
    }
    return std::nullopt;
  }

 private:
  struct Loaded {
    Tile tile;
    std::vector<std::int32_t> half_steps;
  };
  std::unordered_map<TileId, Loaded> tiles_;
  int finest_level_ = std::numeric_limits<int>::max();
  int coarsest_level_ = std::numeric_limits<int>::min();
};

struct Pixel {
  float height_m = kNoHeight;
  std::uint8_t cover = 255;
};

/// The ground at a latitude and longitude: the fixed point of height -> place -> ground's height.
Pixel pixel_at(const geo::WorldFrame& frame, const GroundHeights& ground, double lat_deg,
               double lon_deg) {
  double height_m = 0.0;
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d place =
        frame.world_from_geodetic({.lat_deg = lat_deg, .lon_deg = lon_deg, .height_m = height_m});
    const auto sample = ground.at(place.x(), place.y());
    if (!sample) return {};
    const double next_m =
        frame.geodetic_from_world({place.x(), place.y(), sample->z_world}).height_m;
    if (std::abs(next_m - height_m) < 1e-4)
      return {static_cast<float>(next_m), static_cast<std::uint8_t>(sample->cover)};
    height_m = next_m;
  }
  return {};
}

struct RasterGrid {
  double west_m, north_m, spacing_m;
  int width, height;
};

/// Writes one band of a type into a file beside others.
template <class Value>
void write_band(const std::filesystem::path& file, const RasterGrid& grid, const std::string& wkt,
                GDALDataType type, const std::vector<Value>& values, double nodata,
                const char* description, bool has_covers) {
  core::write_file_by(file, [&](const std::filesystem::path& temporary) {
    GDALDriver* driver = GetGDALDriverManager()->GetDriverByName("GTiff");
    TERRACAST_CHECK(driver != nullptr, "GDAL has no GeoTIFF driver");
    const char* const options[] = {"COMPRESS=DEFLATE", "TILED=YES", "PREDICTOR=1", nullptr};
    const DatasetPtr dataset(driver->Create(temporary.c_str(), grid.width, grid.height, 1, type,
                                            const_cast<char**>(options)));
    if (!dataset) fail(ErrorKind::Io, "{}: {}", file.string(), CPLGetLastErrorMsg());
    double transform[6] = {grid.west_m, grid.spacing_m, 0.0, grid.north_m, 0.0, -grid.spacing_m};
    dataset->SetGeoTransform(transform);
    dataset->SetProjection(wkt.c_str());
    GDALRasterBand& band = *dataset->GetRasterBand(1);
    band.SetDescription(description);
    band.SetNoDataValue(nodata);
    if (has_covers) {
      GDALColorTable colors;
      for (int code = 0; code < world::kNumCovers; ++code) {
        const auto cover = static_cast<world::Cover>(code);
        const auto rgb = ground_color_srgb(cover);
        const GDALColorEntry entry{rgb[0], rgb[1], rgb[2], 255};
        colors.SetColorEntry(code, &entry);
        // Category names would go into a file of their own.
        dataset->SetMetadataItem(fmt::format("COVER_{}", code).c_str(),
                                 std::string(cover_name(cover)).c_str());
      }
      band.SetColorTable(&colors);
    } else {
      band.SetUnitType("m");
    }
    if (band.RasterIO(GF_Write, 0, 0, grid.width, grid.height, const_cast<Value*>(values.data()),
                      grid.width, grid.height, type, 0, 0) != CE_None)
      fail(ErrorKind::Io, "{}: {}", file.string(), CPLGetLastErrorMsg());
  });
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

  RasterGrid grid{.west_m = std::numeric_limits<double>::infinity(),
                  .north_m = -std::numeric_limits<double>::infinity(),
                  .spacing_m = inputs.finest_spacing_m,
                  .width = 0,
                  .height = 0};
  double east_m = -std::numeric_limits<double>::infinity();
  double south_m = std::numeric_limits<double>::infinity();
  const Region& region = inputs.region;
  for (const auto& [lat_deg, lon_deg] :
       {std::pair(region.south_deg, region.west_deg), std::pair(region.south_deg, region.east_deg),
        std::pair(region.north_deg, region.west_deg), std::pair(region.north_deg, region.east_deg),
        std::pair(region.south_deg, center.lon_deg), std::pair(region.north_deg, center.lon_deg)}) {
    double x = lon_deg;
    double y = lat_deg;
    if (!utm_from_wgs84->Transform(1, &x, &y))
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

  const GroundHeights ground(inputs.store, cut);
  const std::size_t count =
      static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height);
  std::vector<float> heights_m(count);
  std::vector<std::uint8_t> covers(count);
  core::Progress progress(inputs.context, "rows", grid.height);
  core::parallel_for(grid.height, [&](std::int64_t row) {
    const auto wgs84_from_utm = transformation(utm, wgs84);
    std::vector<double> x(static_cast<std::size_t>(grid.width));
    std::vector<double> y(x.size(),
                          grid.north_m - (static_cast<double>(row) + 0.5) * grid.spacing_m);
    for (std::size_t i = 0; i < x.size(); ++i)
      x[i] = grid.west_m + (static_cast<double>(i) + 0.5) * grid.spacing_m;
    wgs84_from_utm->Transform(grid.width, x.data(), y.data());
    for (std::size_t i = 0; i < x.size(); ++i) {
      const std::size_t at = static_cast<std::size_t>(row) * x.size() + i;
      const Pixel pixel = region.contains({.lat_deg = y[i], .lon_deg = x[i], .height_m = 0.0})
                              ? pixel_at(frame, ground, y[i], x[i])
                              : Pixel{};
      heights_m[at] = pixel.height_m;
      covers[at] = pixel.cover;
    }
    progress.advance();
  });
  char* text = nullptr;
  utm.exportToWkt(&text);
  const std::string wkt(text);
  CPLFree(text);
  write_band(inputs.destination, grid, wkt, GDT_Float32, heights_m, kNoHeight,
             "height above the WGS84 ellipsoid, m", false);
  std::filesystem::path cover_file = inputs.destination;
  cover_file.replace_filename(inputs.destination.stem().string() + "_cover.tif");
  write_band(cover_file, grid, wkt, GDT_Byte, covers, 255.0, "what covers the ground", true);
}

}  // namespace

WorldFormatInfo geotiff_world_format() {
  return {
      "geotiff",
      "GeoTIFF in UTM: ellipsoidal heights of the ground, and beside it its cover (_cover.tif).",
      ".tif", write};
}

}  // namespace terracast::world_export
