#include <cmath>

#include "tests/tiler/raster_files.h"
#include "tiler/raster_source.h"

// Rasters in longitude and latitude that go round the Earth have no edge.
namespace terracast::test {
namespace {

using core::ErrorKind;

/// Smooth, of the period of the Earth, and of no other.
double belt_m(double lat_deg, double lon_deg) {
  const double lon_rad = lon_deg * M_PI / 180.0;
  return 1000.0 + 300.0 * std::sin(lon_rad) + 200.0 * std::cos(3.0 * lon_rad + 1.0) +
         10.0 * (lat_deg + 17.0);
}

struct Belt {
  const char* name;
  double west_deg;  ///< of the first pixel's edge
  double step_deg;  ///< of a column; negative: towards the west
  int width;
  bool is_point = false;
};

/// A belt of 3 degrees about 17 degrees south.
RasterSpec belt_spec(const Belt& belt) {
  RasterSpec spec;
  spec.crs = "EPSG:4326";
  spec.type = GDT_Float32;
  spec.width = belt.width;
  spec.height = 30;
  spec.is_point = belt.is_point;
  spec.geotransform = {belt.west_deg, belt.step_deg, 0.0, -15.5, 0.0, -0.1};
  spec.value = [](double u, double v) { return belt_m(v, u); };
  return spec;
}

const Belt kBelts[] = {
    {"cells_from_180", -180.0, 0.1, 3600},
    {"cells_from_0", 0.0, 0.1, 3600},
    {"points_with_both_ends", -180.05, 0.1, 3601, true},
    {"points_with_one_end", -180.05, 0.1, 3600, true},
    {"overlapping", -190.0, 0.1, 3800},
    {"from_anywhere", 73.0, 0.1, 3600},
    {"few_digits", -180.0, 0.09999, 3600},
    {"towards_the_west", 180.0, -0.1, 3600},
};

TEST(Seam, HeightsGoOnRoundTheEarth) {
  const ScratchFolder folder;
  for (const Belt& belt : kBelts) {
    SCOPED_TRACE(belt.name);
    const auto file = folder / (std::string(belt.name) + ".tif");
    write_raster(file, belt_spec(belt));
    for (const double lon_deg : {180.0, -180.0, 179.95, -179.9, 0.0, 359.9, 73.0, 170.0}) {
      SCOPED_TRACE(lon_deg);
      tiler::WorldOptions options = world_of_rasters({file}, 16384.0);
      options.detail_roughness = 0.0;
      options.origin_lat_deg = -17.0;
      options.origin_lon_deg = lon_deg;
      const auto surface = prepare(options);
      for (double d_deg = -0.07; d_deg < 0.071; d_deg += 0.014) {
        const double at_deg = lon_deg + d_deg;
        // The spline of samples of 0.1 degrees errs by less than 1e-3 m, floats by 6e-5 m. With few digits, what
        // the file says is up to 0.36 of a column from itself once round: 0.036 degrees of a slope of 16 m a degree.
        const double tolerance_m = std::string(belt.name) == "few_digits" ? 0.6 : 2e-3;
        EXPECT_NEAR(surface->measured_height_m(-17.0, at_deg).value_or(1e9), belt_m(-17.0, at_deg),
                    tolerance_m)
            << at_deg;
      }
    }
  }
}

TEST(Seam, OverlappingColumnsAreCountedOnce) {
  const ScratchFolder folder;
  for (const Belt& belt : kBelts) {
    SCOPED_TRACE(belt.name);
    const auto file = folder / "belt.tif";
    write_raster(file, belt_spec(belt));
    const auto source = tiler::RasterSource::open({.written = "belt.tif", .resolved = file},
                                                  world_of("raster").elevation[0],
                                                  {.lat_deg = -17.0, .lon_deg = 180.0});
    EXPECT_TRUE(source->grid().goes_round());
    EXPECT_EQ(source->grid().width(), 3600);
    // Every column of the file comes once, and one beyond the last is the first.
    std::vector<int> times(static_cast<std::size_t>(belt.width), 0);
    for (int column = 0; column < 3600; ++column)
      ++times[static_cast<std::size_t>(source->grid().column_in_file(column))];
    for (int column = 0; column < 3600; ++column)
      EXPECT_EQ(times[static_cast<std::size_t>(column)], 1) << column;
    EXPECT_EQ(source->grid().column_in_file(3600), source->grid().column_in_file(0));
    EXPECT_EQ(source->grid().column_in_file(-1), source->grid().column_in_file(3599));
  }
}

TEST(Seam, WhatIsNotAsWideHasEdges) {
  const ScratchFolder folder;
  // A column is missing, and a raster of the eastern half.
  for (const Belt& belt : {Belt{"narrow", -180.0, 0.1, 3598}, Belt{"half", 0.0, 0.1, 1800}}) {
    const auto file = folder / "belt.tif";
    write_raster(file, belt_spec(belt));
    tiler::WorldOptions options = world_of_rasters({file}, 16384.0);
    options.origin_lat_deg = -17.0;
    options.origin_lon_deg = 180.0;
    expect_error(ErrorKind::Input, {"no raster covers"}, [&] { prepare(options); });
  }
}

TEST(Seam, TwoHalvesMeetAtTheSeam) {
  const ScratchFolder folder;
  write_raster(folder / "east.tif", belt_spec({"east", 0.0, 0.1, 1800}));
  write_raster(folder / "west.tif", belt_spec({"west", -180.0, 0.1, 1800}));
  tiler::WorldOptions options =
      world_of_rasters({folder / "east.tif", folder / "west.tif"}, 16384.0);
  options.detail_roughness = 0.0;
  options.origin_lat_deg = -17.0;
  options.origin_lon_deg = 180.0;
  const auto surface = prepare(options);
  for (double d_deg = -0.07; d_deg < 0.071; d_deg += 0.014)
    EXPECT_NEAR(surface->measured_height_m(-17.0, 180.0 + d_deg).value_or(1e9),
                belt_m(-17.0, 180.0 + d_deg), 2e-3);
}

TEST(Seam, PixelsInMessagesAreThoseOfTheFile) {
  const ScratchFolder folder;
  RasterSpec spec = belt_spec({"belt", -180.0, 0.1, 3600});
  // Column 3599 is the last before 180 degrees, row 14 from 16.9 to 17.0 degrees south.
  spec.value = [](double u, double v) {
    return u > 179.9 && v < -16.9 && v > -17.0 ? 20000.0 : 100.0;
  };
  write_raster(folder / "belt.tif", spec);
  tiler::WorldOptions options = world_of_rasters({folder / "belt.tif"}, 16384.0);
  options.origin_lat_deg = -17.0;
  options.origin_lon_deg = -180.0;
  expect_error(ErrorKind::Input, {"pixel (3599, 14)"}, [&] { prepare(options); });
}

}  // namespace
}  // namespace terracast::test
