#include "geo/magnetic_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <sstream>
#include <string>

#include "core/error.h"
#include "geo/geodesy.h"
#include "geo/sun.h"

/// The World Magnetic Model against the values that its makers publish.
namespace terracast::geo {
namespace {

TEST(MagneticField, HasAllPublishedTestValues) {
  std::ifstream file(TERRACAST_SOURCE_DIR "/tests/geo/wmm_test_values.csv");
  std::string line;
  int num_values = 0;
  while (std::getline(file, line)) {
    if (line.empty() || std::isdigit(static_cast<unsigned char>(line[0])) == 0) continue;
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream row(line);
    double year = 0.0, height_km = 0.0, lat_deg = 0.0, lon_deg = 0.0, north = 0.0, east = 0.0,
           down = 0.0;
    ASSERT_TRUE(row >> year >> height_km >> lat_deg >> lon_deg >> north >> east >> down) << line;
    const Geodetic place{.lat_deg = lat_deg, .lon_deg = lon_deg, .height_m = 1e3 * height_km};
    const Eigen::Vector3d ecef_nt = magnetic_field_ecef_nt(ecef_from_geodetic(place), year);
    const WorldFrame there(place);
    const Eigen::Vector3d enu_nt = there.ecef_from_world().rotation.conjugate() * ecef_nt;
    // They are printed to 0.1 nT and, of WMM2025, to 1e-6 nT, though some of these to no more than 0.001 nT.
    const double printed_nt = year < 2025.0 ? 0.05 + 1e-9 : 1e-3;
    EXPECT_NEAR(enu_nt.x(), east, printed_nt) << line;
    EXPECT_NEAR(enu_nt.y(), north, printed_nt) << line;
    EXPECT_NEAR(enu_nt.z(), -down, printed_nt) << line;
    ++num_values;
  }
  EXPECT_EQ(num_values, 212);
}

TEST(MagneticField, OtherYearsAreRefused) {
  for (const double year : {2014.999, 2030.0, 1990.0}) {
    try {
      check_magnetic_year(year);
      ADD_FAILURE() << year;
    } catch (const core::Error& error) {
      EXPECT_EQ(error.kind(), core::ErrorKind::Config);
      EXPECT_NE(error.message().find("2015"), std::string::npos) << error.message();
      EXPECT_NE(error.message().find("2030"), std::string::npos) << error.message();
    }
  }
  EXPECT_NO_THROW(check_magnetic_year(2015.0));
  EXPECT_NO_THROW(check_magnetic_year(2029.9999));
}

TEST(MagneticField, YearsAreCountedByTheirOwnLength) {
  EXPECT_EQ(decimal_year(unix_seconds_from_utc("2025-01-01T00:00:00Z")), 2025.0);
  EXPECT_DOUBLE_EQ(decimal_year(unix_seconds_from_utc("2025-07-02T12:00:00Z")), 2025.5);
  EXPECT_DOUBLE_EQ(decimal_year(unix_seconds_from_utc("2024-07-02T00:00:00Z")), 2024.5);
  EXPECT_DOUBLE_EQ(decimal_year(unix_seconds_from_utc("1969-07-02T12:00:00Z")), 1969.5);
}

}  // namespace
}  // namespace terracast::geo
