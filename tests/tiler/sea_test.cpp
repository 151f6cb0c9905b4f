#include <cmath>

#include "tests/tiler/raster_files.h"
#include "tiler/tile_builder.h"
#include "world/tile_file.h"
#include "world/tile_store.h"

// What is sea, and the floor below it.
namespace terracast::test {
namespace {

using core::ErrorKind;
using tiler::WorldSurface;
using world::Cover;

/// Land in the west of the line east = 0, 0.1 m higher for each metre inland; `sea_m` in the east,
/// by the distance from the shore.
tiler::WorldOptions coast(const ScratchFolder& folder, const std::string& sea,
                          const std::function<double(double from_shore_m)>& sea_m) {
  RasterSpec spec = utm_spec(8192.0, 30.0);
  const Eigen::Vector2d middle = utm31(kOriginLat_deg, kOriginLon_deg);
  spec.nodata = -32768.0;
  spec.value = [&](double u, double) {
    const double east = u - middle.x();
    return east < 0.0 ? -0.1 * east : sea_m(east);
  };
  write_raster(folder / "coast.tif", spec);
  tiler::WorldOptions options = world_of_rasters({folder / "coast.tif"}, 8192.0);
  options.detail_roughness = 0.0;
  options.elevation[0].vertical_datum = "egm96";
  options.elevation[0].sea = sea;
  return options;
}

/// Above the geoid; the geoid's cubic jumps by up to 2 cm between cells of its grid.
double above_geoid_m(const WorldSurface& surface, double x, double y) {
  const auto place = surface.frame().geodetic_from_world({x, y, surface.sample(x, y).z_world});
  return place.height_m - geo::Geoid::egm96()->undulation_m(place.lat_deg, place.lon_deg);
}

TEST(Sea, OfZerosLiesOnTheGeoidOverAShelf) {
  const ScratchFolder folder;
  const auto surface = prepare(coast(folder, "auto", [](double) { return 0.0; }));
  EXPECT_EQ(surface->sample(-1000.0, 0.0).cover, Cover::Land);
  EXPECT_EQ(surface->sample(-1000.0, 0.0).water_depth_m, 0.0);
  double previous_m = 0.0;
  for (const double x : {100.0, 1000.0, 2500.0, 4000.0}) {
    const auto sample = surface->sample(x, 0.0);
    EXPECT_EQ(sample.cover, Cover::Sea);
    EXPECT_NEAR(above_geoid_m(*surface, x, 0.0), 0.0, 0.02);
    // A shelf of 1 in 50 from the first sample of the sea: to a sample of 30 m.
    EXPECT_NEAR(sample.water_depth_m, 0.02 * x, 0.02 * 35.0);
    EXPECT_GT(sample.water_depth_m, previous_m);
    previous_m = sample.water_depth_m;
  }
  // The same land says that its zeros are none.
  EXPECT_EQ(prepare(coast(folder, "none", [](double) { return 0.0; }))->sample(1000.0, 0.0).cover,
            Cover::Land);
}

TEST(Sea, IsAsLargeAsItsSourceSays) {
  const ScratchFolder folder;
  RasterSpec spec = utm_spec(8192.0, 30.0);
  const Eigen::Vector2d middle = utm31(kOriginLat_deg, kOriginLon_deg);
  // A harbour of 600 m x 600 m.
  spec.value = [&](double u, double v) {
    return std::max(std::abs(u - middle.x()), std::abs(v - middle.y())) < 300.0
               ? 0.0
               : 12.0 + 1e-3 * (u - middle.x());
  };
  write_raster(folder / "harbour.tif", spec);
  tiler::WorldOptions options = world_of_rasters({folder / "harbour.tif"}, 8192.0);
  options.detail_roughness = 0.0;
  options.elevation[0].vertical_datum = "egm96";
  for (const auto& [least_km2, cover] :
       {std::pair{1.0, Cover::Land}, std::pair{0.4, Cover::Land}, std::pair{0.3, Cover::Sea}}) {
    options.elevation[0].sea_min_km2 = least_km2;
    EXPECT_EQ(prepare(options)->sample(0.0, 0.0).cover, cover) << least_km2;
    EXPECT_EQ(prepare(options)->sample(1000.0, 0.0).cover, Cover::Land) << least_km2;
  }
}

/// Half of a coast's rows, north or south of the origin.
std::filesystem::path write_half(const ScratchFolder& folder, bool is_north,
                                 const std::function<double(double from_shore_m)>& sea_m) {
  RasterSpec half = utm_spec(8192.0, 30.0);
  const double west_m = utm31(kOriginLat_deg, kOriginLon_deg).x();
  half.height /= 2;
  if (!is_north) half.geotransform[3] -= 30.0 * half.height;
  half.value = [&, west_m](double u, double) {
    return u < west_m ? 0.1 * (west_m - u) : sea_m(u - west_m);
  };
  const auto file = folder / (is_north ? "north.tif" : "south.tif");
  write_raster(file, half);
  return file;
}

TEST(Sea, IsOneAndLevelWhateverDatumsItsRastersHave) {
  // In the north above EGM96, in the south above a grid that lies 0.7 m below it, and the first
  // raster, a hill inland, above the ellipsoid.
  const ScratchFolder folder;
  const double egm96_m = geo::Geoid::egm96()->undulation_m(kOriginLat_deg, kOriginLon_deg);
  RasterSpec offsets = utm_spec(8192.0, 30.0);
  offsets.crs = "EPSG:4326";
  offsets.width = offsets.height = 20;
  offsets.geotransform = {kOriginLon_deg - 1.0, 0.1, 0.0, kOriginLat_deg + 1.0, 0.0, -0.1};
  offsets.value = [&](double, double) { return egm96_m - 0.7; };
  write_raster(folder / "offsets.tif", offsets);
  RasterSpec hill = utm_spec(8192.0, 30.0);
  hill.width = 30;
  hill.value = [](double, double) { return 500.0; };
  write_raster(folder / "hill.tif", hill);

  for (const std::string sea : {"auto", "below"}) {
    const auto sea_m = [&](double from_shore_m) {
      return sea == "below" ? -0.03 * from_shore_m : 0.0;
    };
    tiler::WorldOptions options = world_of_rasters({folder / "hill.tif"}, 8192.0);
    options.detail_roughness = 0.0;
    for (const bool is_north : {true, false}) {
      tiler::ElevationOptions half = options.elevation[0];
      const auto file = write_half(folder, is_north, sea_m);
      half.files = {{.written = file.string(), .resolved = file}};
      half.vertical_datum = is_north ? "egm96" : "grid";
      if (!is_north)
        half.datum_grid = {.written = "offsets.tif", .resolved = folder / "offsets.tif"};
      half.sea = sea;
      options.elevation.push_back(half);
    }
    const auto surface = prepare(options);
    for (const double y : {-2000.0, 2000.0}) {
      const auto sample = surface->sample(1500.0, y);
      EXPECT_EQ(sample.cover, Cover::Sea) << sea << y;
      EXPECT_NEAR(above_geoid_m(*surface, 1500.0, y), 0.0, 0.02) << sea << y;
      const auto place = surface->frame().geodetic_from_world({1500.0, y, sample.z_world});
      const double from_shore_m =
          utm31(place.lat_deg, place.lon_deg).x() - utm31(kOriginLat_deg, kOriginLon_deg).x();
      // Shelves are measured in samples; floors to the grid's distance from EGM96 over 2 km.
      EXPECT_NEAR(sample.water_depth_m, (sea == "below" ? 0.03 : 0.02) * from_shore_m,
                  sea == "below" ? 1e-3 : 0.02 * 35.0)
          << sea << y;
      // Land keeps its own datum.
      const auto inland = surface->sample(-1500.0, y);
      EXPECT_EQ(inland.cover, Cover::Land);
      const auto on_land = surface->frame().geodetic_from_world({-1500.0, y, inland.z_world});
      const double measured_m = 0.1 * (utm31(kOriginLat_deg, kOriginLon_deg).x() -
                                       utm31(on_land.lat_deg, on_land.lon_deg).x());
      const double undulation_m =
          y > 0.0 ? geo::Geoid::egm96()->undulation_m(on_land.lat_deg, on_land.lon_deg)
                  : egm96_m - 0.7;
      EXPECT_NEAR(on_land.height_m, measured_m + undulation_m, 0.02) << sea << y;
    }
    const auto hill_place =
        surface->frame().geodetic_from_world({-4000.0, 0.0, surface->sample(-4000.0, 0.0).z_world});
    EXPECT_NEAR(hill_place.height_m, 500.0, 1e-6);
  }
}

TEST(Sea, WhoseFloorIsMeasuredKeepsIt) {
  const ScratchFolder folder;
  const auto floor_m = [](double from_shore_m) { return -0.03 * from_shore_m; };
  const auto surface = prepare(coast(folder, "below", floor_m));
  for (const double x : {200.0, 1500.0, 3900.0}) {
    const auto sample = surface->sample(x, -700.0);
    EXPECT_EQ(sample.cover, Cover::Sea);
    EXPECT_NEAR(above_geoid_m(*surface, x, -700.0), 0.0, 0.02);
    const auto place = surface->frame().geodetic_from_world({x, -700.0, sample.z_world});
    const double east =
        utm31(place.lat_deg, place.lon_deg).x() - utm31(kOriginLat_deg, kOriginLon_deg).x();
    EXPECT_NEAR(sample.water_depth_m, 0.03 * east, 1e-4);
  }
  // Taken for land it is a slope below zero.
  const auto dry = prepare(coast(folder, "auto", floor_m));
  EXPECT_EQ(dry->sample(1500.0, 0.0).cover, Cover::Land);
  EXPECT_NEAR(above_geoid_m(*dry, 1500.0, 0.0), -45.0, 0.1);
}

TEST(Sea, IsOfTheSourceThatKnowsItsFloor) {
  // Seen off Bilbao: a bed that a raster had measured was said to be the sea's own.
  const ScratchFolder folder;
  const auto deep_m = [](double from_shore_m) { return -0.03 * from_shore_m; };
  const auto zero_m = [](double) { return 0.0; };
  RasterSpec hill = utm_spec(8192.0, 30.0);
  hill.width = 30;
  hill.value = [](double, double) { return 500.0; };
  write_raster(folder / "hill.tif", hill);
  const auto entry_of = [&](const std::filesystem::path& file, const std::string& sea) {
    tiler::ElevationOptions entry = world_of_rasters({file}).elevation[0];
    entry.vertical_datum = "egm96";
    entry.sea = sea;
    return entry;
  };
  const tiler::ElevationOptions north = entry_of(write_half(folder, true, deep_m), "below");
  const tiler::ElevationOptions south = entry_of(write_half(folder, false, zero_m), "auto");
  const auto source_at = [](const WorldSurface& surface, double x, double y) {
    return surface.sources()[surface.sample(x, y).source].name;
  };
  const auto check = [&](const std::vector<tiler::ElevationOptions>& entries) {
    tiler::WorldOptions options = world_of_rasters({folder / "hill.tif"}, 8192.0);
    options.detail_roughness = 0.0;
    options.elevation = entries;
    const auto surface = prepare(options);
    ASSERT_EQ(surface->sample(1500.0, 2000.0).cover, Cover::Sea);
    ASSERT_EQ(surface->sample(1500.0, -2000.0).cover, Cover::Sea);
    EXPECT_EQ(source_at(*surface, 1500.0, 2000.0), "north.tif");
    EXPECT_EQ(source_at(*surface, -1500.0, 2000.0), "north.tif");
    EXPECT_EQ(source_at(*surface, 1500.0, -2000.0), "sea");
    EXPECT_EQ(source_at(*surface, -1500.0, -2000.0), "south.tif");
    // On into the apron it is made up.
    EXPECT_EQ(source_at(*surface, 4600.0, 2000.0), "sea");
  };
  check({north, south});
  check({south, north});
  // The first one's ellipsoid is all heights': floors stand apart.
  tiler::ElevationOptions inland = entry_of(folder / "hill.tif", "auto");
  inland.vertical_datum = "ellipsoid";
  check({inland, north, south});
  // An inset over a shelf.
  tiler::ElevationOptions inset = north;
  inset.blend_m = 300.0;
  RasterSpec wide = utm_spec(8192.0, 60.0);
  const double west_m = utm31(kOriginLat_deg, kOriginLon_deg).x();
  wide.value = [&](double u, double) { return u < west_m ? 0.1 * (west_m - u) : 0.0; };
  std::filesystem::create_directory(folder / "wide");
  write_raster(folder / "wide" / "south.tif", wide);
  check({inset, entry_of(folder / "wide" / "south.tif", "auto")});
}

TEST(Sea, OfProceduralLandIsThatLands) {
  tiler::WorldOptions options = world_of("procedural", 16384.0);
  options.elevation[0].landform = "islands";
  const auto surface = prepare(options);
  int num_sea = 0;
  for (double y = -8000.0; y < 8001.0; y += 500.0)
    for (double x = -8000.0; x < 8001.0; x += 500.0) {
      const auto sample = surface->sample(x, y);
      num_sea += sample.cover == Cover::Sea ? 1 : 0;
      EXPECT_EQ(surface->sources()[sample.source].kind, "procedural") << x << " " << y;
    }
  EXPECT_GT(num_sea, 100);
  EXPECT_EQ(surface->sources()[surface->sample(30000.0, 0.0).source].kind, "sea");
}

TEST(Sea, OfNoDataIsNoVoidAndNoGap) {
  const ScratchFolder folder;
  const auto nothing = [](double) { return -32768.0; };
  expect_error(ErrorKind::Input, {"no raster covers"},
               [&] { prepare(coast(folder, "auto", nothing)); });
  const auto surface = prepare(coast(folder, "nodata", nothing));
  const auto sample = surface->sample(2000.0, 0.0);
  EXPECT_EQ(sample.cover, Cover::Sea);
  EXPECT_EQ(surface->sources()[sample.source].kind, "sea");
  EXPECT_NEAR(above_geoid_m(*surface, 2000.0, 0.0), 0.0, 0.02);
  EXPECT_NEAR(sample.water_depth_m, 40.0, 1.0);
  EXPECT_EQ(surface->sources()[0].num_voids_filled, 0);
  EXPECT_EQ(surface->sample(-500.0, 0.0).cover, Cover::Land);
}

TEST(Sea, HasNoBarsOfSandBesideARoughShore) {
  // Seen off Monaco: beside samples of -11 m and of cliffs the spline swung above 0, and squares of
  // beach lay in the sea, a cell apart.
  const ScratchFolder folder;
  RasterSpec spec = utm_spec(8192.0, 30.0);
  const Eigen::Vector2d middle = utm31(kOriginLat_deg, kOriginLon_deg);
  spec.value = [&](double u, double v) {
    const double east = u - middle.x();
    if (east >= 30.0) return 0.0;
    const int row = static_cast<int>(std::floor(v / 30.0));
    if (east >= 0.0) return row % 3 == 0 ? -11.0 : row % 3 == 1 ? 120.0 : 0.0;
    return 100.0 - 0.1 * east;
  };
  write_raster(folder / "rough.tif", spec);
  tiler::WorldOptions options = world_of_rasters({folder / "rough.tif"}, 8192.0);
  options.detail_roughness = 0.0;
  options.elevation[0].vertical_datum = "egm96";
  const auto surface = prepare(options);
  // From the first column of zeros on; world axes lean by less than 3 m against the grid's here.
  for (double y = -200.0; y < 200.0; y += 3.1)
    for (double x = 66.0; x < 260.0; x += 3.7) {
      const auto sample = surface->sample(x, y);
      EXPECT_EQ(sample.cover, Cover::Sea) << x << " " << y;
    }
  EXPECT_EQ(surface->sample(-60.0, 0.0).cover, Cover::Land);
}

TEST(Sea, BelowTheEllipsoidIsRefused) {
  tiler::WorldOptions options = world_of_rasters({"coast.tif"});
  options.elevation[0].sea = "below";
  expect_error(ErrorKind::Config, {"sea = \"below\"", "ellipsoid"}, [&] { options.validate(); });
}

TEST(Sea, GoesOnBeyondTheSquareWithItsFloor) {
  const ScratchFolder folder;
  const auto surface = prepare(coast(folder, "auto", [](double) { return 0.0; }));
  const double inside_m = surface->sample(4095.0, 0.0).water_depth_m;
  EXPECT_NEAR(surface->sample(4100.0, 0.0).water_depth_m, inside_m, 0.5);
  const auto far = surface->sample(30000.0, 0.0);
  EXPECT_EQ(far.cover, Cover::Sea);
  EXPECT_GT(far.water_depth_m, 20.0);
}

TEST(Sea, KeepsItsFloorInTheTile) {
  const ScratchFolder folder;
  const auto surface =
      prepare(coast(folder, "below", [](double from_shore_m) { return -0.03 * from_shore_m; }));
  const world::TileId id{4, 0, 0};  // 4 km, all of it east of the shore
  const world::Tile tile = build_tile(*surface, id);
  ASSERT_EQ(tile.water_depth_steps.size(), tile.cover.size());
  world::write_tile(folder.path(), tile);
  const auto bytes = world::encode_tile(tile);
  EXPECT_EQ(world::decode_tile(bytes, id, "a.tile", world::WaterDepth::Read).water_depth_steps,
            tile.water_depth_steps);
  // It is not read where nobody asks for it: rays end at the surface.
  EXPECT_TRUE(world::decode_tile(bytes, id, "a.tile").water_depth_steps.empty());
  for (const int i : {16, 100, 200}) {
    const double x = id.corner_world().x() + i * id.spacing_m();
    const double y = id.corner_world().y() + 40 * id.spacing_m();
    EXPECT_NEAR(tile.water_depth_steps[world::Tile::sample(i, 40)] * world::kHeightStep_m,
                surface->sample(x, y).water_depth_m, 0.5 * world::kHeightStep_m);
  }
  // Land brings no layer at all.
  const world::Tile land = build_tile(*surface, {2, -3, 0});
  EXPECT_TRUE(land.water_depth_steps.empty());
  EXPECT_EQ(
      world::decode_tile(world::encode_tile(land), land.id, "b.tile", world::WaterDepth::Read),
      land);
}

TEST(RealData, MonacoHasItsSeaAndItsMountains) {
  TERRACAST_NEEDS_SHARED_DATA("monaco/N43E007.hgt");
  tiler::WorldOptions options = world_of_rasters({shared_data() / "monaco/N43E007.hgt"}, 25600.0);
  options.origin_lat_deg = 43.74;
  options.origin_lon_deg = 7.42;
  options.elevation[0].vertical_datum = "egm96";
  const auto surface = prepare(options);
  const auto at = [&](double lat_deg, double lon_deg) {
    const Eigen::Vector3d place =
        surface->frame().world_from_geodetic({.lat_deg = lat_deg, .lon_deg = lon_deg});
    return place;
  };
  const auto cover = [&](double lat_deg, double lon_deg) {
    const Eigen::Vector3d place = at(lat_deg, lon_deg);
    return surface->sample(place.x(), place.y()).cover;
  };
  EXPECT_EQ(cover(43.70, 7.45), Cover::Sea);       // off the harbour
  EXPECT_EQ(cover(43.69, 7.31), Cover::Sea);       // bay of Villefranche's mouth
  EXPECT_EQ(cover(43.7384, 7.4246), Cover::Land);  // Monaco
  EXPECT_EQ(cover(43.775, 7.425), Cover::Land);
  // Mont Agel, 1148 m; SRTM cuts peaks.
  const double agel_m = surface->measured_height_m(43.7745, 7.4228).value() -
                        geo::Geoid::egm96()->undulation_m(43.7745, 7.4228);
  EXPECT_GT(agel_m, 1000.0);
  EXPECT_LT(agel_m, 1160.0);
}

}  // namespace
}  // namespace terracast::test
