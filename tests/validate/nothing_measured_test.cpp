#include <gtest/gtest.h>

#include <map>

#include "core/log.h"
#include "tests/support/test_data.h"
#include "tests/validate/analytic_dataset.h"
#include "validate/checks/checker.h"

/// A result that measured nothing is never right: it is unseen, and says so.
namespace terracast::validate {
namespace {

using Results = std::map<std::string, CheckResult>;

Results finish(const std::string& check, const Sequence& sequence) {
  Results results;
  for (const CheckInfo& info : checks())
    if (info.name == check)
      for (const CheckResult& result : info.make({})->finish({}, sequence))
        results[result.name] = result;
  return results;
}

Camera camera_at(const std::string& name, const std::vector<std::optional<Pose>>& poses) {
  Camera camera;
  camera.name = name;
  camera.intrinsics = {64, 48, 50.0, 50.0, 32.0, 24.0};
  camera.stated = camera.intrinsics;
  camera.body_from_camera = Pose{};
  camera.local_from_camera = poses;
  camera.bounds.resize(poses.size());
  camera.files.resize(poses.size());
  return camera;
}

Pose place(double x_m) { return {Eigen::Matrix3d::Identity(), {x_m, 0.0, 0.0}}; }

TEST(NothingMeasured, JumpsNeedFiveFramesAndTurnsThree) {
  for (const int num_frames : {1, 2, 3, 4, 5}) {
    Sequence sequence;
    std::vector<std::optional<Pose>> poses;
    for (int i = 0; i < num_frames; ++i) poses.emplace_back(place(i));
    sequence.cameras.push_back(camera_at("cam0", poses));
    const Results results = finish("trajectory", sequence);
    EXPECT_FALSE(results.at("trajectory_rotations").skipped);
    EXPECT_EQ(results.at("trajectory_jumps").is_unseen, num_frames < 5);
    EXPECT_EQ(results.at("trajectory_turns").is_unseen, num_frames < 3);
    for (const char* name : {"trajectory_jumps", "trajectory_turns"})
      EXPECT_TRUE(results.at(name).ok) << name;
  }
}

TEST(NothingMeasured, NeighboursThatLookApartHaveNoMiddle) {
  Sequence sequence;
  std::vector<std::optional<Pose>> poses;
  for (int i = 0; i < 3; ++i) {
    poses.emplace_back(place(i));
    poses.back()->rotation =
        Eigen::AngleAxisd(radians_from_degrees(80.0 * i), Eigen::Vector3d::UnitZ())
            .toRotationMatrix();
  }
  sequence.cameras.push_back(camera_at("cam0", poses));
  const Results results = finish("trajectory", sequence);
  EXPECT_FALSE(results.at("trajectory_rotations").skipped);
  EXPECT_TRUE(results.at("trajectory_turns").is_unseen);
}

TEST(NothingMeasured, MountsNeedTwoCamerasWithPosesOfOneFrame) {
  Sequence sequence;
  sequence.cameras.push_back(camera_at("cam0", {place(0.0), std::nullopt}));
  for (const char* name : {"calibration_rotation", "calibration_position"}) {
    const CheckResult alone = finish("calibration", sequence).at(name);
    EXPECT_TRUE(alone.skipped && !alone.is_unseen) << name;
  }
  sequence.cameras.push_back(camera_at("cam1", {std::nullopt, place(0.0)}));
  Results results = finish("calibration", sequence);
  EXPECT_FALSE(results.at("calibration_intrinsics").skipped);
  for (const char* name : {"calibration_rotation", "calibration_position"})
    EXPECT_TRUE(results.at(name).is_unseen) << name;
  sequence.cameras[1].local_from_camera[0] = place(0.0);
  results = finish("calibration", sequence);
  for (const char* name : {"calibration_rotation", "calibration_position"})
    EXPECT_FALSE(results.at(name).skipped) << name;
}

TEST(NothingMeasured, AModelWithoutObservationsHasNoColoursAndNoDepths) {
  Sequence sequence;
  sequence.cameras.push_back(camera_at("cam0", {place(0.0)}));
  sequence.binary_model.emplace();
  sequence.text_model.emplace();
  Results results = finish("colmap_model", sequence);
  EXPECT_TRUE(results.at("colmap_color").is_unseen);
  for (const char* name : {"colmap_depth", "colmap_depth_residual"}) {
    EXPECT_TRUE(results.at(name).skipped && !results.at(name).is_unseen) << name;
  }
  sequence.cameras[0].files[0].depth = "depth/cam0/000000.npy";
  results = finish("colmap_model", sequence);
  EXPECT_TRUE(results.at("colmap_depth").is_unseen);  // nor do two images share ground
  EXPECT_TRUE(results.at("colmap_depth_residual").is_unseen);
}

// A dataset does not say how many points were asked for.
TEST(NothingMeasured, ColmapModelsOfFewPointsAreNotJudgedByTheirNumber) {
  Sequence sequence;
  sequence.cameras.push_back(camera_at("cam0", {place(0.0)}));
  ColmapModel& model = sequence.binary_model.emplace();
  for (std::uint32_t i = 1; i <= 3; ++i) model.images[i].name = fmt::format("cam0/{:06}.png", i);
  sequence.text_model = model;
  const auto points_of = [&](std::int64_t count) {
    for (std::int64_t i = 0; i < count; ++i) sequence.binary_model->points[i];
    return finish("colmap_model", sequence).at("colmap_points");
  };
  // Nor whether any of those were seen by two of these images.
  CheckResult points = points_of(0);
  EXPECT_TRUE(points.ok && points.is_unseen) << points.worst;
  EXPECT_NE(points.worst.find("tracks.num_points"), std::string::npos) << points.worst;
  for (const std::int64_t count : {1, 149}) {  // of 50 for each of three images
    points = points_of(count);
    EXPECT_TRUE(points.ok && points.is_unseen && points.skipped) << count;
    EXPECT_EQ(points.value, static_cast<double>(count));
    EXPECT_NE(points.worst.find(fmt::format("{} points for 3 images", count)), std::string::npos)
        << points.worst;
    EXPECT_NE(points.worst.find("raise tracks.num_points"), std::string::npos) << points.worst;
  }
  points = points_of(150);
  EXPECT_TRUE(points.ok && !points.skipped && !points.is_unseen);
  EXPECT_EQ(points.worst, "");
  EXPECT_TRUE(finish("colmap_model", sequence).at("colmap_complete_tracks").is_unseen);
}

/// Two frames of which the second looks the other way, with flow of one value and masks.
Results flow_of(float value, std::uint8_t in_view) {
  Dataset dataset;
  Sequence sequence;
  sequence.num_frames = 2;
  const Pose away{Eigen::AngleAxisd(kPi, Eigen::Vector3d::UnitY()).toRotationMatrix(),
                  Eigen::Vector3d::Zero()};
  sequence.cameras.push_back(camera_at("cam0", {place(0.0), away}));
  LoadedImage image;
  image.depth = core::ImageF(64, 48, 1, 10.0F);
  FlowFields flow;
  flow.forward = core::ImageF(64, 48, 2, value);
  flow.in_view_forward = core::Image8(64, 48, 1, in_view);
  flow.covisible_forward = core::Image8(64, 48, 1, 0);
  image.flow = std::make_shared<const FlowFields>(flow);
  const auto shared = std::make_shared<const LoadedImage>(image);
  const std::vector<FrameImages> images = {{shared}, {shared}};
  Results results;
  for (const CheckInfo& info : checks()) {
    if (info.name != "flow") continue;
    Findings findings;
    FrameWindow window(dataset, sequence, findings, images);
    const auto checker = info.make({});
    while (window.advance()) checker->frame(window, {});
    for (const CheckResult& result : checker->finish(dataset, sequence))
      results[result.name] = result;
  }
  return results;
}

TEST(NothingMeasured, FlowOfPointsBehindTheOtherCameraIsUnseenAndItsMasksAreJudged) {
  Results results = flow_of(0.0F, 0);
  EXPECT_TRUE(results.at("flow").is_unseen);
  EXPECT_TRUE(results.at("flow_covisible").is_unseen);
  EXPECT_TRUE(results.at("flow_masks").ok && !results.at("flow_masks").skipped);
  results = flow_of(0.0F, 1);
  EXPECT_FALSE(results.at("flow_masks").ok);
  results = flow_of(std::numeric_limits<float>::quiet_NaN(), 0);
  EXPECT_TRUE(results.at("flow").is_unseen);
  EXPECT_FALSE(results.at("flow_masks").ok);
}

// One or two frames show little, and fail nothing.
TEST(NothingMeasured, DatasetsOfOneOrTwoFramesPass) {
  const core::Log log("validate", core::LogLevel::Off);
  for (const int num_frames : {1, 2}) {
    const test::ScratchFolder scratch;
    test::write_kitti(test::record_flight(test::kitti_cameras(), num_frames), scratch / "kitti");
    test::write_tartanair(test::record_flight(test::tartanair_cameras(), num_frames),
                          scratch / "tartanair");
    for (const char* format : {"kitti", "tartanair"})
      for (const CheckResult& result :
           run_validate_stage(scratch / format, {}, scratch / "report", {log})) {
        EXPECT_TRUE(result.ok) << format << ", " << num_frames << " frames: " << result.name << " "
                               << result.value << " " << result.worst;
        if (result.name == "trajectory_jumps" || result.name == "trajectory_turns") {
          EXPECT_TRUE(result.is_unseen) << result.name;
        }
      }
  }
}

}  // namespace
}  // namespace terracast::validate
