#include "tiler/dryness.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <fstream>
#include <map>

#include "tests/tiler/land_cover_worlds.h"

// How dry land is, and what grows there.
namespace terracast::test {
namespace {

using core::ErrorKind;
using tiler::Dryness;
using world::Cover;

std::map<Cover, double> shares_at(double aridity_index) {
  tiler::WorldOptions options = world_of("plane", 32768.0);
  options.aridity_index = aridity_index;
  const geo::WorldFrame frame({.lat_deg = kOriginLat_deg, .lon_deg = kOriginLon_deg});
  const auto dryness = Dryness::of(options, frame);
  constexpr int kNumPlaces = 8000;
  std::map<Cover, double> shares;
  for (const Eigen::Vector2d& place : scattered_places(32768.0, kNumPlaces))
    // In ground of mean moisture; Land stands for what no dryness tells.
    shares[dryness->cover(place, 0.5).value_or(Cover::Land)] += 1.0 / kNumPlaces;
  return shares;
}

TEST(Dryness, MakesDesertsBareAndSteppesShrubs) {
  EXPECT_NEAR(shares_at(0.01)[Cover::Bare], 1.0, 1e-9);  // hyper-arid
  EXPECT_NEAR(shares_at(0.14)[Cover::Bare], 0.5, 0.04);  // arid, halfway from 0.03 to 0.25
  EXPECT_NEAR(shares_at(0.14)[Cover::Shrubs], 0.5, 0.04);
  EXPECT_NEAR(shares_at(0.28)[Cover::Shrubs], 1.0, 1e-9);   // semi-arid
  EXPECT_NEAR(shares_at(0.475)[Cover::Shrubs], 0.5, 0.04);  // halfway from 0.3 to 0.65
  EXPECT_NEAR(shares_at(0.475)[Cover::Land], 0.5, 0.04);
  EXPECT_NEAR(shares_at(0.7)[Cover::Land], 1.0, 1e-9);  // humid
}

TEST(Dryness, IsOfTheWorldThatStatesItAndTheLogSaysWhatIsAssumed) {
  tiler::WorldOptions options = world_of("plane");
  const auto num_told = [&](const std::string& words) {
    const std::string log = log_of(options);
    int count = 0;
    for (std::size_t at = log.find(words); at != std::string::npos; at = log.find(words, at + 1))
      ++count;
    return count;
  };
  EXPECT_EQ(num_told("the land is taken as humid"), 1);
  EXPECT_EQ(prepare(options)->sample(10.0, 20.0).cover, Cover::Land);
  const std::string humid_hash = prepare(options)->input_hash();
  options.layers.push_back(land_cover_layer("source = \"derived\""));
  EXPECT_EQ(num_told("the land is taken as humid"), 1);
  options.layers.clear();

  options.aridity_index = 0.01;
  EXPECT_EQ(num_told("the land is taken as humid"), 0);
  EXPECT_EQ(num_told("follows aridity_index = 0.01"), 1);
  const auto desert = prepare(options);
  for (const Eigen::Vector2d& place : scattered_places(4000.0))
    EXPECT_EQ(cover_at(*desert, place), Cover::Bare);
  EXPECT_NE(desert->input_hash(), humid_hash);
}

TEST(Dryness, LeavesDerivedCoverNoWoodsNoFieldsNoMeadows) {
  tiler::WorldOptions options = world_of("ramp", 8192.0);
  options.elevation[0].slope = 0.02;
  options.elevation[0].height_m = 400.0;
  options.layers.push_back(land_cover_layer("source = \"derived\""));
  const auto covers = [&](double aridity_index) {
    options.aridity_index = aridity_index;
    const auto surface = prepare(options);
    std::map<Cover, int> count;
    for (const Eigen::Vector2d& place : scattered_places(8000.0, 2000))
      ++count[cover_at(*surface, place)];
    return count;
  };
  EXPECT_EQ(covers(0.01), (std::map<Cover, int>{{Cover::Bare, 2000}}));
  // As humid as not stated.
  const auto humid = covers(2.0);
  EXPECT_EQ(humid, covers(-1.0));
  EXPECT_GT(humid.at(Cover::Forest) + humid.at(Cover::Crops) + humid.at(Cover::Grass), 1800);
}

TEST(Dryness, FollowsARasterWhereItLies) {
  // Dry in the west, humid in the east, as integers of 10000 times the index; nothing in the north.
  const ScratchFolder folder;
  const Eigen::Vector2d middle = utm31(kOriginLat_deg, kOriginLon_deg);
  RasterSpec spec = utm_spec(8192.0, 500.0);
  spec.type = GDT_Int32;
  spec.nodata = -1.0;
  spec.value = [&](double u, double v) {
    return v - middle.y() > 3000.0 ? -1.0 : u < middle.x() ? 100.0 : 9000.0;
  };
  write_raster(folder / "aridity.tif", spec);
  tiler::WorldOptions options = world_of("plane", 8192.0);
  options.aridity_raster = {.written = "aridity.tif", .resolved = folder / "aridity.tif"};
  expect_error(ErrorKind::Input, {"aridity.tif", "outside 0 to 20", "-scale 0.0001"},
               [&] { prepare(options); });
  spec.scale = 1e-4;
  write_raster(folder / "aridity.tif", spec);
  const auto surface = prepare(options);
  // Also in the north, whose values come from the south's.
  for (const double y : {-3500.0, 0.0, 3500.0}) {
    EXPECT_EQ(cover_at(*surface, {-3000.0, y}), Cover::Bare) << y;
    EXPECT_EQ(cover_at(*surface, {3000.0, y}), Cover::Land) << y;
  }
  const geo::WorldFrame frame({.lat_deg = kOriginLat_deg, .lon_deg = kOriginLon_deg});
  const auto dryness = Dryness::of(options, frame);
  EXPECT_NEAR(dryness->aridity_index({-3000.0, -3000.0}), 0.01, 1e-6);
  EXPECT_NEAR(dryness->aridity_index({3000.0, -3000.0}), 0.9, 1e-6);
  ASSERT_EQ(dryness->ledger().entries().count("band scale"), 1U) << dryness->ledger().table();
  EXPECT_EQ(dryness->ledger().entries().at("band scale").num_used, 1);

  options.aridity_index = 0.5;
  expect_error(ErrorKind::Config, {"aridity_index", "aridity_raster", "leave one out"},
               [&] { options.validate(); });
  options.aridity_index = -1.0;
  options.origin_lon_deg += 1.0;
  expect_error(ErrorKind::Input, {"aridity.tif", "says nothing of the world's square"},
               [&] { prepare(options); });
}

tiler::WorldOptions world_of_aridity(const std::filesystem::path& file) {
  tiler::WorldOptions options = world_of("plane", 8192.0);
  options.aridity_raster = {.written = file.filename(), .resolved = file};
  return options;
}

std::shared_ptr<const Dryness> dryness_of(const tiler::WorldOptions& options,
                                          const core::Log* log = nullptr) {
  return Dryness::of(
      options,
      geo::WorldFrame({.lat_deg = options.origin_lat_deg, .lon_deg = options.origin_lon_deg}), log);
}

TEST(Dryness, SaysOfWrongIndicesWhatIsRightForThem) {
  // Indices above 0.9 and marks of missing ones were once heights above 9000 m, to be stated in feet.
  const ScratchFolder folder;
  const tiler::WorldOptions options = world_of_aridity(folder / "aridity.tif");
  RasterSpec spec = utm_spec(8192.0, 500.0);
  const auto message = [&](double raw) {
    spec.value = [raw](double, double) { return raw; };
    write_raster(folder / "aridity.tif", spec);
    try {
      dryness_of(options);
    } catch (const core::Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  for (const double raw : {12000.0, 65535.0}) {
    const std::string text = message(raw);
    EXPECT_NE(text.find("-scale 0.0001 aridity.tif"), std::string::npos) << text;
    EXPECT_NE(text.find(fmt::format("-a_nodata {:g} aridity.tif", raw)), std::string::npos) << text;
    EXPECT_EQ(text.find("height"), std::string::npos) << text;
    EXPECT_EQ(text.find("unit"), std::string::npos) << text;
  }
  const std::string text = message(std::nan(""));
  EXPECT_NE(text.find("says nothing of the world's square"), std::string::npos) << text;
  EXPECT_EQ(text.find("state nodata"), std::string::npos) << text;
  spec.unit = "1";
  EXPECT_EQ(message(0.5), "");
  EXPECT_NEAR(dryness_of(options)->aridity_index({0.0, 0.0}), 0.5, 1e-9);
}

TEST(Dryness, WarnsOfTheSquaresPartThatARasterSaysNothingOf) {
  const ScratchFolder folder;
  const Eigen::Vector2d middle = utm31(kOriginLat_deg, kOriginLon_deg);
  RasterSpec spec = utm_spec(8192.0, 500.0);
  spec.nodata = -1.0;
  spec.value = [&](double u, double) { return u < middle.x() ? -1.0 : 0.4; };
  write_raster(folder / "aridity.tif", spec);
  const core::Log log("tile", core::LogLevel::Info);
  testing::internal::CaptureStderr();
  dryness_of(world_of_aridity(folder / "aridity.tif"), &log);
  const std::string text = testing::internal::GetCapturedStderr();
  const std::size_t at = text.find("no aridity index in ");
  ASSERT_NE(at, std::string::npos) << text;
  // The nearest sample may be half of 500 m off.
  EXPECT_NEAR(std::stod(text.substr(at + 20)), 50.0, 5.0) << text;
}

TEST(Dryness, GoesOnBeyondTheAntimeridianWhereARasterGoesRoundTheEarth) {
  // Dry on both sides of the antimeridian; columns of 0.25 degrees from -180 to 180.
  const ScratchFolder folder;
  RasterSpec spec;
  spec.crs = "EPSG:4326";
  spec.width = 1440;
  spec.height = 40;
  spec.geotransform = {-180.0, 0.25, 0.0, 5.0, 0.0, -0.25};
  spec.value = [](double u, double) { return u < -179.0 ? 0.2 : u > 179.0 ? 0.1 : 0.9; };
  write_raster(folder / "aridity.tif", spec);
  tiler::WorldOptions options = world_of_aridity(folder / "aridity.tif");
  options.size_m = 131072.0;
  options.origin_lat_deg = 0.0;
  for (const double lon_deg : {179.999, -179.999, 180.001}) {
    options.origin_lon_deg = lon_deg;
    const auto dryness = dryness_of(options);
    EXPECT_NEAR(dryness->aridity_index({-50000.0, 0.0}), 0.1, 1e-6) << lon_deg;
    EXPECT_NEAR(dryness->aridity_index({50000.0, 0.0}), 0.2, 1e-6) << lon_deg;
  }
}

TEST(Dryness, RefusesMoreSamplesThanFitIntoMemory) {
  const ScratchFolder folder;
  const RasterSpec spec = utm_spec(8192.0, 0.5);
  std::ofstream(folder / "aridity.vrt")
      << fmt::format("<VRTDataset rasterXSize=\"{}\" rasterYSize=\"{}\"><SRS>{}</SRS>", spec.width,
                     spec.height, spec.crs)
      << fmt::format("<GeoTransform>{}</GeoTransform>", fmt::join(spec.geotransform, ", "))
      << "<VRTRasterBand dataType=\"Byte\" band=\"1\"/></VRTDataset>";
  expect_error(ErrorKind::Input, {"aridity.vrt", "of its samples", "fit into memory"},
               [&] { dryness_of(world_of_aridity(folder / "aridity.vrt")); });
}

}  // namespace
}  // namespace terracast::test
