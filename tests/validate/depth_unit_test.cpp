#include <gtest/gtest.h>

#include "core/log.h"
#include "tests/support/test_data.h"
#include "tests/validate/analytic_dataset.h"
#include "validate/check.h"

/// Depth by which no two images share a place: wrong where another factor brings the colours
/// together, right where the frames are that far apart.
namespace terracast::validate {
namespace {

CheckResult depth_unit_of(const test::Recording& recording) {
  const test::ScratchFolder scratch;
  test::write_colmap(recording, scratch / "data");
  const core::Log log("validate", core::LogLevel::Off);
  for (const CheckResult& result :
       run_validate_stage(scratch / "data", {}, scratch / "report", {log}))
    if (result.name == "depth_unit") return result;
  ADD_FAILURE() << "no result depth_unit";
  return {};
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
  for (const double factor : {1.0 / 137.0, 1e-3, 0.02}) {
    test::Recording recording = test::record_flight(test::colmap_cameras(), 4);
    for (auto& images : recording.depth)
      for (auto& depth : images)
        for (double& value : depth.data()) value *= factor;
    const CheckResult result = depth_unit_of(recording);
    EXPECT_FALSE(result.ok) << factor;
    EXPECT_GT(result.value, 0.9) << factor;
    const std::string words = "with depth ";
    const std::size_t at = result.worst.find(words);
    ASSERT_NE(at, std::string::npos) << result.worst;
    // Steps are at most 3 % apart.
    EXPECT_NEAR(std::atof(result.worst.c_str() + at + words.size()) * factor, 1.0, 0.03)
        << result.worst;
  }
}

TEST(DepthUnit, HoldsWhereFramesShareTheGround) {
  const CheckResult result = depth_unit_of(test::record_flight(test::colmap_cameras(), 3));
  EXPECT_TRUE(result.ok);
  EXPECT_TRUE(result.summary.starts_with("0 of 12 pairs")) << result.summary;
}

TEST(DepthUnit, HoldsWhereFramesAreSoFarApartThatTheyShareNone) {
  // Turned by 80 degrees and more from frame to frame.
  const CheckResult turned =
      depth_unit_of(test::record_flight(test::colmap_cameras(), 3, test::Ground::Smooth, 16));
  EXPECT_TRUE(turned.ok) << turned.worst;
  EXPECT_TRUE(turned.summary.starts_with("12 of 12 pairs")) << turned.summary;
  // Straight on, looking down: patches of one stand in the other at many distances.
  constexpr int kFrames = 20;
  test::SceneCamera down = test::colmap_cameras()[0];
  down.focal_px *= 3.0;
  down.body_from_camera *= Eigen::AngleAxisd(-0.7, Eigen::Vector3d::UnitX()).toRotationMatrix();
  const CheckResult apart =
      depth_unit_of(ends_of(test::record_island_flight({down}, kFrames, test::Path::Straight)));
  EXPECT_TRUE(apart.ok) << apart.worst;
  EXPECT_TRUE(apart.summary.starts_with("2 of 2 pairs")) << apart.summary;
  EXPECT_GT(apart.value, 0.0);
  EXPECT_LT(apart.value, 0.5) << apart.worst;
}

}  // namespace
}  // namespace terracast::validate
