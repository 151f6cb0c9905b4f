#include <cpl_conv.h>
#include <cpl_vsi.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "tests/tiler/raster_files.h"
#include "tiler/offset_grid.h"

// Every kind of raster that heights come from: formats, encodings, kinds of no-data.
namespace terracast::test {
namespace {

using core::ErrorKind;
using tiler::WorldSurface;

tiler::WorldOptions smooth(tiler::WorldOptions options) {
  options.detail_roughness = 0.0;
  return options;
}

double height_at(const WorldSurface& surface, double lat_deg, double lon_deg) {
  return surface.measured_height_m(lat_deg, lon_deg).value();
}

/// A plane in latitude and longitude, in whole metres at samples of 3 arc-seconds.
double plane_m(double lat_deg, double lon_deg) {
  return 300.0 + 1200.0 * (lat_deg - 42.0) + 2400.0 * (lon_deg - 1.0);
}

/// N42E001 as SRTM ships it: 1201 x 1201 big-endian, from 43 N 1 E, samples on the degrees.
void write_hgt(const std::filesystem::path& file) {
  std::string bytes;
  for (int row = 0; row <= 1200; ++row)
    for (int column = 0; column <= 1200; ++column) {
      const auto height_m = static_cast<std::int16_t>(
          std::lround(plane_m(43.0 - row / 1200.0, 1.0 + column / 1200.0)));
      bytes.push_back(static_cast<char>(height_m >> 8));
      bytes.push_back(static_cast<char>(height_m & 0xff));
    }
  std::ofstream(file, std::ios::binary) << bytes;
}

void zip(const std::filesystem::path& file, const std::filesystem::path& member) {
  GDALAllRegister();
  void* archive = CPLCreateZip(file.c_str(), nullptr);
  ASSERT_NE(archive, nullptr);
  const std::string bytes = [&] {
    std::ifstream in(member, std::ios::binary);
    return std::string{std::istreambuf_iterator<char>(in), {}};
  }();
  ASSERT_EQ(CPLCreateFileInZip(archive, member.filename().c_str(), nullptr), CE_None);
  ASSERT_EQ(CPLWriteFileInZip(archive, bytes.data(), static_cast<int>(bytes.size())), CE_None);
  CPLCloseFileInZip(archive);
  CPLCloseZip(archive);
}

// A plane of 2 and 1 m a sample is whole at every sample: what is read is exact, and half a sample
// of shift would show as 1.5 m.
TEST(Formats, HgtFilesPlainZippedAndInsideAnArchive) {
  const ScratchFolder folder;
  write_hgt(folder / "N42E001.hgt");
  zip(folder / "N42E001.hgt.zip", folder / "N42E001.hgt");
  zip(folder / "tile.zip", folder / "N42E001.hgt");
  for (const std::filesystem::path& file :
       {folder / "N42E001.hgt", folder / "N42E001.hgt.zip", folder / "tile.zip",
        std::filesystem::path("/vsizip/" + (folder / "tile.zip").string() + "/N42E001.hgt")}) {
    const auto surface = prepare(smooth(world_of_rasters({file}, 4096.0)));
    for (const double d_deg : {-0.013, 0.0, 0.011})
      EXPECT_NEAR(height_at(*surface, 42.5 + d_deg, 1.5 - d_deg),
                  plane_m(42.5 + d_deg, 1.5 - d_deg), 1e-6)
          << file;
  }
}

RasterSpec lat_lon_plane(double step_lon_deg = 0.0005, double step_lat_deg = 0.0005) {
  RasterSpec spec;
  spec.crs = "EPSG:4326";
  spec.width = static_cast<int>(0.1 / step_lon_deg);
  spec.height = static_cast<int>(0.1 / step_lat_deg);
  spec.geotransform = {1.45, step_lon_deg, 0.0, 42.55, 0.0, -step_lat_deg};
  spec.value = [](double u, double v) { return plane_m(v, u); };
  return spec;
}

TEST(Formats, BilVrtAndAsciiGrids) {
  const ScratchFolder folder;
  RasterSpec bil = lat_lon_plane();
  bil.driver = "EHdr";
  bil.type = GDT_Float32;
  write_raster(folder / "plane.bil", bil);
  write_raster(folder / "plane.tif", lat_lon_plane());
  std::ofstream(folder / "plane.vrt")
      << "<VRTDataset rasterXSize=\"200\" rasterYSize=\"200\"><SRS>EPSG:4326</SRS>"
         "<GeoTransform>1.45, 0.0005, 0, 42.55, 0, -0.0005</GeoTransform>"
         "<VRTRasterBand dataType=\"Float64\" band=\"1\"><SimpleSource>"
         "<SourceFilename relativeToVRT=\"1\">plane.tif</SourceFilename><SourceBand>1</SourceBand>"
         "</SimpleSource></VRTRasterBand></VRTDataset>";
  for (const char* name : {"plane.bil", "plane.vrt"}) {
    const auto surface = prepare(smooth(world_of_rasters({folder / name})));
    // Floats of 1500 m are 0.12 mm apart.
    EXPECT_NEAR(height_at(*surface, 42.507, 1.491), plane_m(42.507, 1.491), 1.5e-4) << name;
  }
}

TEST(Formats, PixelsThatAreNotSquareAndHeightsBelowZero) {
  const ScratchFolder folder;
  RasterSpec spec = lat_lon_plane(0.0004, 0.001);
  spec.type = GDT_Int16;
  spec.value = [](double, double v) { return std::lround((v - 42.5) * 2000.0) - 150.0; };
  write_raster(folder / "polder.tif", spec);
  tiler::WorldOptions options = smooth(world_of_rasters({folder / "polder.tif"}));
  options.elevation[0].vertical_datum = "egm96";
  const auto surface = prepare(options);
  const auto above_geoid_m = [&](double lat_deg, double lon_deg) {
    return height_at(*surface, lat_deg, lon_deg) -
           geo::Geoid::egm96()->undulation_m(lat_deg, lon_deg);
  };
  // Samples stand 2 m apart in whole metres from -250 to -50: rounded, a plane all the same. The
  // geoid's cubic jumps by 2 cm.
  EXPECT_NEAR(above_geoid_m(42.51, 1.495), -130.0, 1.1);
  EXPECT_NEAR(above_geoid_m(42.49, 1.505), -170.0, 1.1);
  EXPECT_EQ(surface->sample(0.0, 0.0).cover, world::Cover::Land);
  // 0.0004 deg of longitude are 32.9 m at 42.5 N, the densest direction.
  EXPECT_NEAR(surface->sources()[0].spacing_m, 32.9, 0.1);
}

/// The plane with 9999 in a square about the origin, which only a mask or an alpha band marks.
void write_masked(const std::filesystem::path& file, bool has_alpha) {
  GDALAllRegister();
  CPLSetConfigOption("GDAL_TIFF_INTERNAL_MASK", "YES");
  const char* options[] = {has_alpha ? "ALPHA=YES" : nullptr, nullptr};
  GDALDataset* dataset = GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
      file.c_str(), 200, 200, has_alpha ? 2 : 1, GDT_Float32, const_cast<char**>(options));
  ASSERT_NE(dataset, nullptr);
  OGRSpatialReference crs;
  crs.importFromEPSG(4326);
  dataset->SetSpatialRef(&crs);
  double gt[6] = {1.45, 0.0005, 0.0, 42.55, 0.0, -0.0005};
  dataset->SetGeoTransform(gt);
  if (has_alpha)
    dataset->GetRasterBand(2)->SetColorInterpretation(GCI_AlphaBand);
  else
    ASSERT_EQ(dataset->CreateMaskBand(GMF_PER_DATASET), CE_None);
  for (int j = 0; j < 200; ++j) {
    std::vector<float> heights;
    std::vector<float> valid;
    for (int i = 0; i < 200; ++i) {
      const bool is_hole = std::abs(i - 99.5) < 10.0 && std::abs(j - 99.5) < 10.0;
      heights.push_back(is_hole ? 8999.0F
                                : static_cast<float>(plane_m(42.55 - 0.0005 * (j + 0.5),
                                                             1.45 + 0.0005 * (i + 0.5))));
      valid.push_back(is_hole ? 0.0F : 255.0F);
    }
    GDALRasterBand* mask =
        has_alpha ? dataset->GetRasterBand(2) : dataset->GetRasterBand(1)->GetMaskBand();
    ASSERT_EQ(dataset->GetRasterBand(1)->RasterIO(GF_Write, 0, j, 200, 1, heights.data(), 200, 1,
                                                  GDT_Float32, 0, 0, nullptr),
              CE_None);
    ASSERT_EQ(
        mask->RasterIO(GF_Write, 0, j, 200, 1, valid.data(), 200, 1, GDT_Float32, 0, 0, nullptr),
        CE_None);
  }
  GDALClose(dataset);
}

TEST(NoData, MasksAndAlphaBandsMarkVoids) {
  const ScratchFolder folder;
  for (const bool has_alpha : {false, true}) {
    const auto file = folder / (has_alpha ? "alpha.tif" : "mask.tif");
    write_masked(file, has_alpha);
    const auto surface = prepare(smooth(world_of_rasters({file})));
    EXPECT_EQ(surface->sources()[0].num_voids, 400) << file;
    EXPECT_EQ(surface->sources()[0].num_voids_filled, 400) << file;
    // A membrane over a plane's rim is the plane, but for the grid's corners.
    EXPECT_NEAR(height_at(*surface, 42.5, 1.5), plane_m(42.5, 1.5), 1.0) << file;
  }
}

/// Ground of 300 m and more within a turned rectangle, `fill` about it.
RasterSpec turned_ground(double fill, const std::function<double(double, double)>& ground_m) {
  RasterSpec spec = utm_spec(6000.0, 20.0);
  const Eigen::Vector2d middle = utm31(kOriginLat_deg, kOriginLon_deg);
  spec.value = [=](double u, double v) {
    const Eigen::Vector2d at = Eigen::Vector2d(u, v) - middle;
    const double along = 0.94 * at.x() + 0.34 * at.y();
    const double across = -0.34 * at.x() + 0.94 * at.y();
    const bool is_inside = std::abs(along) < 2000.0 && std::abs(across) < 1800.0;
    return is_inside ? ground_m(at.x(), at.y()) : fill;
  };
  return spec;
}

TEST(NoData, CollarsOfAConstantAreFoundAndReported) {
  const ScratchFolder folder;
  const auto hills_m = [](double x, double y) {
    return 400.0 + 60.0 * std::sin(x / 300.0) * std::cos(y / 400.0);
  };
  // Within the ground's own range, too: the rectangle gives it away.
  for (const double fill : {0.0, -9999.0, 400.0}) {
    write_raster(folder / "turned.tif", turned_ground(fill, hills_m));
    // 2 km in the middle are all ground; 6 km reach into the collar.
    tiler::WorldOptions options = smooth(world_of_rasters({folder / "turned.tif"}, 2048.0));
    // The spline errs by less than a millimetre over 20 m of waves of 300 m.
    EXPECT_NEAR(height_at(*prepare(options), 42.5, 1.5), 400.0, 1e-3);
    options.size_m = 6000.0;
    expect_error(ErrorKind::Input, {"no raster covers", "km2"}, [&] { prepare(options); });
    options.outside = "extend";
    const std::string log = log_of(options);
    EXPECT_NE(log.find("samples of exactly " + std::to_string(static_cast<int>(fill)) + " m"),
              std::string::npos)
        << log;
    EXPECT_NE(log.find("nodata"), std::string::npos);
    const auto surface = prepare(options);
    const auto corner = surface->sample(2950.0, 2950.0);
    EXPECT_EQ(surface->sources()[corner.source].kind, "extend");
    // Stated to be heights, they are; but for a fill that no ground has.
    options.elevation[0].nodata = "none";
    if (fill == -9999.0) {
      expect_error(ErrorKind::Input, {"exactly -9999"}, [&] { prepare(options); });
      continue;
    }
    const auto taken = prepare(options);
    EXPECT_EQ(taken->sources()[taken->sample(2950.0, 2950.0).source].kind, "raster");
  }
}

TEST(NoData, UndeclaredHolesAreRefusedNotPits) {
  const ScratchFolder folder;
  RasterSpec spec = utm_spec(4096.0, 20.0);
  const Eigen::Vector2d middle = utm31(kOriginLat_deg, kOriginLon_deg);
  spec.value = [&](double u, double v) {
    const bool is_hole = std::hypot(u - middle.x(), v - middle.y()) < 100.0;
    return is_hole ? -9999.0 : 400.0 + 0.01 * (u - middle.x());
  };
  write_raster(folder / "holes.tif", spec);
  tiler::WorldOptions options = smooth(world_of_rasters({folder / "holes.tif"}, 2048.0));
  expect_error(ErrorKind::Input, {"holes.tif", "exactly -9999", "nodata = \"declared, -9999\""},
               [&] { prepare(options); });
  options.elevation[0].nodata = "-9999";
  EXPECT_NEAR(height_at(*prepare(options), kOriginLat_deg, kOriginLon_deg), 400.0, 1.0);
}

TEST(NoData, ASeaOrALakeAtACornerIsNoCollar) {
  const ScratchFolder folder;
  RasterSpec spec = utm_spec(6000.0, 20.0);
  const Eigen::Vector2d middle = utm31(kOriginLat_deg, kOriginLon_deg);
  for (const double level_m : {0.0, 372.0}) {
    spec.value = [&](double u, double v) {
      const double shore = 0.7 * (u - middle.x()) + 0.7 * (v - middle.y()) - 400.0 +
                           150.0 * std::sin((u - v) / 500.0);
      return std::round(level_m + std::max(-0.1 * shore, 0.0));
    };
    write_raster(folder / "shore.tif", spec);
    tiler::WorldOptions options = smooth(world_of_rasters({folder / "shore.tif"}, 4096.0));
    const std::string log = log_of(options);
    EXPECT_EQ(log.find("collar"), std::string::npos) << log;
    EXPECT_NEAR(height_at(*prepare(options), 42.515, 1.52), level_m, 1e-6);
  }
}

TEST(DatumGrids, AreAddedAsProjAddsThem) {
  // EGM96 once more, as a grid: the table holds what GeoidEval answers bilinearly.
  const std::filesystem::path gtx = "/usr/share/proj/egm96_15.gtx";
  if (!std::filesystem::exists(gtx)) GTEST_SKIP() << gtx << " is missing: install proj-data";
  TERRACAST_NEEDS_SHARED_DATA("geoid/egm96_test_points.csv");
  const auto grid =
      geo::Geoid::from_grid(tiler::read_offset_grid({.written = gtx.string(), .resolved = gtx}));
  std::ifstream table(shared_data() / "geoid" / "egm96_test_points.csv");
  std::string line;
  std::getline(table, line);
  int num_points = 0;
  while (std::getline(table, line)) {
    std::vector<std::string> cells;
    std::istringstream row(line);
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
    ASSERT_EQ(cells.size(), 6u) << line;
    // GeoidEval's grid is rounded to 3 mm, its answer to 0.1 mm.
    EXPECT_NEAR(grid->undulation_m(std::stod(cells[0]), std::stod(cells[1])), std::stod(cells[5]),
                0.0017)
        << line;
    ++num_points;
  }
  EXPECT_EQ(num_points, 11);
}

TEST(DatumGrids, MakeHeightsEllipsoidalAndMustCoverTheSquare) {
  const ScratchFolder folder;
  write_raster(folder / "plane.tif", lat_lon_plane());
  RasterSpec offsets = lat_lon_plane(0.01, 0.01);
  offsets.width = offsets.height = 20;
  offsets.geotransform = {1.4, 0.01, 0.0, 42.6, 0.0, -0.01};
  offsets.value = [](double u, double v) { return 50.0 + 20.0 * (u - 1.5) - 30.0 * (v - 42.5); };
  write_raster(folder / "offsets.tif", offsets);
  tiler::WorldOptions options = smooth(world_of_rasters({folder / "plane.tif"}));
  options.elevation[0].vertical_datum = "grid";
  options.elevation[0].datum_grid = {.written = "offsets.tif", .resolved = folder / "offsets.tif"};
  const auto surface = prepare(options);
  for (const double d_deg : {-0.012, 0.0, 0.013}) {
    const double lat_deg = 42.5 + d_deg;
    const double lon_deg = 1.5 - 0.7 * d_deg;
    // A plane of offsets, bilinear: exact; undulations are interpolated between nodes to 1 mm.
    EXPECT_NEAR(height_at(*surface, lat_deg, lon_deg),
                plane_m(lat_deg, lon_deg) + 50.0 + 20.0 * (lon_deg - 1.5) - 30.0 * (lat_deg - 42.5),
                1e-3);
  }
  EXPECT_EQ(surface->sources()[0].vertical_datum, "offsets.tif");
  // Whole steps of half a centimetre above 40 m are the same grid: all of its values are such steps.
  offsets.type = GDT_Int16;
  offsets.unit = "cm";
  offsets.scale = 0.5;
  offsets.offset = 4000.0;
  const auto metres = offsets.value;
  offsets.value = [=](double u, double v) { return std::round((metres(u, v) - 40.0) * 200.0); };
  write_raster(folder / "offsets.tif", offsets);
  const auto stepped = prepare(options);
  EXPECT_NEAR(height_at(*stepped, 42.51, 1.49), height_at(*surface, 42.51, 1.49), 1e-6);
  const core::Ledger& ledger = stepped->sources()[0].ledger;
  for (const char* name : {"band scale", "band offset"}) {
    ASSERT_EQ(ledger.entries().count(name), 1U) << ledger.table();
    EXPECT_EQ(ledger.entries().at(name).num_used, 1) << name;
  }
  offsets.unit = "smoots";
  write_raster(folder / "offsets.tif", offsets);
  expect_error(ErrorKind::Input, {"offsets.tif", "smoots", "no known unit"},
               [&] { prepare(options); });
  offsets = lat_lon_plane(0.01, 0.01);
  offsets.geotransform = {1.4, 0.01, 0.0, 42.6, 0.0, -0.01};
  offsets.value = metres;
  offsets.height = 20;
  offsets.width = 8;
  write_raster(folder / "offsets.tif", offsets);
  expect_error(ErrorKind::Input, {"offsets.tif", "no offset at latitude"},
               [&] { prepare(options); });
  options.elevation[0].datum_grid = {};
  expect_error(ErrorKind::Config, {"datum_grid"}, [&] { options.validate(); });
  options.elevation[0].vertical_datum = "egm96";
  options.elevation[0].datum_grid = {.written = "offsets.tif", .resolved = folder / "offsets.tif"};
  expect_error(ErrorKind::Config, {"datum_grid needs"}, [&] { options.validate(); });
}

struct Colour {
  int red, green, blue;
};
/// Colours of a height by the published formulas, solved for whole steps.
Colour mapbox(double height_m) {
  const int code = static_cast<int>(std::lround((height_m + 10000.0) * 10.0));
  return {code >> 16, (code >> 8) & 255, code & 255};
}
Colour terrarium(double height_m) {
  const double value = height_m + 32768.0;
  const int whole = static_cast<int>(std::floor(value));
  return {whole >> 8, whole & 255, static_cast<int>(std::lround((value - whole) * 256.0)) & 255};
}

/// A ramp in web mercator metres, in steps that both encodings hold.
double mercator_ramp_m(double u, double v) {
  return std::round(700.0 + 0.04 * (u - 167000.0) - 0.06 * (v - 5236000.0));
}

/// Tiles of 256 pixels about the origin; `is_there` leaves some out.
void write_tiles(const std::filesystem::path& folder, int zoom, Colour (*encode)(double),
                 const std::function<bool(int x, int y)>& is_there) {
  GDALAllRegister();
  constexpr double kHalf_m = 20037508.342789244;
  const double side_m = 2.0 * kHalf_m / (1 << zoom);
  const double u0 = kHalf_m * kOriginLon_deg / 180.0;
  const double v0 = kHalf_m / M_PI * std::log(std::tan(M_PI / 4.0 + kOriginLat_deg * M_PI / 360.0));
  const int x0 = static_cast<int>((u0 + kHalf_m) / side_m);
  const int y0 = static_cast<int>((kHalf_m - v0) / side_m);
  GDALDriver* memory = GetGDALDriverManager()->GetDriverByName("MEM");
  GDALDriver* png = GetGDALDriverManager()->GetDriverByName("PNG");
  for (int x = x0 - 1; x <= x0 + 1; ++x)
    for (int y = y0 - 1; y <= y0 + 1; ++y) {
      if (!is_there(x - x0, y - y0)) continue;
      GDALDataset* tile = memory->Create("", 256, 256, 3, GDT_Byte, nullptr);
      for (int j = 0; j < 256; ++j)
        for (int i = 0; i < 256; ++i) {
          const double u = -kHalf_m + (x + (i + 0.5) / 256.0) * side_m;
          const double v = kHalf_m - (y + (j + 0.5) / 256.0) * side_m;
          const Colour colour = encode(mercator_ramp_m(u, v));
          std::uint8_t bytes[3] = {static_cast<std::uint8_t>(colour.red),
                                   static_cast<std::uint8_t>(colour.green),
                                   static_cast<std::uint8_t>(colour.blue)};
          ASSERT_EQ(tile->RasterIO(GF_Write, i, j, 1, 1, bytes, 1, 1, GDT_Byte, 3, nullptr, 0, 0, 0,
                                   nullptr),
                    CE_None);
        }
      const auto column = folder / std::to_string(zoom) / std::to_string(x);
      std::filesystem::create_directories(column);
      GDALClose(png->CreateCopy((column / (std::to_string(y) + ".png")).c_str(), tile, FALSE,
                                nullptr, nullptr, nullptr));
      GDALClose(tile);
    }
}

TEST(TerrainTiles, FoldersOfColoursAreHeights) {
  const ScratchFolder folder;
  constexpr double kHalf_m = 20037508.342789244;
  write_tiles(folder / "mapbox", 12, mapbox, [](int, int) { return true; });
  write_tiles(folder / "mapbox", 3, mapbox, [](int x, int y) { return x == 0 && y == 0; });
  write_tiles(folder / "terrarium", 12, terrarium, [](int, int) { return true; });
  for (const char* encoding : {"mapbox", "terrarium"}) {
    tiler::WorldOptions options = smooth(world_of_rasters({folder / encoding}));
    options.elevation[0].encoding = encoding;
    const auto surface = prepare(options);
    for (const double d_deg : {-0.011, 0.0, 0.009}) {
      const double lat_deg = 42.5 + d_deg;
      const double u = kHalf_m * (1.5 - d_deg) / 180.0;
      const double v = kHalf_m / M_PI * std::log(std::tan(M_PI / 4.0 + lat_deg * M_PI / 360.0));
      const double truth_m = 700.0 + 0.04 * (u - 167000.0) - 0.06 * (v - 5236000.0);
      // Whole metres; half a pixel of shift would be 1.9 m.
      EXPECT_NEAR(height_at(*surface, lat_deg, 1.5 - d_deg), truth_m, 0.75) << encoding;
    }
    // 38.2 m of mercator are 28.2 m on the ground at 42.5 N.
    EXPECT_NEAR(surface->sources()[0].spacing_m, 28.2, 0.1);
  }
}

TEST(TerrainTiles, MissingAndBlackOnesHaveNoHeights) {
  const ScratchFolder folder;
  // The origin lies half a kilometre from the western border of its tile.
  write_tiles(folder / "some", 12, mapbox, [](int x, int y) { return x != -1 || y != 0; });
  tiler::WorldOptions options = smooth(world_of_rasters({folder / "some"}, 8192.0));
  options.elevation[0].encoding = "mapbox";
  expect_error(ErrorKind::Input, {"no raster covers", "longitude 1.4"}, [&] { prepare(options); });
  options.outside = "extend";
  const auto surface = prepare(options);
  EXPECT_EQ(surface->sources()[surface->sample(-3000.0, 0.0).source].kind, "extend");
  EXPECT_EQ(surface->sources()[surface->sample(2000.0, 0.0).source].kind, "raster");
}

TEST(TerrainTiles, WhatIsNoneIsRefused) {
  const ScratchFolder folder;
  std::filesystem::create_directories(folder / "empty" / "7" / "3");
  const auto world_of_tiles = [&](const char* name) {
    tiler::WorldOptions options = world_of_rasters({folder / name});
    options.elevation[0].encoding = "mapbox";
    return options;
  };
  expect_error(ErrorKind::Input, {"empty", "z/x/y.png"}, [&] { prepare(world_of_tiles("empty")); });
  std::filesystem::create_directories(folder / "off" / "2" / "9");
  std::ofstream(folder / "off" / "2" / "9" / "1.png") << "x";
  expect_error(ErrorKind::Input, {"2/9/1", "off the map"}, [&] { prepare(world_of_tiles("off")); });
  std::filesystem::create_directories(folder / "words" / "2" / "1");
  std::ofstream(folder / "words" / "2" / "1" / "1.png") << "x";
  expect_error(ErrorKind::Input, {"1.png", "PNG"}, [&] { prepare(world_of_tiles("words")); });
  // Heights in one band are no colours.
  write_raster(folder / "plane.tif", lat_lon_plane());
  expect_error(ErrorKind::Input, {"encoding = \"mapbox\""},
               [&] { prepare(world_of_tiles("plane.tif")); });
}

}  // namespace
}  // namespace terracast::test
