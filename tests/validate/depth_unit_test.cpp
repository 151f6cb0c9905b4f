#include <gtest/gtest.h>

#include <cmath>

#include "core/json.h"
#include "core/log.h"
#include "tests/support/test_data.h"
#include "tests/validate/analytic_dataset.h"
#include "validate/check.h"

/// Depth by which no two images share a place: wrong where another factor brings the colours
/// together, right where the frames are that far apart.
namespace terracast::validate {
namespace {

struct Report {
  CheckResult depth_unit;
  core::Json causes;
};

Report validate(const test::Recording& recording) {
  const test::ScratchFolder scratch;
  test::write_colmap(recording, scratch / "data");
  const core::Log log("validate", core::LogLevel::Off);
  Report report;
  for (const CheckResult& result :
       run_validate_stage(scratch / "data", {}, scratch / "report", {log}))
    if (result.name == "depth_unit") report.depth_unit = result;
  EXPECT_EQ(report.depth_unit.name, "depth_unit");
  report.causes = core::Json::read(scratch / "report/report.json").at("causes");
  return report;
}

CheckResult depth_unit_of(const test::Recording& recording) {
  return validate(recording).depth_unit;
}

/// The first frame and the last.
test::Recording ends_of(test::Recording recording) {
  const auto cut = [](auto& list) { list.erase(list.begin() + 1, list.end() - 1); };
  cut(recording.world_from_body);
  cut(recording.body_world);
  cut(recording.color[0]);
  cut(recording.depth[0]);
  cut(recording.classes[0]);
  return recording;
}

TEST(DepthUnit, FindsAnyFactorByWhichNothingIsShared) {
  for (const double factor : {1.0 / 137.0, 1.0 / 8000.0, 0.02}) {
    test::Recording recording = test::record_flight({test::colmap_cameras()[0]}, 4);
    for (auto& images : recording.depth)
      for (auto& depth : images)
        for (double& value : depth.data()) value *= factor;
    const Report report = validate(recording);
    const CheckResult& result = report.depth_unit;
    EXPECT_FALSE(result.ok) << factor;
    // What no other place looks like stands out by more than half.
    EXPECT_GT(result.value, 0.5) << factor;
    const std::string words = "with depth ";
    const std::size_t at = result.worst.find(words);
    ASSERT_NE(at, std::string::npos) << result.worst;
    // Steps are at most 3 % apart.
    EXPECT_NEAR(std::atof(result.worst.c_str() + at + words.size()) * factor, 1.0, 0.03)
        << result.worst;
    bool is_named = false;
    for (std::size_t i = 0; i < report.causes.size(); ++i)
      is_named =
          is_named || (report.causes.at(i).at("name").string() == "depth_unit" &&
                       std::abs(report.causes.at(i).at("size").number() / factor - 1.0) < 0.04);
    EXPECT_TRUE(is_named) << report.causes.text();
  }
}

TEST(DepthUnit, HoldsWhereFramesShareTheGround) {
  const CheckResult result = depth_unit_of(test::record_flight(test::colmap_cameras(), 3));
  EXPECT_TRUE(result.ok);
  EXPECT_TRUE(result.summary.starts_with("0 of 12 pairs")) << result.summary;
}

// Turned by 80 degrees and more from frame to frame: no distance brings anything together.
TEST(DepthUnit, IsUnseenWhereFramesLookElsewhere) {
  const CheckResult result =
      depth_unit_of(test::record_flight(test::colmap_cameras(), 3, test::Ground::Smooth, 16));
  EXPECT_TRUE(result.is_unseen) << result.summary;
}

// Straight on, looking down: the patches of one stand somewhere in the other at many distances.
TEST(DepthUnit, HoldsWhereFramesOfAStraightFlightAreFarApart) {
  for (const int num_frames : {18, 21, 24}) {
    test::SceneCamera down = test::colmap_cameras()[0];
    down.focal_px *= 3.0;
    down.body_from_camera *= Eigen::AngleAxisd(-0.7, Eigen::Vector3d::UnitX()).toRotationMatrix();
    const CheckResult result = depth_unit_of(
        ends_of(test::record_island_flight({down}, num_frames, test::Path::Straight)));
    EXPECT_TRUE(result.ok) << result.worst;
    EXPECT_FALSE(result.skipped) << result.worst;
    EXPECT_TRUE(result.summary.starts_with("2 of 2 pairs")) << result.summary;
    EXPECT_EQ(result.value, 0.0) << result.worst;  // nowhere do they agree
  }
}

// What goes along with the camera, as the sun in smooth water: frames that share no place look alike
// wherever one is laid on the other, which tells nothing of depth.
TEST(DepthUnit, IsUnseenWhereColoursGoAlongWithTheCamera) {
  test::SceneCamera down = test::colmap_cameras()[0];
  down.focal_px *= 3.0;
  down.body_from_camera *= Eigen::AngleAxisd(-0.7, Eigen::Vector3d::UnitX()).toRotationMatrix();
  test::Recording recording = ends_of(test::record_island_flight({down}, 18, test::Path::Straight));
  ASSERT_TRUE(depth_unit_of(recording).summary.starts_with("2 of 2 pairs"));
  for (core::Image8& image : recording.color[0])
    for (int y = 0; y < image.height(); ++y)
      for (int x = 0; x < image.width(); ++x) {
        const double across = (x - 0.5 * image.width()) / (0.3 * image.width());
        const double along = (y - 0.5 * image.height()) / (0.3 * image.height());
        const double glow = std::exp(-across * across - along * along);
        for (int k = 0; k < image.channels(); ++k)
          image(x, y, k) = static_cast<std::uint8_t>(std::lround(30.0 + 200.0 * glow));
      }
  const CheckResult result = depth_unit_of(recording);
  EXPECT_TRUE(result.is_unseen) << result.summary;
}

}  // namespace
}  // namespace terracast::validate
