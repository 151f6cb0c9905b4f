#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <set>

#include "core/atomic_file.h"
#include "core/toml_reader.h"
#include "job/trace.h"
#include "tests/tiler/vector_files.h"
#include "tiler/osm_element.h"
#include "tiler/tile_stage.h"

// Cells of rasters and elements of OpenStreetMap that a trace names, against what GDAL itself says of the files.
namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::Json;
using testing::HasSubstr;

constexpr double kSize_m = 1024.0;
constexpr double kCoverPixel_m = 40.0;
constexpr double kBorder_px = 0.9;

tiler::LayerOptions layer_of(const std::string& toml) {
  tiler::LayerOptions layer;
  core::TomlDocument::parse(toml, "layer.toml").read(layer);
  return layer;
}

world::TileStore tiled(const tiler::WorldOptions& options, const fs::path& folder) {
  const core::Log log("tile", core::LogLevel::Off);
  const core::Context context{.log = log, .num_threads = 0, .events_file = {}};
  tiler::TilePlan plan;
  plan.detail.finest_spacing_m = 8.0;
  plan.sequences.push_back({{.position_world = {0.0, 0.0, 800.0}, .pixels_per_radian = 100.0}});
  return tiler::run_tile_stage(*tiler::WorldSurface::prepare(options, context), plan, folder,
                               context);
}

/// Heights in degrees and in UTM, codes and pictures the other way round, on grids that fit neither each other nor
/// the origin; one is turned.
struct Grids {
  RasterSpec heights, codes, picture;
};

RasterSpec degrees_spec(double step_deg) {
  RasterSpec spec;
  spec.crs = "EPSG:4326";
  spec.width = static_cast<int>(0.031 / step_deg);
  spec.height = static_cast<int>(0.023 / step_deg);
  spec.geotransform = {kOriginLon_deg - 0.0153, step_deg, 0.0,
                       kOriginLat_deg + 0.0117, 0.0,      -0.83 * step_deg};
  return spec;
}

RasterSpec turned(RasterSpec spec) {
  const Eigen::Vector2d middle = utm31(kOriginLat_deg, kOriginLon_deg);
  const double step_m = spec.geotransform[1];
  const double c = std::cos(0.3), s = std::sin(0.3);
  spec.width = spec.height = static_cast<int>(2.0 * kSize_m / step_m);
  const double half = 0.5 * spec.width;
  spec.geotransform = {0.0, step_m * c, step_m * s, 0.0, step_m * s, -step_m * c};
  spec.geotransform[0] = middle.x() - half * (spec.geotransform[1] + spec.geotransform[2]);
  spec.geotransform[3] = middle.y() - half * (spec.geotransform[4] + spec.geotransform[5]);
  return spec;
}

/// Forest in the west, nothing is said of the east.
double code_at_x(double x, double middle_x) { return x < middle_x ? 10.0 : 0.0; }

Grids grids(bool heights_in_degrees) {
  Grids grids;
  const Eigen::Vector2d middle = utm31(kOriginLat_deg, kOriginLon_deg);
  if (heights_in_degrees) {
    grids.heights = degrees_spec(0.0003);
    grids.codes = utm_spec(kSize_m, kCoverPixel_m);
    grids.picture = turned(utm_spec(kSize_m, 8.0));
  } else {
    grids.heights = turned(utm_spec(kSize_m, 20.0));
    grids.codes = degrees_spec(0.0004);
    grids.picture = degrees_spec(0.0001);
  }
  const double middle_x = heights_in_degrees ? middle.x() : kOriginLon_deg;
  grids.heights.value = [](double, double) { return 300.0; };
  grids.codes.type = GDT_Byte;
  grids.codes.nodata = 0.0;
  grids.codes.value = [=](double u, double) { return code_at_x(u, middle_x); };
  grids.picture.type = GDT_Byte;
  grids.picture.value = [](double, double) { return 120.0; };
  return grids;
}

