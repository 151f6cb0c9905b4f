#include <GeographicLib/UTMUPS.hpp>
#include <cmath>
#include <fstream>
#include <map>

#include "core/random.h"
#include "tests/support/peak_memory.h"
#include "tests/tiler/land_cover_worlds.h"
#include "tests/tiler/raster_files.h"
#include "tiler/land_cover/legend.h"
#include "tiler/land_cover/water_bodies.h"
#include "tiler/layer_stack.h"
#include "tiler/raster_grid.h"

namespace terracast::test {
namespace {

using core::ErrorKind;
using tiler::LandClass;
using tiler::WorldSurface;
using world::Cover;

/// A world with land cover from rasters; `toml` holds what is beside files.
tiler::WorldOptions world_with_cover(const std::vector<std::filesystem::path>& files,
                                     const std::string& toml, double size_m = 4096.0,
                                     const std::string& ground = "plane") {
  tiler::WorldOptions options = world_of(ground, size_m);
  std::string list;
  for (const auto& file : files) list += "\"" + file.string() + "\", ";
  options.layers.push_back(land_cover_layer("files = [" + list + "]\n" + toml));
  return options;
}

/// Codes on a grid of `spacing_m` in UTM zone 31 about the origin.
RasterSpec code_spec(double size_m, double spacing_m,
                     const std::function<double(double u, double v)>& code) {
  RasterSpec spec = utm_spec(size_m, spacing_m);
  spec.type = GDT_Byte;
  spec.value = code;
  return spec;
}

/// Easting and northing of a place of the surface, by GeographicLib.
Eigen::Vector2d utm_of(const WorldSurface& surface, const Eigen::Vector2d& place_world) {
  const auto sample = surface.sample(place_world.x(), place_world.y());
  const geo::Geodetic place =
      surface.frame().geodetic_from_world({place_world.x(), place_world.y(), sample.z_world});
  return utm31(place.lat_deg, place.lon_deg);
}

std::int64_t count_of(const WorldSurface& surface, const std::string& name) {
  for (const auto& [key, count] : surface.layers().infos().at(0).counts)
    if (key == name) return count;
  ADD_FAILURE() << "no count " << name;
  return -1;
}

/// ESA's codes, scattered over pixels without a pattern.
int scattered_code(std::int64_t column, std::int64_t row) {
  constexpr int kCodes[] = {10, 20, 30, 40, 50, 60, 70, 90};
  return kCodes[core::random_bits(7, static_cast<std::uint64_t>(column),
                                  static_cast<std::uint64_t>(row)) %
                8];
}
Cover cover_of_code(int code) {
  static const std::map<int, Cover> kCovers = {
      {10, Cover::Forest},  {20, Cover::Shrubs}, {30, Cover::Grass}, {40, Cover::Crops},
      {50, Cover::BuiltUp}, {60, Cover::Bare},   {70, Cover::Snow},  {90, Cover::Wetland}};
  return kCovers.at(code);
}

constexpr double kPixel_m = 20.0;

RasterSpec scattered_spec() {
  return code_spec(4096.0, kPixel_m, [](double u, double v) {
    return scattered_code(static_cast<std::int64_t>(std::floor(u / kPixel_m)),
                          static_cast<std::int64_t>(std::floor(v / kPixel_m)));
  });
}

/// The corners of the drawn raster lie on multiples of a pixel.
RasterSpec on_lattice(RasterSpec spec) {
  spec.geotransform[0] = std::floor(spec.geotransform[0] / kPixel_m) * kPixel_m;
  spec.geotransform[3] = std::ceil(spec.geotransform[3] / kPixel_m) * kPixel_m;
  return spec;
}

TEST(LandCover, EachPlaceHasTheClassOfItsPixelInTheRastersOwnProjection) {
  const ScratchFolder folder;
  write_raster(folder / "classes.tif", on_lattice(scattered_spec()));
  tiler::WorldOptions options =
      world_with_cover({folder / "classes.tif"}, "legend = \"worldcover\"\nborder_px = 0.0");
  options.elevation[0].height_m = 1800.0;  // leaning up moves places by metres
  const auto surface = prepare(options);
  int num_compared = 0;
  for (const Eigen::Vector2d& place : scattered_places(4096.0, 3000)) {
    const Eigen::Vector2d at = utm_of(*surface, place) / kPixel_m;
    const Eigen::Vector2d cell = at.array().floor();
    // A centimetre beside a pixel's side either class is right.
    if (((at - cell).array() - 0.5).abs().maxCoeff() > 0.5 - 0.01 / kPixel_m) continue;
    ++num_compared;
    EXPECT_EQ(cover_at(*surface, place),
              cover_of_code(scattered_code(static_cast<std::int64_t>(cell.x()),
                                           static_cast<std::int64_t>(cell.y()))));
  }
  EXPECT_GT(num_compared, 2900);
}

TEST(LandCover, GeographicRastersNeedNoProjection) {
  const ScratchFolder folder;
  RasterSpec spec;
  spec.crs = "EPSG:4326";
  spec.type = GDT_Byte;
  spec.width = spec.height = 700;
  spec.geotransform = {1.465, 0.0001, 0.0, 42.535, 0.0, -0.0001};
  // Not on sides of pixels, where a rounding in the last place would decide.
  const auto code = [](double lat, double lon) {
    return lat > 42.50005 ? (lon > 1.50005 ? 10 : 40) : (lon > 1.50005 ? 60 : 20);
  };
  spec.value = [&](double u, double v) { return code(v, u); };
  write_raster(folder / "classes.tif", spec);
  const auto surface = prepare(
      world_with_cover({folder / "classes.tif"}, "legend = \"worldcover\"\nborder_px = 0.0"));
  for (const Eigen::Vector2d& at : scattered_places(4096.0, 500)) {
    const geo::Geodetic place = surface->frame().geodetic_from_world(
        {at.x(), at.y(), surface->sample(at.x(), at.y()).z_world});
    if (std::abs(place.lat_deg - 42.5) < 1.1e-4 || std::abs(place.lon_deg - 1.5) < 1.1e-4) continue;
    EXPECT_EQ(cover_at(*surface, at), cover_of_code(code(place.lat_deg, place.lon_deg)));
  }
}

TEST(LandCover, BordersStrayByNoMoreThanIsStatedAndDoStray) {
  const ScratchFolder folder;
  write_raster(folder / "classes.tif", on_lattice(scattered_spec()));
  const std::string toml = "legend = \"worldcover\"\nborder_px = 0.6\n";
  const auto surface = prepare(world_with_cover({folder / "classes.tif"}, toml));
  const auto other = prepare(world_with_cover({folder / "classes.tif"}, toml + "seed = 5"));
  // Metres of the projection are longer than metres of the ground by less than 4e-4.
  const double reach_m = 0.6 * kPixel_m * 1.0005 + 0.01;
  int num_strayed = 0;
  int num_differ = 0;
  constexpr int kNumPlaces = 3000;
  for (const Eigen::Vector2d& place : scattered_places(4096.0, kNumPlaces)) {
    const Eigen::Vector2d at = utm_of(*surface, place);
    const Cover found = cover_at(*surface, place);
    const Eigen::Vector2d cell = (at / kPixel_m).array().floor();
    bool is_near = false;
    for (int dj = -1; dj <= 1; ++dj)
      for (int di = -1; di <= 1; ++di) {
        const Eigen::Vector2d corner = (cell + Eigen::Vector2d(di, dj)) * kPixel_m;
        const Eigen::Vector2d nearest =
            at.cwiseMax(corner).cwiseMin(corner + Eigen::Vector2d::Constant(kPixel_m));
        const Cover own = cover_of_code(scattered_code(static_cast<std::int64_t>(cell.x()) + di,
                                                       static_cast<std::int64_t>(cell.y()) + dj));
        if (own == found && (nearest - at).norm() <= reach_m) is_near = true;
        if (di == 0 && dj == 0 && own != found) ++num_strayed;
      }
    EXPECT_TRUE(is_near) << place.transpose();
    if (cover_at(*other, place) != found) ++num_differ;
  }
  EXPECT_GT(num_strayed, kNumPlaces / 10);
  EXPECT_GT(num_differ, kNumPlaces / 20);
}

TEST(LandCover, LegendsHoldTheCodesOfTheirProducts) {
  // Copied by hand from the products' own tables.
  const auto worldcover = tiler::make_legend("worldcover", {}).classes;
  EXPECT_EQ(worldcover.size(), 12u);
  for (const auto& [code, land_class] : std::map<int, LandClass>{{10, LandClass::Forest},
                                                                 {20, LandClass::Shrubs},
                                                                 {30, LandClass::Grass},
                                                                 {40, LandClass::Crops},
                                                                 {50, LandClass::BuiltUp},
                                                                 {60, LandClass::Bare},
                                                                 {70, LandClass::Snow},
                                                                 {80, LandClass::Lake},
                                                                 {90, LandClass::Wetland},
                                                                 {95, LandClass::Forest},
                                                                 {100, LandClass::Grass}})
    EXPECT_EQ(worldcover.at(code), land_class) << code;

  const auto corine = tiler::make_legend("corine", {}).classes;
  // GRID_CODE and CLC_CODE of clc_legend.csv.
  const std::pair<int, int> numbers[] = {{1, 111},  {2, 112},  {6, 124},  {10, 141}, {11, 142},
                                         {12, 211}, {18, 231}, {22, 244}, {23, 311}, {26, 321},
                                         {29, 324}, {31, 332}, {34, 335}, {35, 411}, {37, 421},
                                         {39, 423}, {40, 511}, {41, 512}, {42, 521}, {44, 523}};
  for (const auto& [number, code] : numbers) EXPECT_EQ(corine.at(number), corine.at(code)) << code;
  EXPECT_EQ(corine.at(112), LandClass::BuiltUp);
  EXPECT_EQ(corine.at(211), LandClass::Crops);
  EXPECT_EQ(corine.at(312), LandClass::Forest);
  EXPECT_EQ(corine.at(332), LandClass::Bare);
  EXPECT_EQ(corine.at(335), LandClass::Snow);
  EXPECT_EQ(corine.at(512), LandClass::Lake);
  EXPECT_EQ(corine.at(523), LandClass::OtherWater);
  EXPECT_EQ(corine.at(999), LandClass::Unknown);
  EXPECT_EQ(corine.count(45), 0u);

  const auto nlcd = tiler::make_legend("nlcd", {}).classes;
  for (const int code :
       {11, 12, 21, 22, 23, 24, 31, 41, 42, 43, 51, 52, 71, 72, 73, 74, 81, 82, 90, 95})
    EXPECT_EQ(nlcd.count(code), 1u) << code;
  EXPECT_EQ(nlcd.at(42), LandClass::Forest);
  EXPECT_EQ(nlcd.at(23), LandClass::BuiltUp);
  EXPECT_EQ(nlcd.at(82), LandClass::Crops);
  EXPECT_EQ(nlcd.at(95), LandClass::Wetland);
}

TEST(LandCover, ClassesOfTheConfigOverruleTheLegend) {
  const auto legend = tiler::make_legend("worldcover", {"10=shrubs", " 7 =  built_up "});
  EXPECT_EQ(legend.classes.at(10), LandClass::Shrubs);
  EXPECT_EQ(legend.classes.at(7), LandClass::BuiltUp);
  EXPECT_EQ(legend.classes.at(20), LandClass::Shrubs);
  const auto refuse = [](const std::string& legend_name, const std::vector<std::string>& classes,
                         const std::vector<std::string>& words) {
    expect_error(ErrorKind::Config, words, [&] { tiler::make_legend(legend_name, classes); });
  };
  refuse("none", {}, {"stand for nothing", "worldcover"});
  refuse("none", {"10 = florest"}, {"florest", "nearest: \"forest\""});
  refuse("none", {"forest"}, {"CODE = CLASS"});
  refuse("none", {"x = forest"}, {"CODE = CLASS"});
  refuse("none", {"-3 = forest"}, {"0 to 65535"});
  refuse("none", {"3 = forest", "3 = bare"}, {"3 is given twice"});
  refuse("worldkover", {}, {"nearest: \"worldcover\""});
}

TEST(LandCover, UnknownCodesAreRefusedWithTheirPixel) {
  const ScratchFolder folder;
  RasterSpec spec = code_spec(4096.0, 32.0, [](double, double) { return 30.0; });
  const double u = spec.geotransform[0] + (70 + 0.5) * 32.0;
  const double v = spec.geotransform[3] - (81 + 0.5) * 32.0;
  spec.value = [=](double x, double y) {
    return std::abs(x - u) < 1.0 && std::abs(y - v) < 1.0 ? 77.0 : 30.0;
  };
  write_raster(folder / "classes.tif", spec);
  const auto options = [&](const std::string& toml) {
    return world_with_cover({folder / "classes.tif"}, "legend = \"worldcover\"\n" + toml);
  };
  expect_error(ErrorKind::Input,
               {"classes.tif", "pixel (70, 81)", "holds 77", "worldcover", "10, 20, 30",
                "77 = forest", "77 = unknown"},
               [&] { prepare(options("")); });
  const auto surface = prepare(options("classes = [\"77 = unknown\"]"));
  EXPECT_EQ(count_of(*surface, "samples of unknown class"), 1);
  const auto with_bare = prepare(options("classes = [\"77 = bare\"]\nborder_px = 0.0"));
  int num_bare = 0;
  for (int j = -2048; j < 2048; j += 8)
    for (int i = -2048; i < 2048; i += 8)
      if (cover_at(*with_bare, {i, j}) == Cover::Bare) ++num_bare;
  EXPECT_NEAR(num_bare, 16, 4);  // a pixel of 32 m, seen every 8 m
}

TEST(LandCover, WhereASourceHasNoDataTheNextIsAsked) {
  const ScratchFolder folder;
  const double middle = utm31(kOriginLat_deg, kOriginLon_deg).x();
  RasterSpec west = code_spec(4096.0, 16.0, [=](double u, double) {
    return u < middle - 500.0 ? 10.0 : u < middle + 500.0 ? 255.0 : 0.0;
  });
  west.nodata = 255.0;  // beside 0, which the legend calls unknown
  write_raster(folder / "west.tif", west);
  RasterSpec east =
      code_spec(4096.0, 16.0, [=](double u, double) { return u < middle + 1000.0 ? 40.0 : 255.0; });
  east.nodata = 255.0;
  write_raster(folder / "east.tif", east);
  tiler::WorldOptions options = world_with_cover({folder / "west.tif", folder / "east.tif"},
                                                 "legend = \"worldcover\"\nborder_px = 0.0");
  const auto check = [&](const WorldSurface& surface, Cover last) {
    for (const double y : {-1900.0, 3.0, 1900.0}) {
      EXPECT_EQ(cover_at(surface, {-1500.0, y}), Cover::Forest);
      EXPECT_EQ(cover_at(surface, {-100.0, y}), Cover::Crops);
      EXPECT_EQ(cover_at(surface, {700.0, y}), Cover::Crops);
      EXPECT_EQ(cover_at(surface, {1500.0, y}), last);
    }
  };
  const auto surface = prepare(options);
  check(*surface, Cover::Land);
  EXPECT_GT(count_of(*surface, "samples without data"), 0);
  EXPECT_GT(count_of(*surface, "samples of unknown class"), 0);
  // Another layer behind.
  write_raster(folder / "all.tif", code_spec(4096.0, 64.0, [](double, double) { return 3.0; }));
  options.layers.push_back(
      land_cover_layer("name = \"behind\"\nclasses = [\"3 = wetland\"]\nfiles = [\"" +
                       (folder / "all.tif").string() + "\"]"));
  check(*prepare(options), Cover::Wetland);
  // What the file does not declare can be stated.
  west.nodata.reset();
  write_raster(folder / "west.tif", west);
  expect_error(ErrorKind::Input, {"holds 255"}, [&] { prepare(options); });
  options.layers[0] = land_cover_layer(
      "legend = \"worldcover\"\nborder_px = 0.0\nnodata = \"255\"\n"
      "files = [\"" +
      (folder / "west.tif").string() + "\", \"" + (folder / "east.tif").string() + "\"]");
  check(*prepare(options), Cover::Wetland);
}

TEST(LandCover, RastersThatLieElsewhereOrNowhereAreRefused) {
  const ScratchFolder folder;
  RasterSpec spec = code_spec(4096.0, 32.0, [](double, double) { return 10.0; });
  const auto refuse = [&](const std::vector<std::string>& words) {
    write_raster(folder / "classes.tif", spec);
    expect_error(ErrorKind::Input, words, [&] {
      prepare(world_with_cover({folder / "classes.tif"}, "legend = \"worldcover\""));
    });
  };
  spec.crs = "EPSG:32632";  // the right numbers in the wrong zone: 6 degrees to the east
  refuse(
      {"classes.tif", "nothing of it lies in the world's square", "longitude 7.50", "EPSG:32632"});
  spec.crs = "";
  refuse({"states no coordinate reference system"});
  spec.crs = "LOCAL_CS[\"grid\",UNIT[\"metre\",1]]";
  refuse({"neither geographic nor projected"});
  spec.crs = "EPSG:32631";
  spec.num_bands = 3;
  refuse({"3 bands", "one, of class codes"});
  spec.num_bands = 1;
  spec.type = GDT_Float32;
  spec.value = [](double, double) { return 10.5; };
  refuse({"holds 10.5", "class codes"});
  // NaN is no code: the raster says nothing there.
  spec.value = [](double, double) { return std::nan(""); };
  write_raster(folder / "classes.tif", spec);
  EXPECT_NO_THROW(prepare(world_with_cover({folder / "classes.tif"}, "legend = \"worldcover\"")));
  spec.type = GDT_Int16;
  spec.value = [](double, double) { return -5.0; };
  refuse({"holds -5"});
  std::ofstream(folder / "empty.tif").close();
  expect_error(ErrorKind::Input, {"empty.tif: is empty", "fetch or write it again"}, [&] {
    prepare(world_with_cover({folder / "empty.tif"}, "legend = \"worldcover\""));
  });
  expect_error(ErrorKind::Io, {"absent.tif", "there is no such raster"}, [&] {
    prepare(world_with_cover({folder / "absent.tif"}, "legend = \"worldcover\""));
  });
}

TEST(LandCover, ARasterOfOneSampleIsEnough) {
  const ScratchFolder folder;
  RasterSpec spec = code_spec(4096.0, 32.0, [](double, double) { return 10.0; });
  spec.width = spec.height = 1;
  spec.geotransform[1] = 6000.0;
  spec.geotransform[5] = -6000.0;
  write_raster(folder / "classes.tif", spec);
  const auto surface =
      prepare(world_with_cover({folder / "classes.tif"}, "legend = \"worldcover\""));
  for (const Eigen::Vector2d& place : scattered_places(4096.0))
    EXPECT_EQ(cover_at(*surface, place), Cover::Forest);
  EXPECT_EQ(count_of(*surface, "samples"), 1);
}

TEST(LandCover, OfAHugeRasterOnlyTheSquareIsRead) {
  const ScratchFolder folder;
  const std::filesystem::path file = folder / "huge.tif";
  const Eigen::Vector2d middle = utm31(kOriginLat_deg, kOriginLon_deg);
  constexpr int kSide = 100000;
  {
    GDALAllRegister();
    const char* options[] = {"TILED=YES", "SPARSE_OK=TRUE", nullptr};
    GDALDataset* dataset = GetGDALDriverManager()->GetDriverByName("GTiff")->Create(
        file.c_str(), kSide, kSide, 1, GDT_Byte, const_cast<char**>(options));
    ASSERT_NE(dataset, nullptr);
    OGRSpatialReference crs;
    ASSERT_EQ(crs.SetFromUserInput("EPSG:32631"), OGRERR_NONE);
    dataset->SetSpatialRef(&crs);
    double gt[] = {middle.x() - kSide / 2.0, 1.0, 0.0, middle.y() + kSide / 2.0, 0.0, -1.0};
    dataset->SetGeoTransform(gt);
    std::vector<std::uint8_t> forest(512 * 512, 10);
    ASSERT_EQ(dataset->GetRasterBand(1)->RasterIO(GF_Write, kSide / 2, kSide / 2, 512, 512,
                                                  forest.data(), 512, 512, GDT_Byte, 0, 0, nullptr),
              CE_None);
    GDALClose(dataset);
  }
  const PeakMemory peak;
  const auto surface = prepare(world_with_cover({file}, "legend = \"worldcover\"", 2048.0));
  // 4 million samples of the square; all samples would take 10 GB.
  EXPECT_LT(peak.more_mb(), 300.0);
  EXPECT_EQ(cover_at(*surface, {250.0, -250.0}), Cover::Forest);
  EXPECT_EQ(cover_at(*surface, {-250.0, -250.0}), Cover::Land);
  EXPECT_LT(count_of(*surface, "samples"), 5'000'000);
  expect_error(ErrorKind::Input,
               {"huge.tif", "60000 m takes 37", "keeps up to 1073741824", "a coarser raster"},
               [&] { prepare(world_with_cover({file}, "legend = \"worldcover\"", 60000.0)); });
}

TEST(LandCover, WaterIsALakeWhereItsGroundIsLevel) {
  const ScratchFolder folder;
  const Eigen::Vector2d middle = utm31(kOriginLat_deg, kOriginLon_deg);
  // Two squares of water on a slope of 1 in 100 to the east: of 100 m, which rises by 0.8 m between its
  // tenth and its ninth tenth, and of 400 m, which rises by 3.2 m.
  write_raster(folder / "classes.tif", code_spec(4096.0, 10.0, [=](double u, double v) {
                 const double x = u - middle.x();
                 const double y = v - middle.y();
                 const bool is_small = x > -600.0 && x < -500.0 && y > 0.0 && y < 100.0;
                 const bool is_large = x > 500.0 && x < 900.0 && y > 0.0 && y < 400.0;
                 return is_small || is_large ? 80.0 : 30.0;
               }));
  tiler::WorldOptions options =
      world_with_cover({folder / "classes.tif"}, "legend = \"worldcover\"", 4096.0, "ramp");
  options.elevation[0].slope = 0.01;
  const auto surface = prepare(options);
  EXPECT_EQ(cover_at(*surface, {-550.0, 50.0}), Cover::Lake);
  EXPECT_EQ(cover_at(*surface, {700.0, 200.0}), Cover::Land);
  EXPECT_EQ(count_of(*surface, "lakes"), 1);
  // The lake is level at the slope's height in its middle; the land beside it is as it was.
  const auto height_m = [&](double x, double y) {
    return surface->frame().geodetic_from_world({x, y, surface->sample(x, y).z_world}).height_m;
  };
  for (const double x : {-590.0, -570.0, -550.0, -530.0, -510.0}) {
    EXPECT_NEAR(height_m(x, 50.0), height_m(-550.0, 20.0), 1e-6) << x;
    EXPECT_NEAR(height_m(x, 50.0), -5.5, 0.1) << x;  // samples are 10 m apart: 0.1 m in height
  }
  // The ramp rises along the place's foot on the ellipsoid, micrometres from below the place.
  EXPECT_NEAR(height_m(-620.0, 50.0), -6.2, 2e-5);
  EXPECT_NEAR(height_m(600.0, 200.0), 6.0, 2e-5);
  EXPECT_EQ(count_of(*surface, "samples of lakes"), 100);
  EXPECT_EQ(count_of(*surface, "samples of water left to other layers"), 1600);
  options.layers[0] = land_cover_layer("legend = \"worldcover\"\nlake_flat_m = 4.0\nfiles = [\"" +
                                       (folder / "classes.tif").string() + "\"]");
  EXPECT_EQ(cover_at(*prepare(options), {700.0, 200.0}), Cover::Lake);
  // A river is none, however level.
  options.layers[0] =
      land_cover_layer("classes = [\"30 = grass\", \"80 = other_water\"]\nfiles = [\"" +
                       (folder / "classes.tif").string() + "\"]");
  EXPECT_EQ(cover_at(*prepare(options), {-550.0, 50.0}), Cover::Land);
}

TEST(WaterBodies, AreThoseOfAFloodFill) {
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    tiler::Grid<std::uint8_t> values(37, 23);
    for (std::size_t k = 0; k < values.values.size(); ++k)
      values.values[k] = core::random_unit(seed, 3, k) < 0.55 ? 1 : 0;
    const auto bodies = tiler::find_bodies(values, [](std::uint8_t v) { return v == 1; });
    // Each body's samples, by flooding from its first.
    tiler::Grid<int> flooded(values.width, values.height, -1);
    int num_bodies = 0;
    for (int j = 0; j < values.height; ++j)
      for (int i = 0; i < values.width; ++i) {
        if (values(i, j) != 1 || flooded(i, j) >= 0) continue;
        std::vector<Eigen::Vector2i> open = {{i, j}};
        while (!open.empty()) {
          const Eigen::Vector2i at = open.back();
          open.pop_back();
          if (!values.contains(at.x(), at.y()) || values(at.x(), at.y()) != 1 ||
              flooded(at.x(), at.y()) >= 0)
            continue;
          flooded(at.x(), at.y()) = num_bodies;
          for (const Eigen::Vector2i& step : {Eigen::Vector2i(1, 0), Eigen::Vector2i(-1, 0),
                                              Eigen::Vector2i(0, 1), Eigen::Vector2i(0, -1)})
            open.push_back(at + step);
        }
        ++num_bodies;
      }
    ASSERT_EQ(bodies.size(), static_cast<std::size_t>(num_bodies)) << "seed " << seed;
    std::size_t num_members = 0;
    for (std::size_t b = 0; b < bodies.size(); ++b)
      for (const tiler::SampleRun& run : bodies[b])
        for (int i = 0; i < run.num_columns; ++i) {
          EXPECT_EQ(flooded(run.first_column + i, run.row), static_cast<int>(b));
          ++num_members;
        }
    EXPECT_EQ(num_members,
              static_cast<std::size_t>(std::count(values.values.begin(), values.values.end(), 1)));
  }
}

TEST(LandCoverConfig, ContradictionsAreRefused) {
  expect_error(ErrorKind::Config, {"needs files"}, [] { land_cover_layer("legend = \"nlcd\""); });
  expect_error(ErrorKind::Config, {"reads no files"},
               [] { land_cover_layer("source = \"derived\"\nfiles = [\"a.tif\"]"); });
  expect_error(ErrorKind::Config, {"nodata = \"zero\""}, [] {
    land_cover_layer("files = [\"a.tif\"]\nlegend = \"nlcd\"\nnodata = \"zero\"");
  });
  expect_error(ErrorKind::Config, {"stand for nothing"},
               [] { land_cover_layer("files = [\"a.tif\"]"); });
}

// The codes at places, read by GDAL at the eastings and northings of GeographicLib.
TEST(LandCoverOfZion, IsThatOfTheFileAndItsBroadClasses) {
  TERRACAST_NEEDS_SHARED_DATA("zion/zion_nlcd2011.tif");
  TERRACAST_NEEDS_SHARED_DATA("zion/zion_srtm_3s.tif");
  tiler::WorldOptions options;
  options.origin_lat_deg = 37.32;
  options.origin_lon_deg = -113.04;
  options.size_m = 20480.0;
  tiler::ElevationOptions entry;
  entry.vertical_datum = "egm96";
  entry.files = {{.written = (shared_data() / "zion/zion_srtm_3s.tif").string(),
                  .resolved = shared_data() / "zion/zion_srtm_3s.tif"}};
  options.elevation = {entry};
  const auto layer = [](const std::string& legend, const std::string& file) {
    return land_cover_layer("legend = \"" + legend + "\"\nborder_px = 0.0\nfiles = [\"" +
                            (shared_data() / file).string() + "\"]");
  };
  options.layers = {layer("nlcd", "zion/zion_nlcd2011.tif")};
  const auto surface = prepare(options);
  options.layers = {layer("nlcd_8", "zion/zion_nlcd_8class.tif")};
  const auto broad = prepare(options);

  GDALDataset* dataset = static_cast<GDALDataset*>(
      GDALOpen((shared_data() / "zion/zion_nlcd2011.tif").c_str(), GA_ReadOnly));
  ASSERT_NE(dataset, nullptr);
  double gt[6];
  ASSERT_EQ(dataset->GetGeoTransform(gt), CE_None);
  const std::map<int, Cover> truth = {
      {21, Cover::Grass},  {22, Cover::BuiltUp}, {23, Cover::BuiltUp}, {31, Cover::Bare},
      {41, Cover::Forest}, {42, Cover::Forest},  {43, Cover::Forest},  {52, Cover::Shrubs},
      {71, Cover::Grass},  {81, Cover::Grass},   {82, Cover::Crops},   {90, Cover::Wetland},
      {95, Cover::Wetland}};
  int num_compared = 0, num_same = 0, num_same_broad = 0;
  for (const Eigen::Vector2d& at : scattered_places(options.size_m, 2000)) {
    const auto sample = surface->sample(at.x(), at.y());
    const geo::Geodetic place =
        surface->frame().geodetic_from_world({at.x(), at.y(), sample.z_world});
    int zone = 0;
    bool north = false;
    double u = 0.0, v = 0.0;
    GeographicLib::UTMUPS::Forward(place.lat_deg, place.lon_deg, zone, north, u, v, 12);
    const int i = static_cast<int>(std::floor((u - gt[0]) / gt[1]));
    const int j = static_cast<int>(std::floor((v - gt[3]) / gt[5]));
    std::uint8_t code = 0;
    ASSERT_EQ(dataset->GetRasterBand(1)->RasterIO(GF_Read, i, j, 1, 1, &code, 1, 1, GDT_Byte, 0, 0,
                                                  nullptr),
              CE_None);
    if (truth.count(code) == 0) continue;  // water
    ++num_compared;
    num_same += truth.at(code) == sample.cover ? 1 : 0;
    // 21 counts as developed and 81 as planted there.
    const Cover found = cover_at(*broad, at);
    num_same_broad += found == truth.at(code) || (code == 21 && found == Cover::BuiltUp) ||
                              (code == 81 && found == Cover::Crops)
                          ? 1
                          : 0;
  }
  GDALClose(dataset);
  EXPECT_GT(num_compared, 1900);
  // NAD83 and WGS84 lie up to 2 m apart, of pixels of 31 m: a few places fall into the next one.
  EXPECT_GT(num_same, 0.97 * num_compared);
  EXPECT_GT(num_same_broad, 0.97 * num_compared);
}

}  // namespace
}  // namespace terracast::test
