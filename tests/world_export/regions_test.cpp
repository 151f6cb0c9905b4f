#include <cmath>

#include "tests/world_export/export_world.h"

namespace terracast::world_export {
namespace {

TEST(Regions, CountLongitudesOverTheDateLine) {
  world::WorldManifest manifest;
  manifest.origin = {.lat_deg = 10.0, .lon_deg = 179.95};
  manifest.size_m = 20e3;
  const Region square = region_of_square(manifest);
  // 10 km along the meridian and the parallel, whose radius is that of the normal times the cosine.
  EXPECT_NEAR(square.north_deg, 10.0 + 10e3 / 6337e3 * 180.0 / kPi, 1e-3);
  EXPECT_NEAR(square.east_deg, 179.95 + 10e3 / (6379e3 * std::cos(kPi / 18.0)) * 180.0 / kPi, 1e-3);
  EXPECT_GT(square.east_deg, 180.0);
  EXPECT_EQ(clipped_to_square(manifest, {-90.0, -180.0, 90.0, 180.0}), square);
  EXPECT_EQ(clipped_to_square(manifest, {-90.0, 0.0, 90.0, 360.0}), square);
  EXPECT_EQ(clipped_to_square(manifest, {-90.0, 179.0, 90.0, 180.0}).east_deg, 180.0);
  EXPECT_EQ(clipped_to_square(manifest, {-90.0, -180.0, 90.0, -179.0}),
            (Region{square.south_deg, 180.0, square.north_deg, square.east_deg}));
  const geo::Geodetic west{.lat_deg = 10.0, .lon_deg = 179.99};
  const geo::Geodetic east{.lat_deg = 10.0, .lon_deg = -179.99};
  for (const geo::Geodetic& place : {west, east}) EXPECT_TRUE(square.contains(place));
  EXPECT_FALSE(square.contains({.lat_deg = 10.0, .lon_deg = -179.9}));
  const Region eastern{9.0, 180.0, 11.0, 180.1};
  EXPECT_TRUE(eastern.contains(east));
  EXPECT_FALSE(eastern.contains(west));
  EXPECT_NEAR(eastern.center().lon_deg, -179.95, 1e-12);
}

TEST(Regions, OfSquaresRoundAPoleAreAllLongitudes) {
  world::WorldManifest manifest;
  manifest.size_m = 50e3;
  for (const double sign : {-1.0, 1.0}) {
    manifest.origin = {.lat_deg = sign * 89.9, .lon_deg = 20.0};
    const Region square = region_of_square(manifest);
    EXPECT_EQ(sign > 0.0 ? square.north_deg : square.south_deg, sign * 90.0);
    EXPECT_EQ(square.west_deg, -160.0);
    EXPECT_EQ(square.east_deg, 200.0);
    EXPECT_EQ(clipped_to_square(manifest, {-90.0, -180.0, 90.0, 180.0}), square);
  }
  manifest.origin = {.lat_deg = 89.0, .lon_deg = 20.0};
  EXPECT_LT(region_of_square(manifest).north_deg, 89.5);
}

}  // namespace
}  // namespace terracast::world_export
