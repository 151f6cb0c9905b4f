#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "core/error.h"
#include "tests/support/test_data.h"
#include "tests/validate/evaluate/wall_flight.h"

/// Scene flow before a wall: the camera moves by t, so that every point moves by -t in its frame.
namespace terracast::validate {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;
using test::evaluate;
using test::figure;
using test::ScratchFolder;

// f b = 65 px m: 32.5 m are 2 px of disparity now and, 16.25 m nearer, 4 px then.
constexpr double kDepth_m = 32.5;
const Vector3d kStep(0.5, 0.25, 16.25);

class EvaluateSceneFlow : public testing::Test {
 protected:
  void SetUp() override { test::write_kitti(test::wall_flight(2, kDepth_m, kStep), truth()); }
  fs::path truth() const { return scratch_ / "truth"; }
  EvaluateOptions options() const {
    // A wall that comes so near leaves the image: its flow is still its truth.
    return {.task = "scene-flow", .truth = truth()};
  }
  /// Options with motions of -t and an error.
  EvaluateOptions with_motion(const Vector3d& error) const {
    const fs::path folder =
        scratch_ / fmt::format("motion_{}_{}_{}", error.x(), error.y(), error.z());
    std::vector<double> motion;
    for (int i = 0; i < test::kWallWidth * test::kWallHeight; ++i)
      for (int c = 0; c < 3; ++c) motion.push_back(-kStep[c] + error[c]);
    core::write_file(folder / "000000.npy", test::npy_text("72, 96, 3", motion));
    EvaluateOptions own = options();
    own.result = folder;
    return own;
  }
  void write_disparity(const fs::path& file, double disparity_px) const {
    cv::Mat png(test::kWallHeight, test::kWallWidth, CV_16UC1, cv::Scalar(256.0 * disparity_px));
    fs::create_directories(file.parent_path());
    ASSERT_TRUE(cv::imwrite(file.string(), png));
  }
  void write_true_flow() const {
    test::write_flo(scratch_ / "flow/000000.flo", test::flow_of_pixels([](int x, int y) {
                      return test::wall_flow(x, y, kDepth_m, kStep);
                    }));
  }
  ScratchFolder scratch_;
};

TEST_F(EvaluateSceneFlow, MotionAgainstTheCameraHasNoError) {
  const Evaluation evaluation = evaluate(with_motion({0.0, 0.0, 0.0}));
  EXPECT_LT(figure(evaluation, "EPE3D"), 2e-6);  // float32 of 16 m
  EXPECT_EQ(figure(evaluation, "d3D<5m"), 100.0);
  EXPECT_EQ(figure(evaluation, "d3D<10m"), 100.0);
  // There is no flow to measure.
  EXPECT_FALSE(evaluation.rows.back().values[0].has_value());
  EXPECT_FALSE(evaluation.rows.back().values[1].has_value());
  EXPECT_EQ(evaluation.rows.back().num_frames, 1);
}

TEST_F(EvaluateSceneFlow, AConstantErrorIsItsLength) {
  const Evaluation three = evaluate(with_motion({1.0, -2.0, 2.0}));
  EXPECT_NEAR(figure(three, "EPE3D"), 3.0, 2e-6);
  EXPECT_EQ(figure(three, "d3D<5m"), 100.0);
  const Evaluation seven = evaluate(with_motion({2.0, 3.0, -6.0}));
  EXPECT_NEAR(figure(seven, "EPE3D"), 7.0, 2e-6);
  EXPECT_EQ(figure(seven, "d3D<5m"), 0.0);
  EXPECT_EQ(figure(seven, "d3D<10m"), 100.0);
  EXPECT_EQ(figure(evaluate(with_motion({10.001, 0.0, 0.0})), "d3D<10m"), 0.0);
}

TEST_F(EvaluateSceneFlow, FlowAndDisparityOfBothMomentsAreTheSameMotion) {
  write_true_flow();
  write_disparity(scratch_ / "now/000000.png", 2.0);
  write_disparity(scratch_ / "then/000000.png", 4.0);
  EvaluateOptions own = options();
  own.flow = scratch_ / "flow";
  own.disparity = scratch_ / "now";
  own.disparity_next = scratch_ / "then";
  const Evaluation evaluation = evaluate(own);
  EXPECT_LT(figure(evaluation, "EPE2D"), 1e-5);  // flow of up to 60 px in float32
  EXPECT_EQ(figure(evaluation, "F1-all"), 0.0);
  EXPECT_LT(figure(evaluation, "EPE3D"), 1e-5);
  EXPECT_EQ(evaluation.rows.back().num_answered, evaluation.rows.back().num_truth);
  // The next disparity twice as large: all points at half the depth then.
  write_disparity(scratch_ / "then/000000.png", 8.0);
  long double sum = 0.0L;
  for (int y = 0; y < test::kWallHeight; ++y)
    for (int x = 0; x < test::kWallWidth; ++x) {
      const Vector2d at =
          test::wall_flow(x, y, kDepth_m, kStep) + Vector2d(x + 0.5 - 48.0, y + 0.5 - 36.0);
      const Vector3d ray(at.x() / test::kWallFocal_px, at.y() / test::kWallFocal_px, 1.0);
      sum += static_cast<long double>((8.125 * ray).norm());
    }
  EXPECT_NEAR(figure(evaluate(own), "EPE3D"),
              static_cast<double>(sum) / (test::kWallWidth * test::kWallHeight), 1e-5);
}

TEST_F(EvaluateSceneFlow, TheNextDisparityIsLookedUpAlongTheFlow) {
  write_true_flow();
  write_disparity(scratch_ / "disparity/000000.png", 2.0);
  write_disparity(scratch_ / "disparity/000001.png", 4.0);
  EvaluateOptions own = options();
  own.flow = scratch_ / "flow";
  own.disparity = scratch_ / "disparity";
  const Evaluation evaluation = evaluate(own);
  EXPECT_LT(figure(evaluation, "EPE3D"), 1e-5);
  // Points that leave the next image have no answer: those beyond the outer pixels' centres.
  std::int64_t num_within = 0;
  for (int y = 0; y < test::kWallHeight; ++y)
    for (int x = 0; x < test::kWallWidth; ++x) {
      const Vector2d at = test::wall_flow(x, y, kDepth_m, kStep) + Vector2d(x, y);
      num_within += at.x() >= 0.0 && at.y() >= 0.0 && at.x() <= test::kWallWidth - 1 &&
                            at.y() <= test::kWallHeight - 1
                        ? 1
                        : 0;
    }
  EXPECT_EQ(evaluation.rows.back().num_answered, num_within);
  EXPECT_EQ(evaluation.rows.back().num_truth, test::kWallWidth * test::kWallHeight);
  EXPECT_NEAR(figure(evaluation, "d3D<5m"),
              100.0 * static_cast<double>(num_within) / (test::kWallWidth * test::kWallHeight),
              1e-9);
  EXPECT_EQ(figure(evaluation, "F1-all"), 0.0);
  // Without the next frame's disparity the frame is missing.
  fs::remove(scratch_ / "disparity/000001.png");
  EXPECT_THROW(evaluate(own), core::Error);
}

/// A turning flight: the motion of each pixel's point in long double from the tests' own scene.
TEST(EvaluateSceneFlowOfHills, IsWhatBruteForceSays) {
  const ScratchFolder scratch;
  const test::Recording flight = test::record_flight(test::kitti_cameras(), 2);
  test::write_kitti(flight, scratch / "truth");
  const test::SceneCamera& camera = flight.cameras[0];
  std::vector<float> result;
  std::mt19937 random(5);
  std::uniform_real_distribution<float> drawn(-5.0F, 5.0F);
  long double sum = 0.0L;
  std::int64_t count = 0, num_under_5 = 0;
  using Vector3l = Eigen::Matrix<long double, 3, 1>;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const auto depth = static_cast<long double>(static_cast<float>(flight.depth[0][0](x, y)));
      const long double f = camera.focal_px;
      const Vector3l now = depth * Vector3l((x + 0.5L - camera.width / 2.0L) / f,
                                            (y + 0.5L - camera.height / 2.0L) / f, 1.0L);
      const Vector3l world =
          flight.rotation(0, 0).cast<long double>() * now + flight.centre(0, 0).cast<long double>();
      const Vector3l then = flight.rotation(0, 1).cast<long double>().transpose() *
                            (world - flight.centre(0, 1).cast<long double>());
      // Off by up to 5 m along each axis: lengths on both sides of both bounds.
      Vector3l says;
      for (int c = 0; c < 3; ++c) {
        result.push_back(static_cast<float>(then[c] - now[c]) + drawn(random));
        says[c] = result.back();
      }
      const long double error = (says - (then - now)).norm();
      sum += error;
      num_under_5 += error < 5.0L ? 1 : 0;
      ++count;
    }
  core::write_file(scratch / "result/000000.npy", test::npy_text("128, 160, 3", result));
  const Evaluation evaluation = evaluate({.task = "scene-flow",
                                          .truth = scratch / "truth",
                                          .result = scratch / "result",
                                          .max_depth_m = 0.0});
  EXPECT_EQ(evaluation.rows.back().num_truth, count);
  ASSERT_GT(num_under_5, count / 10);
  ASSERT_LT(num_under_5, count);
  // Poses of 12 digits and places of 1e-6 m, 100 m away.
  EXPECT_NEAR(figure(evaluation, "EPE3D"), static_cast<double>(sum / count), 1e-5);
  EXPECT_NEAR(figure(evaluation, "d3D<5m"),
              100.0 * static_cast<double>(num_under_5) / static_cast<double>(count), 0.02);
}