/// Where a place lies in a file by GDAL's geotransform of it, in pixels; UTM by GeographicLib.
Eigen::Vector2d pixel_by_gdal(const fs::path& file, double lat_deg, double lon_deg) {
  auto* dataset = static_cast<GDALDataset*>(GDALOpen(file.c_str(), GA_ReadOnly));
  if (dataset == nullptr) throw std::runtime_error(file.string());
  double gt[6], inverse[6];
  EXPECT_EQ(dataset->GetGeoTransform(gt), CE_None);
  const bool is_geographic = dataset->GetSpatialRef()->IsGeographic() != 0;
  GDALClose(dataset);
  EXPECT_NE(GDALInvGeoTransform(gt, inverse), 0);
  const Eigen::Vector2d at =
      is_geographic ? Eigen::Vector2d(lon_deg, lat_deg) : utm31(lat_deg, lon_deg);
  Eigen::Vector2d pixel;
  GDALApplyGeoTransform(inverse, at.x(), at.y(), &pixel.x(), &pixel.y());
  return pixel;
}

bool is_beside_a_side(const Eigen::Vector2d& pixel) {
  const Eigen::Array2d within = pixel.array() - pixel.array().floor();
  return (within - 0.5).abs().maxCoeff() > 0.5 - 1e-4;
}

void expect_cell(const Json& cell, const Eigen::Vector2d& pixel, const std::string& what) {
  ASSERT_FALSE(cell.is_null()) << what;
  EXPECT_EQ(cell.at("column").integer(), static_cast<std::int64_t>(std::floor(pixel.x()))) << what;
  EXPECT_EQ(cell.at("row").integer(), static_cast<std::int64_t>(std::floor(pixel.y()))) << what;
}

class TraceCells : public testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    const Grids all = grids(GetParam());
    write_raster(folder_ / "heights.tif", all.heights);
    write_raster(folder_ / "codes.tif", all.codes);
    write_raster(folder_ / "picture.tif", all.picture);
    tiler::WorldOptions options = world_of_rasters({folder_ / "heights.tif"}, kSize_m);
    options.elevation[0].accuracy = "2 m";
    options.layers.push_back(
        layer_of("kind = \"land_cover\"\nname = \"mapped\"\nlegend = "
                 "\"worldcover\"\nlicence = \"by hand\"\nfiles = [\"" +
                 (folder_ / "codes.tif").string() + "\"]\n"));
    options.layers.push_back(
        layer_of("kind = \"land_cover\"\nname = \"guessed\"\nsource = \"derived\"\n"));
    options.layers.push_back(
        layer_of("kind = \"imagery\"\nfiles = [\"" + (folder_ / "picture.tif").string() + "\"]\n"));
    store_.emplace(tiled(options, folder_ / "world"));
  }

  const ScratchFolder folder_;
  std::optional<world::TileStore> store_;
};

TEST_P(TraceCells, AreThoseOfGdalsOwnGeotransforms) {
  int num_compared = 0, num_mapped = 0, num_guessed = 0, num_doubtful = 0;
  for (const Eigen::Vector2d& at : scattered_places(kSize_m, 40)) {
    const Json trace = job::trace_world_place(*store_, at);
    const double lat_deg = trace.at("place").at("lat_deg").number();
    const double lon_deg = trace.at("place").at("lon_deg").number();
    const auto pixel = [&](const char* file) {
      return pixel_by_gdal(folder_ / file, lat_deg, lon_deg);
    };
    if (is_beside_a_side(pixel("heights.tif")) || is_beside_a_side(pixel("codes.tif")) ||
        is_beside_a_side(pixel("picture.tif")))
      continue;
    ++num_compared;
    const std::string what = trace.text();
    expect_cell(trace.at("elevation").at("cell"), pixel("heights.tif"), what);
    ASSERT_TRUE(trace.has("imagery")) << what;
    ASSERT_EQ(trace.at("imagery").at("cells").size(), 1U) << what;
    expect_cell(trace.at("imagery").at("cells").at(0), pixel("picture.tif"), what);
    EXPECT_EQ(trace.at("imagery").at("cells").at(0).at("source").string(), "picture.tif");

    // Farther from the border than it may be bent, and than half a diagonal of the tiles' cells, the layer is known.
    const Eigen::Vector2d utm = utm31(lat_deg, lon_deg);
    const double to_border_m = std::abs(utm.x() - utm31(lat_deg, kOriginLon_deg).x());
    const bool is_west = lon_deg < kOriginLon_deg;
    const double doubt_m =
        (kBorder_px + 1.5) * kCoverPixel_m + trace.at("tile").at("spacing_m").number();
    const Json& layers = trace.at("cover").at("layers");
    std::set<std::string> names;
    for (std::size_t i = 0; i < layers.size(); ++i) names.insert(layers.at(i).at("name").string());
    if (to_border_m > doubt_m) {
      EXPECT_EQ(names, std::set<std::string>{is_west ? "mapped" : "guessed"}) << what;
      ++(is_west ? num_mapped : num_guessed);
    } else {
      EXPECT_TRUE(names.contains("mapped") || names.contains("guessed")) << what;
      ++num_doubtful;
    }
    for (std::size_t i = 0; i < layers.size(); ++i)
      if (layers.at(i).at("name").string() == "mapped") {
        ASSERT_EQ(layers.at(i).at("cells").size(), 1U) << what;
        expect_cell(layers.at(i).at("cells").at(0), pixel("codes.tif"), what);
      }
  }
  EXPECT_GT(num_compared, 30);
  EXPECT_GT(num_mapped, 5);
  EXPECT_GT(num_guessed, 5);
  EXPECT_GT(num_doubtful, 2);
}

