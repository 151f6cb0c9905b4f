// Land cover that is made from the land itself, alone and in the gaps of a map.

#include <cmath>
#include <map>
#include <set>
#include <string>

#include "tests/tiler/land_cover_worlds.h"
#include "tests/tiler/raster_files.h"

namespace terracast::test {
namespace {

using tiler::WorldSurface;
using world::Cover;

tiler::WorldOptions derived_world(const std::string& ground, double size_m,
                                  const std::string& toml = "") {
  tiler::WorldOptions options = world_of(ground, size_m);
  options.layers.push_back(land_cover_layer("source = \"derived\"\n" + toml));
  return options;
}

std::map<Cover, double> shares_of(const WorldSurface& surface, int count = 4000) {
  std::map<Cover, double> shares;
  for (const Eigen::Vector2d& place : scattered_places(surface.options().size_m, count))
    shares[cover_at(surface, place)] += 1.0 / count;
  return shares;
}

TEST(DerivedLandCover, ForestsEndAtTheTreeLineAndSnowLiesAboveItsOwn) {
  tiler::WorldOptions options = derived_world(
      "ramp", 40000.0, "tree_line_m = 2000.0\nsnow_line_m = 3200.0\nforest_share = 1.0");
  options.elevation[0].slope = 0.12;
  options.elevation[0].height_m = 2200.0;  // 0 to 4600 m
  const auto surface = prepare(options);
  std::set<Cover> low, high;
  int num_forest = 0;
  for (const Eigen::Vector2d& place : scattered_places(40000.0, 6000)) {
    const double height_m = 2200.0 + 0.12 * place.x();
    const Cover cover = cover_at(*surface, place);
    // Both lines wander by up to 300 m.
    if (height_m > 2350.0) {
      EXPECT_NE(cover, Cover::Forest) << height_m;
    }
    if (height_m < 2800.0) {
      EXPECT_NE(cover, Cover::Snow) << height_m;
    }
    if (height_m > 3550.0) {
      EXPECT_EQ(cover, Cover::Snow) << height_m;
    }
    // The season is too short for fields near the trees' end.
    if (height_m > 1600.0) {
      EXPECT_NE(cover, Cover::Crops) << height_m;
    }
    if (height_m < 1700.0 && cover == Cover::Forest) ++num_forest;
  }
  EXPECT_GT(num_forest, 600);
}

TEST(DerivedLandCover, OnTheSteepIsRock) {
  tiler::WorldOptions options = derived_world("ramp", 4096.0, "snow_line_m = 9000.0");
  options.elevation[0].slope = 1.3;
  EXPECT_NEAR(shares_of(*prepare(options))[Cover::Bare], 1.0, 1e-9);
}

// Seen in November 2026: a rib of 50 m between two walls, whose top is level, carried a row of trees that
// looked like a needle from its end.
TEST(DerivedLandCover, NarrowCrestsBetweenWallsCarryNoForest) {
  const ScratchFolder folder;
  // Ridges that run north, 640 m apart: to the west of the middle with a top of 40 m and walls of 48
  // degrees, to the east with a top of 320 m between slopes of 15 degrees.
  const double middle_m = utm31(kOriginLat_deg, kOriginLon_deg).x();
  const auto from_top_m = [](double x) {
    return std::abs(x - 640.0 * std::floor(x / 640.0) - 320.0);
  };
  RasterSpec spec = utm_spec(4600.0, 8.0);
  spec.value = [&](double u, double) {
    const double x = u - middle_m;
    const double away_m = from_top_m(x);
    return x < 0.0 ? 900.0 - 1.1 * std::max(away_m - 20.0, 0.0)
                   : 900.0 - 0.27 * std::max(away_m - 160.0, 0.0);
  };
  write_raster(folder / "ridges.tif", spec);
  tiler::WorldOptions options = world_of_rasters({folder / "ridges.tif"});
  options.detail_roughness = 0.0;
  options.layers.push_back(land_cover_layer(
      "source = \"derived\"\nforest_share = 1.0\nfield_share = 0.0\ntree_line_m = 2500.0"));
  const auto surface = prepare(options);
  int num_narrow = 0, num_wooded_narrow = 0, num_wide = 0, num_wooded_wide = 0;
  for (const Eigen::Vector2d& place : scattered_places(3900.0, 12000)) {
    const geo::Geodetic at = surface->frame().geodetic_from_world({place.x(), place.y(), 900.0});
    const double x = utm31(at.lat_deg, at.lon_deg).x() - middle_m;
    if (from_top_m(x) > 10.0) continue;
    const bool is_wooded = cover_at(*surface, place) == Cover::Forest;
    (x < 0.0 ? num_narrow : num_wide) += 1;
    (x < 0.0 ? num_wooded_narrow : num_wooded_wide) += is_wooded ? 1 : 0;
  }
  ASSERT_GT(num_narrow, 100);
  ASSERT_GT(num_wide, 100);
  EXPECT_EQ(num_wooded_narrow, 0);
  EXPECT_GT(num_wooded_wide, num_wide / 3);
}

TEST(DerivedLandCover, SharesFollowTheConfig) {
  const auto shares = [](const std::string& toml) {
    tiler::WorldOptions options = derived_world("ramp", 17000.0, toml);
    options.elevation[0].slope = 0.02;  // level enough for fields
    options.elevation[0].height_m = 500.0;
    return shares_of(*prepare(options));
  };
  EXPECT_EQ(shares("field_share = 0.0")[Cover::Crops], 0.0);
  auto many = shares("field_share = 0.9\nforest_share = 0.1");
  auto some = shares("field_share = 0.3\nforest_share = 0.1");
  EXPECT_GT(many[Cover::Crops], 0.6);
  EXPECT_GT(some[Cover::Crops], 0.15);
  EXPECT_LT(some[Cover::Crops], 0.45);
  EXPECT_GT(shares("field_share = 0.0\nforest_share = 0.8")[Cover::Forest], 0.3);
}

TEST(DerivedLandCover, LandOfItsOwnHasPatchesOfManyKinds) {
  const auto surface = prepare(derived_world("procedural", 8192.0));
  int num_same = 0, num_pairs = 0, num_unsaid = 0;
  std::map<Cover, int> counts;
  for (int j = -250; j < 250; j += 10)
    for (int i = -250; i < 250; ++i) {
      const Cover here = cover_at(*surface, {16.0 * i, 16.0 * j});
      const Cover beside = cover_at(*surface, {16.0 * i + 16.0, 16.0 * j});
      if (here == Cover::Sea || beside == Cover::Sea) continue;
      num_unsaid += here == Cover::Land ? 1 : 0;  // the sea's shore
      ++counts[here];
      ++num_pairs;
      num_same += here == beside ? 1 : 0;
    }
  // Patches are tens to hundreds of metres wide: a step of 16 m seldom leads out of one, but not never.
  EXPECT_GT(num_same, 0.85 * num_pairs);
  EXPECT_LT(num_same, 0.99 * num_pairs);
  EXPECT_LT(num_unsaid, 0.05 * num_pairs);
  for (const Cover cover : {Cover::Forest, Cover::Grass, Cover::Crops, Cover::Shrubs})
    EXPECT_GT(counts[cover], 0.02 * num_pairs) << static_cast<int>(cover);
}

TEST(DerivedLandCover, IsTheSameFromAnyNumberOfThreadsAndAnotherFromAnotherSeed) {
  const auto one = prepare(derived_world("fractal", 4096.0), 1);
  const auto two = prepare(derived_world("fractal", 4096.0), 2);
  const auto other = prepare(derived_world("fractal", 4096.0, "seed = 9"));
  int num_differ = 0;
  const auto places = scattered_places(4096.0, 500);
  for (const Eigen::Vector2d& place : places) {
    EXPECT_EQ(cover_at(*one, place), cover_at(*two, place));
    num_differ += cover_at(*one, place) != cover_at(*other, place) ? 1 : 0;
  }
  EXPECT_EQ(one->input_hash(), two->input_hash());
  EXPECT_NE(one->input_hash(), other->input_hash());
  EXPECT_GT(num_differ, 50);
}

TEST(LandCoverOfAndorra, GapsOfTheMapAreLeftToTheLandItself) {
  TERRACAST_NEEDS_SHARED_DATA("andorra/andorra_landcover_20m.tif");
  TERRACAST_NEEDS_SHARED_DATA("andorra/andorra_dem_3s.tif");
  tiler::WorldOptions options;
  options.origin_lat_deg = 42.55;
  options.origin_lon_deg = 1.55;
  options.size_m = 20480.0;
  tiler::ElevationOptions entry;
  entry.vertical_datum = "egm96";
  entry.files = {{.written = (shared_data() / "andorra/andorra_dem_3s.tif").string(),
                  .resolved = shared_data() / "andorra/andorra_dem_3s.tif"}};
  options.elevation = {entry};
  options.layers = {
      land_cover_layer("legend = \"worldcover\"\nfiles = [\"" +
                       (shared_data() / "andorra/andorra_landcover_20m.tif").string() + "\"]")};
  auto mapped = shares_of(*prepare(options));
  EXPECT_GT(mapped[Cover::Land], 0.2);  // unmapped
  EXPECT_GT(mapped[Cover::Forest], 0.2);
  options.layers.push_back(land_cover_layer("name = \"rest\"\nsource = \"derived\""));
  auto whole = shares_of(*prepare(options));
  EXPECT_EQ(whole[Cover::Land], 0.0);
  // What was mapped stays.
  for (const auto& [cover, share] : mapped)
    if (cover != Cover::Land) {
      EXPECT_GE(whole[cover], share - 1e-9);
    }
}

}  // namespace
}  // namespace terracast::test
