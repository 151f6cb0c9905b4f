#include "scene/ground/ground_imagery.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>

#include "core/lanes.h"
#include "core/parallel.h"
#include "core/srgb.h"
#include "core/toml_reader.h"
#include "tests/tiler/raster_files.h"
#include "tiler/imagery/imagery_pyramid.h"
#include "tiler/layer_stack.h"

namespace terracast::test {
namespace {

using core::ErrorKind;
using scene::GroundImagery;
using tiler::WorldSurface;
using world::ImageryTileId;

constexpr double kSize_m = 4096.0;

/// Writes a picture of three bands in UTM zone 31 about the origin.
void write_picture(const std::filesystem::path& file, double spacing_m,
                   const std::function<double(int band, double u, double v)>& value,
                   GDALDataType type = GDT_Byte, std::optional<double> nodata = {},
                   const std::string& crs = "EPSG:32631", double size_m = kSize_m) {
  RasterSpec spec = utm_spec(size_m, spacing_m);
  GDALAllRegister();
  GDALDataset* dataset = GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      file.c_str(), spec.width, spec.height, 3, type, nullptr);
  ASSERT_NE(dataset, nullptr);
  if (!crs.empty()) {
    OGRSpatialReference reference;
    ASSERT_EQ(reference.SetFromUserInput(crs.c_str()), OGRERR_NONE);
    dataset->SetSpatialRef(&reference);
  }
  dataset->SetGeoTransform(spec.geotransform.data());
  std::vector<double> row(static_cast<std::size_t>(spec.width));
  for (int band = 0; band < 3; ++band) {
    if (nodata) dataset->GetRasterBand(band + 1)->SetNoDataValue(*nodata);
    for (int j = 0; j < spec.height; ++j) {
      for (int i = 0; i < spec.width; ++i)
        row[static_cast<std::size_t>(i)] = value(band, spec.geotransform[0] + (i + 0.5) * spacing_m,
                                                 spec.geotransform[3] - (j + 0.5) * spacing_m);
      ASSERT_EQ(
          dataset->GetRasterBand(band + 1)->RasterIO(GF_Write, 0, j, spec.width, 1, row.data(),
                                                     spec.width, 1, GDT_Float64, 0, 0, nullptr),
          CE_None);
    }
  }
  GDALClose(dataset);
}

tiler::WorldOptions world_with_imagery(const std::vector<std::filesystem::path>& files,
                                       const std::string& toml) {
  tiler::WorldOptions options = world_of("paraboloid", kSize_m);
  std::string list;
  for (const auto& file : files) list += "\"" + file.string() + "\", ";
  tiler::LayerOptions layer;
  core::TomlDocument::parse("kind = \"imagery\"\nfiles = [" + list + "]\n" + toml, "layer.toml")
      .read(layer);
  options.layers.push_back(layer);
  return options;
}

std::shared_ptr<const WorldSurface> prepare_layered(const tiler::WorldOptions& options) {
  const core::Log log("tile", core::LogLevel::Off);
  const core::Context context{.log = log, .num_threads = 0, .events_file = {}};
  return tiler::layered_surface(WorldSurface::prepare(options, context), context);
}

/// A folder with the imagery of a surface and nothing else.
world::TileStore store_of(const WorldSurface& surface, const std::filesystem::path& folder,
                          int num_threads = 0) {
  const core::Log log("tile", core::LogLevel::Off);
  const core::Context context{.log = log, .num_threads = num_threads, .events_file = {}};
  const core::ThreadLimit limit(num_threads);
  world::WorldManifest manifest;
  manifest.coarsest_level = 8;
  manifest.layers = surface.layers().infos();
  for (const auto& [layer, pyramid] : surface.layers().imagery()) {
    manifest.imagery.push_back(pyramid->write(folder, manifest.imagery.size(), context));
    manifest.imagery.back().layer = layer;
  }
  world::write_manifest(folder, manifest);
  return world::TileStore::open(folder);
}

/// Easting and northing of a place of the ground, by GeographicLib.
Eigen::Vector2d utm_of(const WorldSurface& surface, const Eigen::Vector2d& place_world) {
  const auto sample = surface.sample(place_world.x(), place_world.y());
  const geo::Geodetic place =
      surface.frame().geodetic_from_world({place_world.x(), place_world.y(), sample.z_world});
  return utm31(place.lat_deg, place.lon_deg);
}

/// Distance from the nearest multiple of a step.
double from_multiple(double value, double step) {
  return std::abs(value - step * std::round(value / step));
}

TEST(GroundImagery, AChessboardIsWhereItsProjectionPutsIt) {
  const ScratchFolder folder;
  constexpr double kSpacing_m = 4.0, kCell_m = 32.0;
  constexpr int kCodes[2][3] = {{200, 120, 40}, {30, 90, 160}};
  const RasterSpec grid = utm_spec(kSize_m, kSpacing_m);
  const auto is_odd = [&](double u, double v) {
    const auto column = static_cast<int>(std::floor((u - grid.geotransform[0]) / kCell_m));
    const auto line = static_cast<int>(std::floor((grid.geotransform[3] - v) / kCell_m));
    return (column + line) % 2 != 0;
  };
  write_picture(folder / "chess.tif", kSpacing_m,
                [&](int band, double u, double v) { return kCodes[is_odd(u, v) ? 1 : 0][band]; });
  const auto surface = prepare_layered(world_with_imagery({folder / "chess.tif"}, "gain = 1.0"));
  const world::TileStore store = store_of(*surface, folder.path());
  ASSERT_EQ(store.manifest().imagery.at(0).finest_level, 2);
  const GroundImagery imagery(store, 1e9);
  GroundImagery::Reader reader;
  int num_compared = 0;
  for (const Eigen::Vector2d& place : scattered_places(kSize_m, 4000)) {
    const Eigen::Vector2d at = utm_of(*surface, place);
    // Interpolation reaches two samples of the picture and one of the tile: within three of a cell's
    // side colours mix.
    if (from_multiple(at.x() - grid.geotransform[0], kCell_m) < 3.0 * kSpacing_m ||
        from_multiple(grid.geotransform[3] - at.y(), kCell_m) < 3.0 * kSpacing_m)
      continue;
    ++num_compared;
    const scene::ImagerySample seen = imagery.sample(place, 0.0, reader);
    ASSERT_EQ(seen.alpha, 1.0f);
    for (int k = 0; k < 3; ++k) {
      const auto code = static_cast<std::uint8_t>(kCodes[is_odd(at.x(), at.y()) ? 1 : 0][k]);
      // Sums of weights in floats; a code is 1e-3 and more.
      EXPECT_NEAR(seen.albedo[k], core::linear_from_srgb8(code), 1e-5) << place.transpose();
    }
  }
  EXPECT_GT(num_compared, 150);
}

TEST(GroundImagery, AWaveIsNotShiftedByHalfAPixel) {
  const ScratchFolder folder;
  const auto light = [](double u, double v) {
    return 0.4 + 0.15 * std::sin(2.0 * std::numbers::pi * u / 200.0) +
           0.15 * std::cos(2.0 * std::numbers::pi * v / 170.0);
  };
  write_picture(
      folder / "wave.tif", 4.0,
      [&](int, double u, double v) { return std::round(65535.0 * light(u, v)); }, GDT_UInt16);
  const auto surface = prepare_layered(
      world_with_imagery({folder / "wave.tif"}, "gain = 1.0\nblack = 0.0\nwhite = 65535.0"));
  const world::TileStore store = store_of(*surface, folder.path());
  const GroundImagery imagery(store, 1e9);
  GroundImagery::Reader reader;
  for (const Eigen::Vector2d& place : scattered_places(kSize_m, 2000)) {
    const Eigen::Vector2d at = utm_of(*surface, place);
    const scene::ImagerySample seen = imagery.sample(place, 0.0, reader);
    // Half a code of sRGB at 0.7 is 0.0036, straight lines between pixels 4 m apart bend by 0.0006;
    // half a pixel aside the waves would be off by up to 0.02.
    EXPECT_NEAR(seen.albedo[0], light(at.x(), at.y()), 0.0045) << place.transpose();
  }
}

TEST(GroundImagery, LevelsKeepTheMeanAndFootprintsChooseThem) {
  const ScratchFolder folder;
  // Without any structure of its own size: each pixel another.
  write_picture(folder / "noise.tif", 4.0, [](int band, double u, double v) {
    const auto code = static_cast<std::uint64_t>(u) * 7919 + static_cast<std::uint64_t>(v) * 104729;
    return static_cast<double>((code >> 3) * 2654435761u % 4096 / 16 + 0 * band);
  });
  const auto surface = prepare_layered(world_with_imagery({folder / "noise.tif"}, "gain = 1.0"));
  const world::TileStore store = store_of(*surface, folder.path());
  const world::ImageryInfo& info = store.manifest().imagery.at(0);
  std::vector<double> sums(10, 0.0), areas(10, 0.0);
  for (std::size_t i = 0; i < info.tiles.size(); ++i) {
    const core::Image8 image = store.load_imagery(0, i);
    const auto level = static_cast<std::size_t>(info.tiles[i].id.level);
    const double area_m2 = std::pow(info.tiles[i].id.pixel_m(), 2);
    for (int y = 0; y < image.height(); ++y)
      for (int x = 0; x < image.width(); ++x) {
        const double alpha = image.channels() == 4 ? image(x, y, 3) / 255.0 : 1.0;
        areas[level] += alpha * area_m2;
        sums[level] +=
            alpha * area_m2 * static_cast<double>(core::linear_from_srgb8(image(x, y, 1)));
      }
  }
  for (int level = info.finest_level; level <= info.coarsest_level; ++level) {
    const auto at = static_cast<std::size_t>(level);
    // Alpha is rounded to 1 / 255 on the border alone; colours to half a code (0.003) a level, which
    // evens out over thousands of pixels.
    EXPECT_NEAR(areas[at], kSize_m * kSize_m, 1e-3 * kSize_m * kSize_m) << level;
    EXPECT_NEAR(sums[at] / areas[at], sums[2] / areas[2], 1e-3) << level;
  }
  // A footprint of many pixels sees their mean.
  const GroundImagery imagery(store, 1e9);
  GroundImagery::Reader reader;
  EXPECT_NEAR(imagery.sample({3.0, 5.0}, 512.0, reader).albedo[1], sums[2] / areas[2], 0.02);
  EXPECT_GT(std::abs(imagery.sample({2.0, 6.0}, 0.0, reader).albedo[1] -
                     imagery.sample({6.0, 6.0}, 0.0, reader).albedo[1]),
            0.001);
}

TEST(GroundImagery, WithoutDataThereIsNothing) {
  const ScratchFolder folder;
  const Eigen::Vector2d middle = utm31(kOriginLat_deg, kOriginLon_deg);
  const auto is_void = [&](double u, double v) {
    return std::hypot(u - middle.x(), v - middle.y()) < 500.0;
  };
  write_picture(
      folder / "hole.tif", 4.0,
      [&](int band, double u, double v) { return is_void(u, v) ? 0.0 : 100.0 + 10.0 * band; },
      GDT_Byte, 0.0);
  const auto surface = prepare_layered(world_with_imagery({folder / "hole.tif"}, ""));
  const world::TileStore store = store_of(*surface, folder.path());
  const GroundImagery imagery(store, 1e9);
  GroundImagery::Reader reader;
  for (const Eigen::Vector2d& place : scattered_places(kSize_m, 2000)) {
    const Eigen::Vector2d at = utm_of(*surface, place);
    const double from_rim_m = std::hypot(at.x() - middle.x(), at.y() - middle.y()) - 500.0;
    if (std::abs(from_rim_m) < 12.0) continue;
    const bool is_at_border = place.cwiseAbs().maxCoeff() > 0.5 * kSize_m - 8.0;
    if (!is_at_border) {
      EXPECT_EQ(imagery.sample(place, 0.0, reader).alpha, from_rim_m > 0.0 ? 1.0f : 0.0f)
          << place.transpose();
    }
  }
  EXPECT_EQ(imagery.sample({0.6 * kSize_m, 0.0}, 0.0, reader).alpha, 0.0f);
}

TEST(GroundImagery, IsTheSameForAnyThreadsAndAnyBudget) {
  const ScratchFolder folder;
  write_picture(folder / "wave.tif", 2.0, [](int band, double u, double v) {
    return 120.0 + 60.0 * std::sin(u / 37.0 + band) + 40.0 * std::cos(v / 23.0);
  });
  const auto surface = prepare_layered(world_with_imagery({folder / "wave.tif"}, ""));
  const world::TileStore one = store_of(*surface, folder / "one", 1);
  const world::TileStore many = store_of(*surface, folder / "many", 4);
  EXPECT_EQ(one.manifest().imagery.at(0).tiles, many.manifest().imagery.at(0).tiles);

  // Twelve tiles of the 40 and more; a reader alone may hold eight.
  constexpr double kBudget_bytes = 12.5 * 4.0 * 512 * 512;
  const GroundImagery small(one, kBudget_bytes);
  const GroundImagery large(one, 1e9);
  GroundImagery::Reader small_reader, large_reader;
  for (const Eigen::Vector2d& place : scattered_places(kSize_m, 120))
    for (const double footprint_m : {0.0, 3.0, 21.0}) {
      const scene::ImagerySample a = small.sample(place, footprint_m, small_reader);
      const scene::ImagerySample b = large.sample(place, footprint_m, large_reader);
      ASSERT_TRUE((a.albedo == b.albedo).all() && a.alpha == b.alpha);
      small_reader.let_go();
    }
  EXPECT_LE(static_cast<double>(small.stats().peak_bytes), kBudget_bytes);
  EXPECT_GT(small.stats().num_loaded, 2 * large.stats().num_loaded);
}

TEST(GroundImagery, BadFilesAreClearErrors) {
  const ScratchFolder folder;
  const auto flat = [](int, double, double) { return 90.0; };
  write_picture(folder / "none.tif", 16.0, flat, GDT_Byte, {}, "");
  expect_error(ErrorKind::Input, {"none.tif", "a_srs"},
               [&] { prepare_layered(world_with_imagery({folder / "none.tif"}, "")); });
  write_picture(folder / "wrong.tif", 16.0, flat, GDT_Byte, {}, "EPSG:32633");
  expect_error(ErrorKind::Input, {"wrong.tif", "nothing of it lies", "CRS"},
               [&] { prepare_layered(world_with_imagery({folder / "wrong.tif"}, "")); });
  write_picture(folder / "good.tif", 16.0, flat);
  expect_error(ErrorKind::Input, {"good.tif", "3 bands", "7"}, [&] {
    prepare_layered(world_with_imagery({folder / "good.tif"}, "bands = [1, 2, 7]"));
  });
  std::ofstream(folder / "empty.tif").close();
  expect_error(ErrorKind::Input, {"empty.tif: is empty", "fetch or write it again"},
               [&] { prepare_layered(world_with_imagery({folder / "empty.tif"}, "")); });
  expect_error(ErrorKind::Io, {"missing.tif"},
               [&] { prepare_layered(world_with_imagery({folder / "missing.tif"}, "")); });
}

TEST(Imagery, GainsAreWhatMakesTheMeanPlausible) {
  EXPECT_EQ(tiler::plausible_gain(0.15), 1.0);
  EXPECT_DOUBLE_EQ(tiler::plausible_gain(0.44), 0.5);
  EXPECT_DOUBLE_EQ(tiler::plausible_gain(0.04), 2.0);
  EXPECT_EQ(tiler::plausible_gain(0.0), 1.0);
  EXPECT_EQ(tiler::plausible_gain(1e-9), 5.0);
}

/// Looks of packets along a line.
scene::GroundLook drape(const GroundImagery& imagery, double x0, double footprint_m,
                        GroundImagery::Reader& reader, bool is_painted = false,
                        float is_water = 0.0f) {
  scene::GroundPlaces places;
  world::SurfaceSample surface;
  surface.spacing_m = 1.0;
  surface.paint.is_painted = is_painted;
  for (int lane = 0; lane < scene::kLanes; ++lane)
    places.set(lane, {x0 + 0.37 * lane, 0.61 * x0, 0.0}, Eigen::Vector3d::UnitZ(), surface,
               footprint_m);
  const scene::Ground ground(scene::Climate{});
  scene::GroundPacket packet;
  ground.set(places, packet);
  scene::GroundLook look{};
  for (int lane = 0; lane < scene::kLanes; ++lane) {
    for (std::size_t k = 0; k < 3; ++k) look.albedo[k][lane] = 0.9f;
    look.normal[2][lane] = 1.0f;
    look.is_water[lane] = is_water;
  }
  imagery.drape(places, packet, 7, reader, look);
  return look;
}

TEST(GroundImagery, DetailBelowThePixelsLeavesTheMean) {
  const ScratchFolder folder;
  write_picture(folder / "flat.tif", 8.0,
                [](int band, double, double) { return 80.0 + 20 * band; });
  const auto surface = prepare_layered(world_with_imagery({folder / "flat.tif"}, "gain = 1.0"));
  const world::TileStore store = store_of(*surface, folder.path());
  const GroundImagery imagery(store, 1e9);
  GroundImagery::Reader reader;
  double sum = 0.0, squares = 0.0;
  int count = 0;
  for (int i = 0; i < 1500; ++i) {
    const scene::GroundLook look = drape(imagery, -1700.0 + 2.26 * i, 0.05, reader);
    for (int lane = 0; lane < scene::kLanes; ++lane, ++count) {
      const auto value = static_cast<double>(look.albedo[1][lane]);
      sum += value;
      squares += value * value;
    }
  }
  const double expected = static_cast<double>(core::linear_from_srgb8(100));
  const double mean = sum / count;
  // 24 000 values along a line of 3.4 km: about 425 pixels' worth of independent noise of 0.16.
  EXPECT_NEAR(mean / expected, 1.0, 0.025);
  EXPECT_GT(std::sqrt(squares / count - mean * mean) / expected, 0.08);
  // A sample as wide as a pixel sees none of it.
  const scene::GroundLook wide = drape(imagery, 11.0, 16.0, reader);
  for (int lane = 0; lane < scene::kLanes; ++lane)
    EXPECT_NEAR(wide.albedo[1][lane], expected, 1e-6);
  // What is painted or water keeps its look.
  EXPECT_EQ(drape(imagery, 11.0, 0.1, reader, true).albedo[1][3], 0.9f);
  EXPECT_EQ(drape(imagery, 11.0, 0.1, reader, false, 1.0f).albedo[1][3], 0.9f);
}

}  // namespace
}  // namespace terracast::test