TEST_P(TraceCells, AreWrittenOutWithWhatIsNotStated) {
  const Json trace = job::trace_world_place(*store_, {-300.3, 40.1});
  const std::string text = job::trace_text(trace);
  const Json& cell = trace.at("elevation").at("cell");
  EXPECT_THAT(text, HasSubstr(fmt::format("cell: column {}, row {} (counted from 0)",
                                          cell.at("column").integer(), cell.at("row").integer())));
  EXPECT_THAT(text, HasSubstr("of codes.tif (counted from 0)"));
  EXPECT_THAT(text, HasSubstr("of picture.tif (counted from 0)"));
  EXPECT_THAT(text, HasSubstr("licence: not stated\n            accuracy: 2 m"));
  EXPECT_THAT(text, HasSubstr("licence: by hand\n            accuracy: not stated"));

  // An older world has none, and damage is found.
  const fs::path rasters = folder_ / "world/rasters.json";
  const std::string whole = core::read_text_file(rasters);
  const auto again = [&] { return job::trace_world_place(*store_, {-300.3, 40.1}); };

  std::string turned = whole;
  const std::size_t digit = turned.find("\"width_px\": ") + 12;
  turned[digit] = turned[digit] == '9' ? '8' : '9';
  std::ofstream(rasters) << turned;
  expect_error(ErrorKind::Input, {"rasters.json", "tile the world again"}, [&] { again(); });

  fs::remove(rasters);
  const Json old = again();
  EXPECT_TRUE(old.at("elevation").at("cell").is_null());
  EXPECT_EQ(old.at("cover").at("layers").size(), 2U) << old.text();
  EXPECT_THAT(job::trace_text(old), HasSubstr("cell: not known"));

  std::ofstream(rasters) << whole;
  const fs::path covers = folder_ / "world/land_cover/0_0.png";
  std::string bytes = core::read_text_file(covers);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 4);
  std::ofstream(covers, std::ios::binary) << bytes;
  expect_error(ErrorKind::Input, {"0_0.png", "tile the world again"}, [&] { again(); });
}

INSTANTIATE_TEST_SUITE_P(HeightsIn, TraceCells, testing::Values(false, true),
                         [](const auto& param) { return param.param ? "Degrees" : "TurnedUtm"; });

