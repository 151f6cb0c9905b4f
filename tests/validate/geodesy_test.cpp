#include "validate/geodesy.h"

#include <gtest/gtest.h>

namespace terracast::validate {
namespace {

TEST(ValidateGeodesy, MatchesClosedFormsOnAxesAndAPublishedPoint) {
  EXPECT_NEAR(ecef_from_geodetic({0.0, 0.0, 0.0}).x(), 6378137.0, 1e-9);
  EXPECT_NEAR(ecef_from_geodetic({90.0, 0.0, 0.0}).z(), 6356752.314245179,
              1e-8);  // NIMA TR8350.2: b
  // NGA's test point of EPSG guidance note 7-2, 2.2.1: to the 1 mm printed there.
  const Eigen::Vector3d point =
      ecef_from_geodetic({53.0 + 48.0 / 60 + 33.820 / 3600, 2.0 + 7.0 / 60 + 46.380 / 3600, 73.0});
  EXPECT_NEAR(point.x(), 3771793.968, 1e-2);  // the seconds are printed to 1 mm
  EXPECT_NEAR(point.y(), 140253.342, 1e-2);
  EXPECT_NEAR(point.z(), 5124304.349, 1e-2);
}

TEST(ValidateGeodesy, InverseReturnsToTheSamePlaceWithinFourNanometres) {
  double worst_m = 0.0;
  for (double lat = -90.0; lat <= 90.0; lat += 7.5)
    for (double lon = -180.0; lon < 180.0; lon += 22.5)
      for (const double height : {-5000.0, 0.0, 1234.5, 9000.0, 400000.0}) {
        const Eigen::Vector3d there = ecef_from_geodetic({lat, lon, height});
        const Geodetic back = geodetic_from_ecef(there);
        worst_m = std::max(worst_m, (ecef_from_geodetic(back) - there).norm());
        EXPECT_NEAR(back.height_m, height, 3e-9);  // doubles of 6.4e6 m are spaced 9e-10 m
      }
  EXPECT_LT(worst_m, 4e-9);
}

TEST(ValidateGeodesy, UpIsTheDirectionInWhichHeightGrows) {
  const Geodetic place{42.5, 1.5, 1000.0};
  const Eigen::Matrix3d rotation = enu_from_ecef(place);
  const auto step = [&](Geodetic moved) {
    return (rotation * (ecef_from_geodetic(moved) - ecef_from_geodetic(place))).eval();
  };
  EXPECT_NEAR((step({42.5, 1.5, 1010.0}) - Eigen::Vector3d(0, 0, 10)).norm(), 0.0, 1e-8);
  EXPECT_GT(step({42.5, 1.5001, 1000.0}).x(), 8.0);   // east
  EXPECT_GT(step({42.5001, 1.5, 1000.0}).y(), 11.0);  // north
  EXPECT_NEAR((rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm(), 0.0, 1e-15);
  EXPECT_NEAR(rotation.determinant(), 1.0, 1e-15);
}

}  // namespace
}  // namespace terracast::validate
