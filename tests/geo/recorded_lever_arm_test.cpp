// Lever arms of recordings: from the recorded point to the body's, and what they must not change.

#include <gtest/gtest.h>

#include <fstream>
#include <numbers>

#include "core/toml_reader.h"
#include "geo/fixes/placing.h"
#include "geo/fixes/recording.h"
#include "tests/geo/trajectory_support.h"
#include "tests/support/test_data.h"

namespace terracast::geo {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

class LeverArms : public testing::Test {
 protected:
  /// Rows of time_s,x,y,z,yaw,pitch,roll in metres and degrees about the world's origin, 100 m up.
  std::string config(const std::string& rows, const std::string& keys) {
    const std::filesystem::path file = scratch_ / "fixes.csv";
    std::ofstream(file) << "time_s,x,y,z,yaw,pitch,roll\n" << rows;
    return fmt::format(R"(
file = "{}"
format = "csv"
frame = "local"
place_columns = ["x", "y", "z"]
attitude_columns = ["yaw", "pitch", "roll"]
attitude_axes = "flu"
attitude_frame = "local"
sigma_attitude_deg = 0.0
origin = {{ lat_deg = 42.5, lon_deg = 1.5, height_m = 100.0 }}
{})",
                       file.string(), keys);
  }
  Recording read(const std::string& rows, const std::string& keys) {
    RecordingOptions options;
    core::TomlDocument::parse(config(rows, keys), "test.toml").read(options);
    return read_recording(options, world_.context());
  }

  terracast::test::ScratchFolder scratch_;
  test::GroundWorld world_;
};

TEST_F(LeverArms, LeadAlongTheBodysAxesOfEachRow) {
  // x is east and y north; the rotation is about z, then y, then x. Row 20 states no attitude.
  std::string rows;
  for (int i = 0; i <= 40; ++i)
    rows += fmt::format("{0},{1},0,0,{2}\n", i, 20 * i, i == 20 ? ",," : "30,10,-20");
  const std::string arm = "lever_arm_m = [2.0, -3.0, 0.5]\n";
  const Recording recording = read(rows, arm);
  EXPECT_EQ(recording.num_without_attitude, 1u);
  ASSERT_EQ(recording.parts.size(), 1u);
  EXPECT_EQ(recording.parts[0].num_fixes, 40u);
  const std::string kind = "kind = \"recorded\"\n";
  const auto plain = test::trajectory_from(kind + config(rows, ""), world_);
  const auto moved = test::trajectory_from(kind + config(rows, arm), world_);
  const Eigen::Quaterniond world_from_body =
      Eigen::AngleAxisd(30.0 * kDegree, Eigen::Vector3d::UnitZ()) *
      Eigen::AngleAxisd(10.0 * kDegree, Eigen::Vector3d::UnitY()) *
      Eigen::AngleAxisd(-20.0 * kDegree, Eigen::Vector3d::UnitX());
  const Eigen::Vector3d expected = world_from_body * Eigen::Vector3d(2.0, -3.0, 0.5);
  for (const double time_s : {0.0, 7.0, 20.0, 33.3}) {
    const Eigen::Vector3d way = moved->at(time_s).world_from_body.translation -
                                plain->at(time_s).world_from_body.translation;
    EXPECT_LT((way - expected).norm(), 1e-6) << time_s << ": " << way.transpose();
  }
}

// 50 rows a second, of which ten hold a place, while the body turns.
TEST_F(LeverArms, PlacesThatAreHeldStayHeld) {
  std::string rows;
  for (int i = 0; i < 500; ++i)
    rows += fmt::format("{},{},0,0,{},0,0\n", 0.02 * i, 3 * (i / 10), 0.2 * i);
  const Recording plain = read(rows, ""), moved = read(rows, "lever_arm_m = [1.0, 0.0, 0.0]\n");
  EXPECT_EQ(plain.dropped.num_repeated, 450u);
  EXPECT_EQ(moved.dropped.num_repeated, 450u);
  ASSERT_EQ(moved.parts.size(), 1u);
  EXPECT_EQ(moved.parts[0].num_fixes, 50u);
}

TEST_F(LeverArms, FixesInAGapOfTheAttitudesAreLeftOut) {
  FixTable table;
  table.frame = FixFrame::Local;
  table.attitude_frame = AttitudeFrame::Local;
  for (int i = 0; i <= 100; ++i) {
    Fix fix;
    fix.time_s = i;
    fix.place = {20.0 * i, 0.0, 100.0};
    table.fixes.push_back(fix);
    if (i <= 20 || i >= 60) table.attitudes.push_back({fix.time_s, Eigen::Quaterniond::Identity()});
  }
  PlacingOptions options;
  options.origin.east_m = options.origin.north_m = 0.0;
  options.lever_arm_m = {1.0, 0.0, 0.0};
  EXPECT_EQ(place_fixes(table, options, "", 5.0, world_.context()).num_without_attitude, 39u);
  EXPECT_EQ(place_fixes(table, options, "", 50.0, world_.context()).num_without_attitude, 0u);
}

}  // namespace
}  // namespace terracast::geo
