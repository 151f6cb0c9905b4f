#include <cmath>

#include "tests/tiler/raster_files.h"
#include "tiler/tile_builder.h"

// Fine rasters over coarse ones, and measured land in procedural land.
namespace terracast::test {
namespace {

using core::ErrorKind;
using tiler::WorldSurface;

tiler::ElevationOptions raster_entry(const std::filesystem::path& file, double blend_m = 0.0) {
  tiler::ElevationOptions entry;
  entry.kind = "raster";
  entry.vertical_datum = "ellipsoid";
  entry.blend_m = blend_m;
  entry.files.push_back({.written = file.string(), .resolved = file});
  return entry;
}

tiler::WorldOptions world_of_entries(std::vector<tiler::ElevationOptions> entries, double size_m) {
  tiler::WorldOptions options = world_of("raster", size_m);
  options.detail_roughness = 0.0;
  options.elevation = std::move(entries);
  return options;
}

double height_m(const WorldSurface& surface, double x, double y) {
  return surface.frame().geodetic_from_world({x, y, surface.sample(x, y).z_world}).height_m;
}

/// East and north of the origin on the plane of the projection.
Eigen::Vector2d from_origin(double u, double v) {
  return Eigen::Vector2d(u, v) - utm31(kOriginLat_deg, kOriginLon_deg);
}

constexpr double kInsetSide_m = 1600.0;

/// 90 m of ground at 500 m, and in it 1.6 km at 5 m and another height, in another projection.
struct Fixture {
  ScratchFolder folder;
  std::filesystem::path coarse = folder / "coarse.tif";
  std::filesystem::path fine = folder / "fine.tif";

