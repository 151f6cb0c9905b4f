// Tables of JSBSim, as its output directive writes them: what is read of them, and what is refused.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "geo/geodesy.h"
#include "tests/geo/fixes_support.h"

namespace terracast::geo {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

class JsbsimFiles : public test::Recordings {
 protected:
  Fix first(const std::string& columns, const std::string& row,
            const std::string& above = "ellipsoid") {
    return read("jsbsim", "", columns + "\n" + row + "\n", above).fixes.at(0);
  }
  std::string refusal(const std::string& columns, const std::string& row,
                      core::ErrorKind kind = core::ErrorKind::Input,
                      const std::string& above = "ellipsoid") {
    return refused("jsbsim", "", columns + "\n" + row + "\n", kind, above);
  }
};

TEST_F(JsbsimFiles, EarthFixedPlacesAreTakenWhereTheyAre) {
  const Eigen::Vector3d ecef = ecef_from_geodetic({42.5, 1.5, 1234.5});
  const Fix fix = first(
      "Time,/fdm/jsbsim/position/ecef-x-ft,/fdm/jsbsim/position/ecef-y-ft,/fdm/jsbsim/position/"
      "ecef-z-ft,/fdm/jsbsim/position/lat-gc-deg,/fdm/jsbsim/position/h-sl-ft",
      fmt::format("0.5,{},{},{},42.3,4000", ecef.x() / 0.3048, ecef.y() / 0.3048,
                  ecef.z() / 0.3048));
  EXPECT_EQ(fix.time_s, 0.5);
  EXPECT_NEAR(fix.place.x(), 42.5, 1e-12);
  EXPECT_NEAR(fix.place.y(), 1.5, 1e-12);
  EXPECT_NEAR(fix.place.z(), 1234.5, 1e-7);
}

TEST_F(JsbsimFiles, FeetAreExactAndAnglesAreAboutForwardRightDown) {
  const Fix fix = first(
      "Time,/fdm/jsbsim/position/lat-geod-deg,/fdm/jsbsim/position/long-gc-deg,/fdm/jsbsim/"
      "position/geod-alt-ft,/fdm/jsbsim/attitude/phi-rad,/fdm/jsbsim/attitude/theta-rad,/fdm/"
      "jsbsim/attitude/psi-rad,/fdm/jsbsim/velocities/v-north-fps,/fdm/jsbsim/velocities/"
      "v-east-fps",
      "0,42.5,1.5,10000,0.1,0.2,1.1,300,400");
  EXPECT_EQ(fix.place, Eigen::Vector3d(42.5, 1.5, 3048.0));
  EXPECT_EQ(fix.speed_mps, 500.0 * 0.3048);
  const Eigen::Vector3d forward = *fix.attitude * Eigen::Vector3d::UnitX();
  EXPECT_NEAR(std::atan2(forward.x(), forward.y()), 1.1, 1e-12);
  EXPECT_NEAR(forward.z(), std::sin(0.2), 1e-12);
  EXPECT_NEAR((*fix.attitude * -Eigen::Vector3d::UnitY()).z(), -std::sin(0.1) * std::cos(0.2),
              1e-12);
}

TEST_F(JsbsimFiles, GroupsAreReadByTheirCaptions) {
  const FixTable table = read(
      "jsbsim", "",
      "Time,Altitude ASL (ft),Phi (deg),Theta (deg),Psi (deg),Latitude (deg),Latitude Geodetic "
      "(deg),Longitude (deg),V_{North} (ft/s),V_{East} (ft/s)\n"
      "1,1000,0,0,90,42.3,42.5,1.5,10,0\n");
  EXPECT_EQ(table.fixes[0].place, Eigen::Vector3d(42.5, 1.5, 304.8));
  EXPECT_NEAR((*table.fixes[0].attitude * Eigen::Vector3d::UnitX()).x(), 1.0, 1e-12);
  EXPECT_NE(test::remarks_of(table).find("20925650 ft"), std::string::npos);
  EXPECT_TRUE(table.ledger.warnings().empty()) << table.ledger.table();
}

TEST_F(JsbsimFiles, AGeocentricLatitudeAloneIsRefused) {
  for (const std::string name :
       {"/fdm/jsbsim/position/lat-gc-deg", "position/lat-gc-rad", "Latitude (deg)"}) {
    const std::string message =
        refusal("Time," + name + ",position/long-gc-deg,position/h-sl-ft", "0,42.3,1.5,1000");
    EXPECT_NE(message.find("0.19 degrees (21 km)"), std::string::npos) << message;
    EXPECT_NE(message.find("position/lat-geod-deg"), std::string::npos) << message;
  }
}

TEST_F(JsbsimFiles, HeightsAreThoseThatTheConfigAsksFor) {
  const std::string columns =
      "Time,position/lat-geod-rad,position/long-gc-rad,position/geod-alt-ft,position/h-sl-ft,"
      "position/h-agl-ft";
  const std::string row = "0,0.74,0.026,1000,1200,3000";
  EXPECT_EQ(first(columns, row).place.z(), 304.8);
  EXPECT_EQ(first(columns, row, "egm96").place.z(), 1200.0 * 0.3048);
  EXPECT_EQ(first(columns, row, "ground").place.z(), 3000.0 * 0.3048);
  EXPECT_TRUE(std::isnan(first(columns, row, "none").place.z()));
  EXPECT_NEAR(first(columns, row).place.x(), 0.74 / kDegree, 1e-12);
  EXPECT_NE(refusal(columns, row, core::ErrorKind::Config, "pressure").find("ground"),
            std::string::npos);
  EXPECT_NE(
      refusal("Time,position/lat-geod-deg,position/long-gc-deg", "0,1,2").find("above = \"none\""),
      std::string::npos);
  EXPECT_NE(refusal("t,position/lat-geod-deg", "0,1").find("Time"), std::string::npos);
}

TEST_F(JsbsimFiles, ARunOverASphereIsRefusedUnlessItsOwnSeaIsTaken) {
  // 1000 ft above the older program's sphere, at 42.5 degrees.
  const double radius_m = (20925650.0 + 1000.0) * 0.3048;
  const double lat_gc = 42.3 * kDegree, lon = 1.5 * kDegree;
  const Eigen::Vector3d ecef =
      radius_m * Eigen::Vector3d(std::cos(lat_gc) * std::cos(lon), std::cos(lat_gc) * std::sin(lon),
                                 std::sin(lat_gc));
  const Geodetic geodetic = geodetic_from_ecef(ecef);
  EXPECT_GT(geodetic.height_m, 5000.0);
  const std::string columns =
      "Time,position/ecef-x-ft,position/ecef-y-ft,position/ecef-z-ft,position/h-sl-ft";
  const std::string row =
      fmt::format("0,{},{},{},1000", ecef.x() / 0.3048, ecef.y() / 0.3048, ecef.z() / 0.3048);
  const std::string message = refusal(columns, row);
  EXPECT_NE(message.find("sphere"), std::string::npos) << message;
  EXPECT_NE(message.find("above = \"egm96\""), std::string::npos) << message;
  EXPECT_NEAR(first(columns, row, "egm96").place.z(), 304.8, 1e-9);
  EXPECT_NE(refusal("Time,position/lat-geod-deg,position/long-gc-deg,position/geod-alt-ft,"
                    "position/h-sl-ft",
                    fmt::format("0,42.5,1.5,{},1000", geodetic.height_m / 0.3048))
                .find("sphere"),
            std::string::npos);
}

TEST_F(JsbsimFiles, ColumnsOfOneNameAreRefusedOnlyWhereTheyAreNeeded) {
  const std::string place = "Time,position/lat-geod-deg,position/long-gc-deg,position/geod-alt-ft";
  EXPECT_NE(refusal(place + ",fdm/jsbsim/position/geod-alt-ft", "0,1,2,3,4").find("two columns"),
            std::string::npos);
  const FixTable table =
      read("jsbsim", "", place + ",aero/a,fdm/jsbsim/aero/a,b,b\n0,1,2,3,4,5,6,7\n");
  EXPECT_EQ(table.fixes.at(0).place.x(), 1.0);
  EXPECT_EQ(table.ledger.entries().at("aero/a").num_ignored, 1);
  EXPECT_EQ(table.ledger.entries().at("b").num_ignored, 1);
}

}  // namespace
}  // namespace terracast::geo