/// A thing that moves: its stored flow is not that of a point at rest.
TEST(EvaluateStoredSceneFlow, LeavesOutWhatMovesAndSaysSo) {
  const ScratchFolder scratch;
  test::Recording recording;
  recording.cameras = test::tartanair_v1_cameras();
  const Vector3d step(1.0, 0.0, 0.0);
  for (int frame = 0; frame < 2; ++frame) {
    recording.body_world.emplace_back(recording.cameras[0].body_from_camera * step * frame);
    recording.world_from_body.push_back(Eigen::Matrix3d::Identity());
  }
  recording.color.assign(2, {2, core::Image8(640, 480, 3, 100)});
  recording.depth.assign(2, {2, core::Image<double>(640, 480, 1, 80.0)});
  test::write_tartanair_v1(recording, scratch / "truth");
  std::vector<float> motion(std::size_t{640} * 480 * 3, 0.0F);
  for (std::size_t i = 0; i < motion.size(); i += 3) motion[i] = -1.0F;
  core::write_file(scratch / "result/000000.npy", test::npy_text("480, 640, 3", motion));
  const EvaluateOptions own{
      .task = "scene-flow", .truth = scratch / "truth", .result = scratch / "result"};
  EXPECT_LT(figure(evaluate(own), "EPE3D"), 1e-6);
  EXPECT_EQ(evaluate(own).rows.back().num_truth, 640 * 480);
  // The last pixel's v by 0.5 px, that of the one before by 0.01 px, which is none.
  const fs::path stored = scratch / "truth/Hills/Easy/P000/flow/000000_000001_flow.npy";
  std::string text = core::read_text_file(stored);
  const auto shift = [&](std::size_t from_end, float by) {
    float value = 0.0F;
    std::memcpy(&value, text.data() + text.size() - from_end, 4);
    value += by;
    std::memcpy(text.data() + text.size() - from_end, &value, 4);
  };
  shift(4, 0.5F);
  shift(12, 0.01F);
  core::write_file(stored, text);
  const Evaluation evaluation = evaluate(own);
  EXPECT_EQ(evaluation.rows.back().num_truth, 640 * 480 - 1);
  EXPECT_THAT(test::notes_of(evaluation), testing::HasSubstr("1 pixels of things that move"));
}

TEST_F(EvaluateSceneFlow, ADatasetWithoutAPairTakesNoDisparity) {
  const ScratchFolder scratch;
  test::Recording recording = test::wall_flight(2, kDepth_m, kStep);
  test::write_colmap(recording, scratch / "truth");
  write_true_flow();
  write_disparity(scratch_ / "disparity/000000.png", 2.0);
  write_disparity(scratch_ / "disparity/000001.png", 4.0);
  EvaluateOptions own = options();
  own.truth = scratch / "truth";
  own.flow = scratch_ / "flow";
  own.disparity = scratch_ / "disparity";
  EXPECT_THROW(evaluate(own), core::Error);
}

}  // namespace
}  // namespace terracast::validate
