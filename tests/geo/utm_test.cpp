// UTM against the meridian's arc and a published place; GPS time against published leap seconds.

#include "geo/utm.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "geo/gps_time.h"
#include "geo/sun.h"
#include "tests/support/expect_error.h"

namespace terracast::test {
namespace {

/// Length of the meridian from the equator, by Simpson's rule over the ellipse's radius of curvature.
double meridian_m(double lat_deg) {
  constexpr double kRadius_m = 6378137.0, kFlattening = 1.0 / 298.257223563;
  const double e2 = kFlattening * (2.0 - kFlattening);
  const auto radius_m = [&](double lat) {
    const double sine = std::sin(lat);
    return kRadius_m * (1.0 - e2) / std::pow(1.0 - e2 * sine * sine, 1.5);
  };
  constexpr int kSteps = 2000;
  const double step = lat_deg * std::numbers::pi / 180.0 / kSteps;
  double sum = radius_m(0.0) + radius_m(step * kSteps);
  for (int i = 1; i < kSteps; ++i) sum += (i % 2 == 0 ? 2.0 : 4.0) * radius_m(step * i);
  return sum * step / 3.0;
}

TEST(Utm, TheCentralMeridianIsShrunkByItsFactor) {
  for (const double lat_deg : {-79.0, -33.3, 0.5, 42.5, 83.9}) {
    const geo::UtmZone zone = geo::utm_zone(lat_deg, 9.0);
    EXPECT_EQ(zone.is_north, lat_deg >= 0.0);
    EXPECT_TRUE(zone.number == 32 || lat_deg > 72.0);
    const geo::UtmPlace place = geo::utm_from_geodetic(zone, lat_deg, zone.central_meridian_deg());
    EXPECT_NEAR(place.easting_m, 500000.0, 1e-7);
    EXPECT_NEAR(place.northing_m, (lat_deg < 0.0 ? 1e7 : 0.0) + 0.9996 * meridian_m(lat_deg), 1e-6);
  }
}

// The example of GeographicLib's documentation of GeoCoords: 33.3 N, 44.4 E.
TEST(Utm, APublishedPlaceIsWhereItIs) {
  const geo::UtmZone zone = geo::utm_zone(33.3, 44.4);
  EXPECT_EQ(zone.epsg(), 32638);
  EXPECT_EQ(zone.central_meridian_deg(), 45.0);
  const geo::UtmPlace place = geo::utm_from_geodetic(zone, 33.3, 44.4);
  EXPECT_NEAR(place.easting_m, 444140.54, 0.006);
  EXPECT_NEAR(place.northing_m, 3684706.36, 0.006);
}

TEST(Utm, AMapGoesOnBeyondTheEquatorAndItsZone) {
  const geo::UtmZone north{.number = 31, .is_north = true}, south{.number = 31, .is_north = false};
  EXPECT_EQ(south.epsg(), 32731);
  EXPECT_NEAR(geo::utm_from_geodetic(north, -0.1, 3.5).northing_m,
              -geo::utm_from_geodetic(north, 0.1, 3.5).northing_m, 1e-6);
  EXPECT_NEAR(geo::utm_from_geodetic(south, 0.1, 3.5).northing_m,
              1e7 + geo::utm_from_geodetic(north, 0.1, 3.5).northing_m, 1e-6);
  // The next zone's places go on to the east.
  EXPECT_GT(geo::utm_from_geodetic(north, 45.0, 6.5).easting_m, 700000.0);
  expect_error(core::ErrorKind::Config, {"85", "84"}, [] { geo::utm_zone(85.0, 10.0); });
  expect_error(core::ErrorKind::Input, {"zone 31"},
               [&] { geo::utm_from_geodetic(north, 10.0, 120.0); });
}

TEST(GpsTime, LeapSecondsAreThosePublished) {
  const auto leaps_s = [](const char* utc) {
    return geo::gps_minus_utc_s(geo::unix_seconds_from_utc(utc));
  };
  EXPECT_EQ(leaps_s("1980-01-06T00:00:00Z"), 0.0);
  EXPECT_EQ(leaps_s("1981-06-30T23:59:59Z"), 0.0);
  EXPECT_EQ(leaps_s("1981-07-01T00:00:00Z"), 1.0);
  EXPECT_EQ(leaps_s("1990-01-01T00:00:00Z"), 6.0);
  EXPECT_EQ(leaps_s("1999-01-01T00:00:00Z"), 13.0);
  EXPECT_EQ(leaps_s("2005-12-31T23:59:59Z"), 13.0);
  EXPECT_EQ(leaps_s("2015-07-01T00:00:00Z"), 17.0);
  EXPECT_EQ(leaps_s("2016-12-31T23:59:59Z"), 17.0);
  EXPECT_EQ(leaps_s("2025-06-21T10:00:00Z"), 18.0);
  // GPS week 2371 began on 2025-06-15 at midnight of GPS time, 18 s before that of UTC.
  EXPECT_EQ(geo::gps_seconds_from_unix(geo::unix_seconds_from_utc("2025-06-14T23:59:42Z")),
            2371.0 * 604800.0);
}

}  // namespace
}  // namespace terracast::test
