#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/tiler/planted_layer.h"

namespace terracast::test {
namespace {

using core::ErrorKind;
using Eigen::Vector2d;
using world::Cover;
using world::Instance;
using world::TileId;

/// A canopy of a block 400 m x 300 m whose trees are 8 m in the west and 24 m in the east.
std::filesystem::path write_canopy(const std::filesystem::path& file, double tall_m = 24.0,
                                   double easting_shift_m = 0.0) {
  const Vector2d origin = utm31(world_of("plane").origin_lat_deg, world_of("plane").origin_lon_deg);
  RasterSpec spec;
  spec.width = 400;
  spec.height = 400;
  spec.type = GDT_Float32;
  spec.nodata = -9999.0;
  spec.geotransform = {
      origin.x() - 500.0 + easting_shift_m, 2.5, 0.0, origin.y() + 500.0, 0.0, -2.5};
  spec.value = [=](double u, double v) {
    const double x = u - origin.x() - easting_shift_m;
    const double y = v - origin.y();
    if (x > 300.0) return -9999.0;
    if (std::abs(x) > 200.0 || std::abs(y) > 150.0) return 0.0;
    return x < 0.0 ? 8.0 : tall_m;
  };
  write_raster(file, spec);
  return file;
}

TEST(Vegetation, ACanopyRasterSaysWhereTreesStandAndHowTallTheyAre) {
  const ScratchFolder folder;
  const std::filesystem::path file = write_canopy(folder / "canopy.tif");
  const Planted layer(fmt::format("canopy = \"{}\"", file.string()), 2048.0);
  const world::LayerInfo info = layer.layer->info();
  EXPECT_EQ(info.source, "canopy.tif");
  ASSERT_EQ(info.counts.size(), 3U);
  EXPECT_EQ(info.counts[0].second, 400 * 400);
  EXPECT_EQ(info.counts[1].second, 80 * 400);   // 200 m of 2.5 m in the east
  EXPECT_EQ(info.counts[2].second, 160 * 120);  // 400 m x 300 m
  ASSERT_EQ(info.ledger.entries().count("band no-data value"), 1U) << info.ledger.table();
  EXPECT_EQ(info.ledger.entries().at("band no-data value").num_used, 1);
  PlantedLand land;
  land.cover_at = [](const Vector2d&) { return Cover::Grass; };
  std::size_t num_low = 0;
  std::size_t num_tall = 0;
  for (const TileId id : {TileId{1, -1, -1}, TileId{1, 0, -1}, TileId{1, -1, 0}, TileId{1, 0, 0}})
    for (const auto& [number, instance] : layer.shown_on(id, land)) {
      if (!layer.is_tree(instance)) continue;
      const Vector2d at = Planted::place_of(instance);
      // Beyond the raster land cover decides again.
      if (at.x() > 270.0 || at.x() < -470.0 || std::abs(at.y()) > 470.0) continue;
      // The grid north of the zone is turned by up to 2 degrees here, and pixels are 2.5 m wide.
      EXPECT_LT(std::abs(at.x()), 212.0);
      EXPECT_LT(std::abs(at.y()), 162.0);
      if (std::abs(at.x()) > 185.0 || std::abs(at.y()) > 135.0 || std::abs(at.x()) < 15.0) continue;
      // Scales are rounded to 1/4096.
      EXPECT_NEAR(layer.height_m(instance), at.x() < 0.0 ? 8.0 : 24.0, 0.05);
      ++(at.x() < 0.0 ? num_low : num_tall);
    }
  // 170 m x 270 m each.
  EXPECT_GT(num_low, 900U);
  EXPECT_GT(num_tall, 900U);
}

TEST(Vegetation, CanopiesThatAreNoneAreRefused) {
  const ScratchFolder folder;
  const auto plant = [&](const std::filesystem::path& file) {
    const Planted layer(fmt::format("canopy = \"{}\"", file.string()), 2048.0);
  };
  expect_error(ErrorKind::Input, {"ground.tif", "pixel (", "1250", "trees"},
               [&] { plant(write_canopy(folder / "ground.tif", 1250.0)); });
  expect_error(ErrorKind::Input, {"away.tif", "beside the world's square"},
               [&] { plant(write_canopy(folder / "away.tif", 24.0, 90000.0)); });
  expect_error(ErrorKind::Io, {"missing.tif"}, [&] { plant(folder / "missing.tif"); });
  expect_error(ErrorKind::Config, {"canopy_nodata", "some"},
               [] { vegetation_of("canopy_nodata = \"some\"").validate(); });
}

TEST(Vegetation, RealCanopiesAreKept) {
  TERRACAST_NEEDS_SHARED_DATA("bilbao/bilbao_CDSM.tif");
  tiler::WorldOptions options = world_of_rasters({shared_data() / "bilbao/bilbao_DEM.tif"}, 2048.0);
  options.origin_lat_deg = 43.3123;
  options.origin_lon_deg = -2.9864;
  options.elevation[0].sea = "none";
  const auto surface = prepare(options);
  const auto file = shared_data() / "bilbao/bilbao_CDSM.tif";
  const auto layer =
      made_layer(vegetation_of(fmt::format("canopy = \"{}\"", file.string())), *surface, 1);
  // The raster by GDAL alone, places in its zone by GeographicLib.
  GDALAllRegister();
  auto* dataset = static_cast<GDALDataset*>(GDALOpen(file.c_str(), GA_ReadOnly));
  ASSERT_NE(dataset, nullptr);
  double corner[6];
  ASSERT_EQ(dataset->GetGeoTransform(corner), CE_None);
  const int width = dataset->GetRasterXSize();
  const int height = dataset->GetRasterYSize();
  std::vector<float> heights_m(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  ASSERT_EQ(dataset->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, width, height, heights_m.data(),
                                                width, height, GDT_Float32, 0, 0, nullptr),
            CE_None);
  GDALClose(dataset);
  PlantedLand land;
  land.cover_at = [](const Vector2d&) { return Cover::Land; };
  std::size_t num_trees = 0;
  for (const TileId id : {TileId{0, 0, 0}, TileId{0, -2, 1}, TileId{0, 1, -3}}) {
    world::TileObjects objects;
    layer->add_objects(id, land, objects);
    for (const Instance& instance : objects.instances) {
      const std::string& name = layer->prototypes()[instance.prototype].name;
      const bool is_tree = name.starts_with("oak") || name.starts_with("birch") ||
                           name.starts_with("spruce") || name.starts_with("pine") ||
                           name.starts_with("poplar") || name.starts_with("palm");
      if (!is_tree) continue;
      ++num_trees;
      const geo::Geodetic place = surface->frame().geodetic_from_world(
          instance.place_steps.cast<double>() * world::kHeightStep_m);
      int zone = 0;
      bool is_north = false;
      double easting_m = 0.0;
      double northing_m = 0.0;
      GeographicLib::UTMUPS::Forward(place.lat_deg, place.lon_deg, zone, is_north, easting_m,
                                     northing_m, 30);
      // The tree is as tall as samples round it, which it lies between.
      const double column = (easting_m - corner[0]) / corner[1] - 0.5;
      const double row = (northing_m - corner[3]) / corner[5] - 0.5;
      double lowest_m = 1e9;
      double highest_m = -1e9;
      for (int j = static_cast<int>(row - 0.01); j <= static_cast<int>(row + 0.01) + 1; ++j)
        for (int i = static_cast<int>(column - 0.01); i <= static_cast<int>(column + 0.01) + 1;
             ++i) {
          const auto value = static_cast<double>(
              heights_m.at(static_cast<std::size_t>(j) * static_cast<std::size_t>(width) +
                           static_cast<std::size_t>(i)));
          lowest_m = std::min(lowest_m, value);
          highest_m = std::max(highest_m, value);
        }
      int top_steps = 0;
      for (const world::ShapeLevel& level : layer->prototypes()[instance.prototype].levels)
        for (const Eigen::Vector3i& vertex : level.shape.vertices_steps)
          top_steps = std::max(top_steps, vertex.z());
      const double height_of_tree_m = top_steps * world::kHeightStep_m * instance.scale / 4096.0;
      // Scales are rounded to 1/4096 of a tree of some 20 m.
      EXPECT_GE(height_of_tree_m, std::max(lowest_m, 2.5) - 0.05);
      EXPECT_LE(height_of_tree_m, highest_m + 0.05);
    }
  }
  EXPECT_GT(num_trees, 200U);
}

}  // namespace
}  // namespace terracast::test
