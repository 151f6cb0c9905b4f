#include <cmath>

#include "tests/tiler/raster_files.h"

// Ground that no raster measured: what is sea there, and what is said of it.
namespace terracast::test {
namespace {

using tiler::WorldSurface;
using world::Cover;

constexpr double kSpacing_m = 60.0;

/// Height of a place in zone 31, by metres east and north of the origin.
using Ground = std::function<double(double east_m, double north_m)>;

tiler::WorldOptions world_of_ground(const ScratchFolder& folder, const Ground& ground,
                                    double raster_ends_east_m = 1e9, double size_m = 8192.0) {
  RasterSpec spec = utm_spec(size_m, kSpacing_m);
  const Eigen::Vector2d middle = utm31(kOriginLat_deg, kOriginLon_deg);
  spec.nodata = -32768.0;
  const double most = (middle.x() + raster_ends_east_m - spec.geotransform[0]) / kSpacing_m;
  spec.width = std::min(spec.width, static_cast<int>(std::min(most, 1e6)));
  spec.value = [&](double u, double v) { return ground(u - middle.x(), v - middle.y()); };
  write_raster(folder / "ground.tif", spec);
  tiler::WorldOptions options = world_of_rasters({folder / "ground.tif"}, size_m);
  options.detail_roughness = 0.0;
  options.elevation[0].vertical_datum = "egm96";
  return options;
}

/// Metres east and north of the origin in zone 31.
Eigen::Vector2d grid_place(const WorldSurface& surface, double x, double y) {
  const auto place = surface.frame().geodetic_from_world({x, y, surface.sample(x, y).z_world});
  return utm31(place.lat_deg, place.lon_deg) - utm31(kOriginLat_deg, kOriginLon_deg);
}

std::string kind_at(const WorldSurface& surface, double x, double y) {
  return surface.sources()[surface.sample(x, y).source].kind;
}

/// Hills north of a coast that winds about the middle.
double winding_coast_m(double east_m, double north_m) {
  const double inland_m = north_m - 900.0 * std::sin(east_m / 1100.0);
  return inland_m < 0.0 ? 0.0 : 2.0 + 0.05 * inland_m;
}

/// The squared distances from a place to the nearest sample of the land and of the sea, by looking at all.
std::pair<double, double> nearest_by_search(const Eigen::Vector2d& place, double ends_east_m) {
  const RasterSpec spec = utm_spec(8192.0, kSpacing_m);
  const Eigen::Vector2d corner = Eigen::Vector2d(spec.geotransform[0], spec.geotransform[3]) -
                                 utm31(kOriginLat_deg, kOriginLon_deg);
  double land_m = 1e9, sea_m = 1e9;
  for (int j = 0; j < spec.height; ++j)
    for (int i = 0; i < spec.width; ++i) {
      const Eigen::Vector2d at = corner + kSpacing_m * Eigen::Vector2d(i + 0.5, -(j + 0.5));
      if (at.x() + 0.5 * kSpacing_m > ends_east_m) continue;
      double& nearest_m = winding_coast_m(at.x(), at.y()) > 0.0 ? land_m : sea_m;
      nearest_m = std::min(nearest_m, (at - place).norm());
    }
  return {land_m, sea_m};
}

TEST(FilledGround, KeepsCoastsAndTheSeaBeyondARastersEnd) {
  // A band of land as wide as the blend once crossed the sea where a raster ended.
  const ScratchFolder folder;
  tiler::WorldOptions options = world_of_ground(folder, winding_coast_m, 300.0);
  for (const std::string outside : {"extend", "sea"}) {
    options.outside = outside;
    const auto surface = prepare(options);
    int num_sea = 0, num_land = 0;
    for (double y = -3900.0; y < 4000.0; y += 260.0)
      for (double x = 380.0; x < 4000.0; x += 310.0) {
        const auto [land_m, sea_m] = nearest_by_search(grid_place(*surface, x, y), 300.0);
        // The coast passes between samples.
        if (std::abs(land_m - sea_m) < 1.5 * kSpacing_m) continue;
        const Cover cover = surface->sample(x, y).cover;
        EXPECT_EQ(kind_at(*surface, x, y), "extend") << x << " " << y;
        if (sea_m < land_m) {
          EXPECT_EQ(cover, Cover::Sea) << outside << " " << x << " " << y;
        } else if (outside == "extend") {
          EXPECT_EQ(cover, Cover::Land) << x << " " << y;
        }
        ++(cover == Cover::Sea ? num_sea : num_land);
      }
    EXPECT_GT(num_sea, 100) << outside;
    EXPECT_GT(num_land, 20) << outside;
  }
}

TEST(FilledGround, EndsInTheSeaTheFartherOutTheHigherItIs) {
  // 3 km for 500 m, as the root of the height; up to two samples of the raster.
  for (const double height_m : {20.0, 100.0, 500.0}) {
    const ScratchFolder folder;
    tiler::WorldOptions options = world_of_ground(
        folder, [&](double, double) { return height_m; }, 0.0);
    options.outside = "sea";
    const auto surface = prepare(options);
    double shore_m = 0.0;
    while (surface->sample(shore_m, 0.0).cover == Cover::Land) shore_m += 5.0;
    EXPECT_NEAR(shore_m, 3000.0 * std::sqrt(height_m / 500.0), 2.0 * kSpacing_m) << height_m;
    for (double x = shore_m + kSpacing_m; x < 4000.0; x += 50.0)
      EXPECT_EQ(surface->sample(x, 500.0).cover, Cover::Sea) << x;
  }
}

TEST(FilledGround, IsNoLandBetweenWaterAndWater) {
  // A void lies across a strait of 900 m and both of its shores.
  const ScratchFolder folder;
  const auto strait_m = [](double east_m, double north_m) {
    if (std::abs(east_m) < 1000.0 && std::abs(north_m) < 700.0) return -32768.0;
    return std::max(0.2 * (std::abs(north_m) - 450.0), 0.0);
  };
  const auto surface = prepare(world_of_ground(folder, strait_m));
  const auto covers = [&](double y) {
    std::map<Cover, int> count;
    for (double x = -1500.0; x <= 1500.0; x += 20.0) ++count[surface->sample(x, y).cover];
    return count;
  };
  EXPECT_EQ(covers(0.0), (std::map<Cover, int>{{Cover::Sea, 151}}));
  EXPECT_EQ(covers(900.0), (std::map<Cover, int>{{Cover::Land, 151}}));
  EXPECT_EQ(kind_at(*surface, 0.0, 0.0), "void");
  // The sea over the void is level, and deeper than nothing.
  EXPECT_GT(surface->sample(0.0, 0.0).water_depth_m, 1.0);
}

TEST(FilledGround, HasTheFloorThatWasMeasuredAround) {
  const ScratchFolder folder;
  const auto floor_m = [](double east_m, double north_m) {
    if (std::abs(east_m - 1500.0) < 500.0 && std::abs(north_m) < 500.0) return -32768.0;
    return -0.03 * east_m;
  };
  tiler::WorldOptions options = world_of_ground(folder, floor_m);
  options.elevation[0].sea = "below";
  const auto surface = prepare(options);
  EXPECT_EQ(kind_at(*surface, 1500.0, 0.0), "void");
  // Harmonic over a plane's rim: the plane. Corners and the lean of the grid leave decimetres.
  for (const double x : {1100.0, 1500.0, 1900.0})
    EXPECT_NEAR(surface->sample(x, 0.0).water_depth_m, 0.03 * grid_place(*surface, x, 0.0).x(),
                0.5);
}

TEST(FilledGround, PassesFromMeasuredFloorsIntoShelvesWithoutALedge) {
  // A floor 100 m deep in the west, a sea of zeros in the east, a void between them. Unmeasured sea once
  // counted as 0 m deep, beside a shelf of tens of metres.
  const ScratchFolder folder;
  const auto ground_m = [](double east_m, double north_m) {
    if (north_m > 3500.0) return 50.0;
    if (std::abs(east_m) < 500.0 && std::abs(north_m) < 1500.0) return -32768.0;
    return east_m < 0.0 ? -100.0 : 0.0;
  };
  tiler::WorldOptions options = world_of_ground(folder, ground_m);
  options.elevation[0].sea = "below";
  options.elevation[0].nodata = "-32768";  // zeros and hills round the data are no collar
  const auto surface = prepare(options);
  const auto depth_m = [&](double x) { return surface->sample(x, 0.0).water_depth_m; };
  EXPECT_EQ(kind_at(*surface, 0.0, 0.0), "void");
  EXPECT_GT(depth_m(1000.0), 40.0);  // the shelf: 1 in 50 from a coast 3.5 km away
  // At the void's eastern rim, over three samples.
  EXPECT_NEAR(depth_m(400.0), depth_m(580.0), 12.0);
  for (double x = -300.0; x < 300.0; x += 60.0) {
    EXPECT_LT(depth_m(x), 101.0) << x;
    EXPECT_GT(depth_m(x), depth_m(1000.0) - 1.0) << x;
  }
}

TEST(FilledGround, SaysHowMuchOfTheSquareItIs) {
  const ScratchFolder folder;
  tiler::WorldOptions options = world_of_ground(folder, winding_coast_m, 1000.0);
  options.outside = "extend";
  const auto surface = prepare(options);
  for (const world::SourceInfo& source : surface->sources()) {
    if (source.kind != "extend") continue;
    double area_km2 = 0.0;
    ASSERT_EQ(
        std::sscanf(source.accuracy.c_str(), "not measured: %lf km2 of the square", &area_km2), 1)
        << source.accuracy;
    // East of 1000 m, to a sample of 60 m; the grid is turned by 1 degree against the world.
    EXPECT_NEAR(area_km2, 8.192 * (4.096 - 1.0), 8.192 * 0.1);
    return;
  }
  ADD_FAILURE() << "no such source";
}

TEST(FilledGround, IsSeaBeyondABorderThatLiesInTheSea) {
  // An island 1 km inside the border was once mirrored out of it.
  const ScratchFolder folder;
  const auto island_m = [](double east_m, double north_m) {
    return std::max(200.0 - 0.2 * std::hypot(east_m - 2300.0, north_m), 0.0);
  };
  const auto surface = prepare(world_of_ground(folder, island_m));
  EXPECT_EQ(surface->sample(2300.0, 0.0).cover, Cover::Land);
  for (double y = -12000.0; y <= 12000.0; y += 217.0)
    for (double x = 4097.0; x < 20000.0; x += 310.0)
      ASSERT_EQ(surface->sample(x, y).cover, Cover::Sea) << x << " " << y;
}

TEST(FilledGround, GoesOnBeyondTheBorderAsLandAndAsSea) {
  // Land in the north; beyond the eastern border both go on, and the sea has none of it.
  const ScratchFolder folder;
  tiler::WorldOptions options = world_of_ground(folder, [](double east_m, double north_m) {
    // The coast runs to the north-west: mirrored, it would run to the north-east.
    const double inland_m = north_m + 0.6 * (east_m - 4096.0);
    return inland_m < 0.0 ? 0.0 : 5.0 + 0.1 * inland_m;
  });
  options.elevation[0].nodata = "none";  // the zeros round the land are no collar
  const auto surface = prepare(options);
  for (const double out_m : {50.0, 500.0, 1500.0, 4000.0}) {
    for (double y = -3900.0; y < -200.0; y += 100.0)
      EXPECT_EQ(surface->sample(4096.0 + out_m, y).cover, Cover::Sea) << out_m << " " << y;
    EXPECT_EQ(surface->sample(4096.0 + out_m, 3500.0).cover, Cover::Outside) << out_m;
  }
}

}  // namespace
}  // namespace terracast::test