  explicit Fixture(const std::function<double(double x, double y)>& fine_m) {
    RasterSpec ground = utm_spec(16384.0, 90.0);
    ground.value = [](double, double) { return 500.0; };
    write_raster(coarse, ground);
    RasterSpec inset;
    inset.crs = "EPSG:3857";
    // 1 / cos(latitude) of mercator metres to a metre.
    const double scale = 1.0 / std::cos(kOriginLat_deg * M_PI / 180.0);
    constexpr double kHalf_m = 20037508.342789244;
    const double u = kHalf_m * kOriginLon_deg / 180.0;
    const double v =
        kHalf_m / M_PI * std::log(std::tan(M_PI / 4.0 + kOriginLat_deg * M_PI / 360.0));
    inset.width = inset.height = static_cast<int>(kInsetSide_m / 5.0);
    inset.geotransform = {u - 0.5 * kInsetSide_m * scale, 5.0 * scale, 0.0,
                          v + 0.5 * kInsetSide_m * scale, 0.0,         -5.0 * scale};
    inset.value = [=](double east, double north) {
      return fine_m((east - u) / scale, (north - v) / scale);
    };
    write_raster(fine, inset);
  }
};

TEST(Insets, PassIntoTheGroundRoundThemWithoutAStep) {
  const Fixture files([](double, double) { return 560.0; });
  const auto surface = prepare(
      world_of_entries({raster_entry(files.fine, 200.0), raster_entry(files.coarse)}, 8192.0));
  // Inside, beyond the blend, the inset alone; outside the coarse ground alone.
  for (const double x : {-500.0, 0.0, 560.0}) EXPECT_NEAR(height_m(*surface, x, 30.0), 560.0, 1e-6);
  for (const double x : {-2000.0, -820.0, 812.0, 3000.0})
    EXPECT_NEAR(height_m(*surface, x, 30.0), 500.0, 1e-6);
  // 60 m over 200 m by 3 t^2 - 2 t^3: at most 1.5 x 0.3 a metre. A step would show as 60 m.
  double previous_m = height_m(*surface, 400.0, 30.0);
  double steepest = 0.0;
  for (double x = 401.0; x < 1000.0; x += 1.0) {
    const double here_m = height_m(*surface, x, 30.0);
    EXPECT_LE(here_m, previous_m + 1e-3) << x;  // the spline's overshoot of the shares
    steepest = std::max(steepest, previous_m - here_m);
    previous_m = here_m;
  }
  EXPECT_GT(steepest, 0.40);
  EXPECT_LT(steepest, 0.47);
  // The closed form of the share, from the first row of samples: to a sample's width of slope.
  const double from_border_m = 100.0;
  const double t = (from_border_m - 5.0) / 200.0;
  EXPECT_NEAR(height_m(*surface, 0.5 * kInsetSide_m - from_border_m, 30.0),
              500.0 + 60.0 * t * t * (3.0 - 2.0 * t), 5.0 * 0.45);
}

TEST(Insets, StandWhereTheirProjectionPutsThem) {
  // A plane of the inset's: half a sample of shift would be 1.25 m.
  const Fixture files([](double x, double y) { return 500.0 + 0.5 * x - 0.25 * y; });
  const auto surface = prepare(
      world_of_entries({raster_entry(files.fine, 50.0), raster_entry(files.coarse)}, 8192.0));
  for (const Eigen::Vector2d& at : scattered_places(1300.0)) {
    const auto sample = surface->sample(at.x(), at.y());
    const auto place = surface->frame().geodetic_from_world({at.x(), at.y(), sample.z_world});
    const double scale = 1.0 / std::cos(kOriginLat_deg * M_PI / 180.0);
    constexpr double kHalf_m = 20037508.342789244;
    const auto mercator_v = [](double lat_deg) {
      return kHalf_m / M_PI * std::log(std::tan(M_PI / 4.0 + lat_deg * M_PI / 360.0));
    };
    const double x = kHalf_m * (place.lon_deg - kOriginLon_deg) / 180.0 / scale;
    const double y = (mercator_v(place.lat_deg) - mercator_v(kOriginLat_deg)) / scale;
    // Map coordinates are good to 1e-6 m, and the plane is steeper than 45 degrees nowhere.
    EXPECT_NEAR(place.height_m, 500.0 + 0.5 * x - 0.25 * y, 3e-6);
  }
}

TEST(Insets, SayTheirSourceAndTakeNoDetailThatTheyKnow) {
  const Fixture files([](double x, double) { return 500.0 + 0.3 * x; });
  tiler::WorldOptions options =
      world_of_entries({raster_entry(files.fine, 100.0), raster_entry(files.coarse)}, 8192.0);
  const auto smooth = prepare(options);
  options.detail_roughness = 1.0;
  const auto rough = prepare(options);
  EXPECT_EQ(smooth->measured_level(), 6);  // of the widest samples, 90 m
  EXPECT_EQ(smooth->sources()[smooth->sample(0.0, 0.0).source].name, "fine.tif");
  EXPECT_EQ(smooth->sources()[smooth->sample(2000.0, 0.0).source].name, "coarse.tif");
  EXPECT_NEAR(smooth->sources()[smooth->sample(0.0, 0.0).source].spacing_m, 5.0, 0.02);
  double most_m = 0.0;
  double most_on_lattice_m = 0.0;
  for (int k = -40; k <= 40; ++k) {
    const auto added_m = [&](double x, double y) {
      return std::abs(rough->sample(x, y).z_world - smooth->sample(x, y).z_world);
    };
    most_m = std::max(most_m, added_m(7.3 * k, 11.1 * k + 3.7));
    most_on_lattice_m = std::max(most_on_lattice_m, added_m(4.0 * k, 8.0 * k));
  }
  // Level 2 has 4 m: its lattice holds measured heights only. Below, octaves of 4, 2 and 1 m are
  // some decimetres; those of 64 m would be metres.
  EXPECT_EQ(most_on_lattice_m, 0.0);
  EXPECT_GT(most_m, 0.01);
  EXPECT_LT(most_m, 1.0);
}

TEST(Insets, OfOtherDatumsAreBroughtToTheGrounds) {
  const Fixture files([](double, double) { return 500.0; });
  tiler::WorldOptions options =
      world_of_entries({raster_entry(files.fine, 100.0), raster_entry(files.coarse)}, 8192.0);
  options.elevation[0].vertical_datum = "egm96";
  const auto surface = prepare(options);
  // The geoid's cubic jumps by up to 2 cm between cells, as it does here.
  EXPECT_NEAR(height_m(*surface, 0.0, 0.0),
              500.0 + geo::Geoid::egm96()->undulation_m(kOriginLat_deg, kOriginLon_deg), 0.02);
  EXPECT_NEAR(height_m(*surface, 3000.0, 0.0), 500.0, 1e-6);
}

TEST(Insets, InAnOrderThatLeavesOneUnaskedAreRefused) {
  tiler::WorldOptions options =
      world_of_entries({raster_entry("fine.tif", 100.0), raster_entry("coarse.tif")}, 8192.0);
  EXPECT_NO_THROW(options.validate());
  std::swap(options.elevation[0], options.elevation[1]);
  expect_error(ErrorKind::Config, {"elevation.1", "insets go first"}, [&] { options.validate(); });
  options.elevation.erase(options.elevation.begin());
  expect_error(ErrorKind::Config, {"elevation.0", "needs rasters behind it"},
               [&] { options.validate(); });
  options = world_of("procedural");
  options.outside = "procedural";
  expect_error(ErrorKind::Config, {"outside = \"procedural\"", "everywhere"},
               [&] { options.validate(); });
}

tiler::WorldOptions island(const ScratchFolder& folder, double ground_m) {
  RasterSpec spec = utm_spec(1600.0, 5.0);
  spec.value = [=](double u, double v) {
    const Eigen::Vector2d at = from_origin(u, v);
    return ground_m + 0.05 * at.x() + 6.0 * std::sin(at.x() / 40.0) * std::cos(at.y() / 55.0);
  };
  write_raster(folder / "island.tif", spec);
  tiler::WorldOptions options = world_of_entries({raster_entry(folder / "island.tif")}, 8192.0);
  options.outside = "procedural";
  options.outside_blend_m = 1500.0;
  options.elevation.emplace_back();
  options.elevation.back().kind = "procedural";
  options.elevation.back().relief_m = 600.0;
  return options;
}

TEST(ProceduralOutside, GoesOnFromMeasuredLandWithoutAStep) {
  const ScratchFolder folder;
  tiler::WorldOptions options = island(folder, 900.0);
  const auto surface = prepare(options);
  // Measured land is itself, but for the last 37 m of its border (2 samples of 16 m, and one of 5).
  for (const Eigen::Vector2d& at : scattered_places(1500.0)) {
    const auto sample = surface->sample(at.x(), at.y());
    const auto place = surface->frame().geodetic_from_world({at.x(), at.y(), sample.z_world});
    const Eigen::Vector2d east_north =
        utm31(place.lat_deg, place.lon_deg) - utm31(kOriginLat_deg, kOriginLon_deg);
    // The spline errs by 0.4 h^3 f''' / 27, 5 mm for waves of 40 m at 5 m.
    EXPECT_NEAR(place.height_m,
                900.0 + 0.05 * east_north.x() +
                    6.0 * std::sin(east_north.x() / 40.0) * std::cos(east_north.y() / 55.0),
                0.02);
  }
  // Far away the procedural land, as without any raster: below its relief of 600 m.
  tiler::WorldOptions bare = world_of("procedural", 8192.0);
  bare.detail_roughness = 0.0;
  bare.elevation[0].relief_m = 600.0;
  const auto land = prepare(bare);
  for (const double x : {-3900.0, 3500.0})
    EXPECT_NEAR(surface->sample(x, -3300.0).z_world, land->sample(x, -3300.0).z_world, 1e-5);
  // Between them no step, which would show as half its height here: 900 m down to what lies there,
  // over 1.5 km, hills with slides of 0.8, and the waves of the border's ground.
  double steepest = 0.0;
  for (const double angle : {0.3, 1.9, 3.4, 5.1})
    for (double r = 500.0; r < 3200.0; r += 2.0) {
      const auto z = [&](double at) {
        return surface->sample(at * std::cos(angle), at * std::sin(angle)).z_world;
      };
      steepest = std::max(steepest, std::abs(z(r + 2.0) - z(r)) / 2.0);
    }
  EXPECT_LT(steepest, 4.0);
  EXPECT_EQ(surface->sources()[surface->sample(0.0, 0.0).source].kind, "raster");
  EXPECT_EQ(surface->sources()[surface->sample(3000.0, 0.0).source].kind == "procedural" ||
                surface->sources()[surface->sample(3000.0, 0.0).source].kind == "sea",
            true);
}

TEST(ProceduralOutside, IsTheSameForTheSameSeedAndAnyThreads) {
  const ScratchFolder folder;
  const tiler::WorldOptions options = island(folder, 300.0);
  const auto one = prepare(options, 1);
  const auto two = prepare(options, 2);
  EXPECT_EQ(one->input_hash(), two->input_hash());
  EXPECT_EQ(build_tile(*one, {4, 0, 0}), build_tile(*two, {4, 0, 0}));
  tiler::WorldOptions other = options;
  other.seed = 9;
  EXPECT_NE(prepare(other)->input_hash(), one->input_hash());
}

}  // namespace
}  // namespace terracast::test