TEST(TraceOfTheSea, NamesTheRasterThatMeasuredItsFloorAndNoneWhereItIsMadeUp) {
  // Land in the west; in the north a sea whose floor falls by 3 in 100, in the south one of zeros.
  const ScratchFolder folder;
  const Eigen::Vector2d middle = utm31(kOriginLat_deg, kOriginLon_deg);
  tiler::WorldOptions options = world_of_rasters({}, kSize_m);
  options.elevation.clear();
  for (const bool is_north : {true, false}) {
    RasterSpec half = utm_spec(kSize_m, 20.0);
    half.height /= 2;
    if (!is_north) half.geotransform[3] -= 20.0 * half.height;
    half.value = [&](double u, double) {
      const double east_m = u - middle.x();
      return east_m < 0.0 ? -0.1 * east_m : is_north ? -0.03 * east_m : 0.0;
    };
    const fs::path file = folder / (is_north ? "depths.tif" : "zeros.tif");
    write_raster(file, half);
    tiler::ElevationOptions entry = world_of_rasters({file}).elevation[0];
    entry.vertical_datum = "egm96";
    entry.sea = is_north ? "below" : "auto";
    entry.sea_min_km2 = 0.1;
    entry.licence = is_north ? "CC0" : "CC BY";
    entry.accuracy = is_north ? "0.5 m" : "10 m";
    options.elevation.push_back(std::move(entry));
  }
  const world::TileStore store = tiled(options, folder / "world");
  for (const Eigen::Vector2d& at :
       {Eigen::Vector2d(203.0, 254.0), Eigen::Vector2d(404.0, 55.0), Eigen::Vector2d(-297.0, 150.0),
        Eigen::Vector2d(-203.0, -254.0)}) {
    const Json trace = job::trace_world_place(store, at);
    ASSERT_EQ(trace.at("cover").at("name").string(), at.x() > 0.0 ? "sea" : "land") << trace.text();
    const bool is_north = at.y() > 0.0;
    const char* file = is_north ? "depths.tif" : "zeros.tif";
    const Json& elevation = trace.at("elevation");
    EXPECT_EQ(elevation.at("source").string(), file) << trace.text();
    EXPECT_EQ(elevation.at("kind").string(), "raster");
    EXPECT_EQ(elevation.at("licence").string(), is_north ? "CC0" : "CC BY");
    EXPECT_EQ(elevation.at("accuracy").string(), is_north ? "0.5 m" : "10 m");
    const Eigen::Vector2d pixel =
        pixel_by_gdal(folder / file, trace.at("place").at("lat_deg").number(),
                      trace.at("place").at("lon_deg").number());
    ASSERT_FALSE(is_beside_a_side(pixel));
    expect_cell(elevation.at("cell"), pixel, trace.text());
    EXPECT_THAT(job::trace_text(trace),
                HasSubstr(fmt::format("elevation   {} (raster), above egm96, every 20 m\n"
                                      "            cell: column {}, row {} (counted from 0)\n",
                                      file, static_cast<int>(std::floor(pixel.x())),
                                      static_cast<int>(std::floor(pixel.y())))));
  }
  const Json made_up = job::trace_world_place(store, {300.0, -250.0});
  ASSERT_EQ(made_up.at("cover").at("name").string(), "sea") << made_up.text();
  EXPECT_EQ(made_up.at("elevation").at("kind").string(), "sea") << made_up.text();
  EXPECT_TRUE(made_up.at("elevation").at("spacing_m").is_null());
  EXPECT_FALSE(made_up.at("elevation").has("cell"));
  EXPECT_THAT(job::trace_text(made_up),
              HasSubstr("elevation   sea (sea), above egm96\n"
                        "            its floor is made up: no source knows it\n"
                        "            licence: not stated\n"));
}

TEST(OsmElement, IsWhatItsNumberSays) {
  // Seen in Monaco in 2026: 2 * 2^60 + 262902069.
  EXPECT_EQ(tiler::osm_element(2305843009476596021U), "way/262902069");
  EXPECT_EQ(tiler::osm_element(1152921504606846976U + 13000000000U), "node/13000000000");
  EXPECT_EQ(tiler::osm_element(3458764513820540928U + 1U), "relation/1");
  for (const std::uint64_t other :
       {std::uint64_t{0}, std::uint64_t{4242}, std::uint64_t{4611686018427387904U + 7U},
        std::uint64_t{2305843009213693952U + (std::uint64_t{1} << 45)},
        std::uint64_t{0xfedcba9876543210U}})
    EXPECT_EQ(tiler::osm_element(other), std::nullopt) << other;
}

