// States of EuRoC's datasets: what is read of them, and what is refused.

#include <gtest/gtest.h>

#include <cmath>

#include "tests/geo/fixes_support.h"

namespace terracast::geo {
namespace {

using test::format_from;

class EurocFiles : public test::Recordings {
 protected:
  static constexpr const char* kHeader =
      "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
      "q_RS_z [], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1]\n";
};

TEST_F(EurocFiles, StatesAreReadToTheNanosecond) {
  const std::string text = std::string(kHeader) +
                           "1403636580838555648,1,2,3,0.8,0,0,0.6,3,4,5\n"
                           "1403636580843555671,1.5,2,3,1,0,0,0,3,4,5\n";
  const FixTable table = read("euroc", "", text, "");
  ASSERT_EQ(table.fixes.size(), 2u);
  EXPECT_EQ(table.frame, FixFrame::Local);
  EXPECT_EQ(table.fixes[0].time_s, 0.0);
  EXPECT_EQ(table.fixes[1].time_s, 0.005000023);
  EXPECT_EQ(table.fixes[0].place, Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(table.fixes[0].speed_mps, 5.0);
  const Eigen::Vector3d forward = *table.fixes[0].attitude * Eigen::Vector3d::UnitX();
  EXPECT_LT((forward - Eigen::Vector3d(0.28, 0.96, 0.0)).norm(), 1e-12);
  EXPECT_TRUE(table.ledger.warnings().empty()) << table.ledger.table();
  const FixTable unix = read("euroc", "unix_times = true", text, "");
  EXPECT_TRUE(unix.has_utc());
  EXPECT_NEAR(*unix.zero_unix_s, 1403636580.838555648, 3e-7);
  EXPECT_EQ(unix.fixes[1].time_s, 0.005000023);
  // The sensor's folder will do.
  written("state_groundtruth_estimate0/data.csv", text);
  EXPECT_EQ(
      format_from("euroc", "")->read(scratch_ / "state_groundtruth_estimate0", "").fixes.size(),
      2u);
}

// The inertial unit of EuRoC's vehicle: its x is up, its y to the right, its z ahead.
TEST_F(EurocFiles, TheAxesOfItsInertialUnitCanBeNamed) {
  // Its x along the file's z, y along -y, z along x: the vehicle looks along x and is upright.
  const double half = std::sqrt(0.5);
  const std::string text = std::string(kHeader) + fmt::format("1,1,2,3,0,{0},0,{0},3,4,5\n", half);
  const FixTable right = read("euroc", "attitude_axes = \"urf\"", text, "");
  const Eigen::Matrix3d axes = right.fixes.at(0).attitude->toRotationMatrix();
  EXPECT_LT((axes - Eigen::Matrix3d::Identity()).norm(), 1e-12) << axes;
  EXPECT_TRUE(right.remarks.empty()) << test::remarks_of(right);
  const FixTable wrong = read("euroc", "", text, "");
  EXPECT_NE(test::remarks_of(wrong).find("attitude_axes = \"urf\""), std::string::npos)
      << test::remarks_of(wrong);
}

TEST_F(EurocFiles, ColumnsOfOneNameAreRefusedOnlyWhereTheyAreNeeded) {
  const std::string header =
      "#timestamp,p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []";
  const FixTable table = read("euroc", "", header + ",note,note\n1,1,2,3,1,0,0,0,5,6\n", "");
  EXPECT_EQ(table.fixes.at(0).place.z(), 3.0);
  EXPECT_EQ(table.ledger.entries().at("note").num_ignored, 1);
  EXPECT_NE(refused("euroc", "", header + ",p_RS_R_x [m]\n1,1,2,3,1,0,0,0,5\n",
                    core::ErrorKind::Input, "")
                .find("two columns are named p_RS_R_x"),
            std::string::npos);
}

TEST_F(EurocFiles, WhatIsNoStateIsRefused) {
  const auto refusal = [&](const std::string& text, const std::string& keys = "") {
    return refused("euroc", keys, text, core::ErrorKind::Input, "");
  };
  EXPECT_NE(refusal("#timestamp [ns],w_RS_S_x [rad s^-1]\n1,2\n").find("p_RS_R_x"),
            std::string::npos);
  EXPECT_NE(refusal(std::string(kHeader) + "1.5,1,2,3,1,0,0,0,3,4,5\n").find("line 2"),
            std::string::npos);
  EXPECT_NE(refusal(std::string(kHeader) + "1,1,2,3,2,0,0,0,3,4,5\n").find("length 2.0000"),
            std::string::npos);
  EXPECT_NE(refusal(std::string(kHeader) + "9200000000000000000,1,2,3,1,0,0,0,3,4,5\n",
                    "unix_times = true")
                .find("unix_times = false"),
            std::string::npos);
}

}  // namespace
}  // namespace terracast::geo