TEST(TraceOfElements, NamesThoseOfOpenStreetMapAndNoOthers) {
  const ScratchFolder folder;
  const auto footprint = [](double lon_deg) {
    return fmt::format("POLYGON (({0} 42.5, {1} 42.5, {1} 42.5002, {0} 42.5002, {0} 42.5))",
                       lon_deg, lon_deg + 0.0003);
  };
  using Fields = std::vector<std::pair<std::string, std::string>>;
  const Fields house = {{"building", "house"}};
  Fields way = house;
  way.emplace_back("osm_way_id", "262902069");
  write_vectors(folder / "osm.gpkg", "GPKG", {{footprint(1.5), way}});
  // Of features without numbers these are hashes of 64 bits, of which half pass what a signed number holds.
  std::vector<VectorSpec> unnumbered;
  for (int i = 0; i < 6; ++i) unnumbered.push_back({footprint(1.501 + 0.0005 * i), house});
  write_vectors(folder / "town.geojson", "GeoJSON", unnumbered);

  tiler::WorldOptions options = world_of("plane", kSize_m);
  for (const char* file : {"osm.gpkg", "town.geojson"})
    options.layers.push_back(
        layer_of(fmt::format("kind = \"buildings\"\nname = \"{0}\"\nfiles = [\"{1}\"]\n", file,
                             (folder / file).string())));
  const world::TileStore store = tiled(options, folder / "world");

  const Json found = job::trace_place(store, 42.5001, 1.50015);
  ASSERT_EQ(found.at("surface").string(), "object") << found.text();
  EXPECT_EQ(found.at("feature").integer(), 2305843009476596021);
  EXPECT_EQ(found.at("element").string(), "way/262902069");
  EXPECT_THAT(job::trace_text(found),
              HasSubstr("feature     way/262902069 of OpenStreetMap (number 2305843009476596021)"));
  for (int i = 0; i < 6; ++i) {
    const Json other = job::trace_place(store, 42.5001, 1.50115 + 0.0005 * i);
    ASSERT_EQ(other.at("surface").string(), "object") << other.text();
    EXPECT_FALSE(other.has("element")) << other.text();
    EXPECT_THAT(job::trace_text(other), HasSubstr("feature     " + other.at("feature").text()));
  }
}

/// A house that a raster of heights shows: its first cell, from the north.
TEST(TraceOfOutlines, NamesTheFirstCellOfTheirRaster) {
  const ScratchFolder folder;
  RasterSpec spec = utm_spec(400.0, 2.0);
  const Eigen::Vector2d corner(spec.geotransform[0], spec.geotransform[3]);
  // Columns 120 to 139, rows 117 to 128.
  spec.value = [&](double u, double v) {
    const double column = (u - corner.x()) / 2.0;
    const double row = (corner.y() - v) / 2.0;
    return column > 120.0 && column < 140.0 && row > 117.0 && row < 129.0 ? 9.0 : 0.0;
  };
  write_raster(folder / "heights.tif", spec);
  tiler::WorldOptions options = world_of("plane", kSize_m);
  tiler::LayerOptions layer =
      layer_of(fmt::format("kind = \"buildings\"\nsource = \"raster\"\nheights = \"{}\"\n"
                           "licence = \"CC0\"\naccuracy = \"0.2 m\"\n",
                           (folder / "heights.tif").string()));
  options.layers.push_back(layer);
  const world::TileStore store = tiled(options, folder / "world");
  double lat_deg = 0.0;
  double lon_deg = 0.0;
  GeographicLib::UTMUPS::Reverse(31, true, corner.x() + 2.0 * 131.0, corner.y() - 2.0 * 121.0,
                                 lat_deg, lon_deg);
  const Json found = job::trace_place(store, lat_deg, lon_deg);
  ASSERT_EQ(found.at("surface").string(), "object") << found.text();
  EXPECT_EQ(found.at("layer").at("source").string(), "heights.tif");
  EXPECT_EQ(found.at("layer").at("licence").string(), "CC0");
  EXPECT_EQ(found.at("layer").at("accuracy").string(), "0.2 m");
  EXPECT_EQ(found.at("cell").at("column").integer(), 120);
  EXPECT_EQ(found.at("cell").at("row").integer(), 117);
  EXPECT_FALSE(found.has("element"));
  EXPECT_THAT(job::trace_text(found), HasSubstr("begins at column 120, row 117 of its raster"));
}

}  // namespace
}  // namespace terracast::test
