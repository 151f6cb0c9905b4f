#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "core/error.h"
#include "tests/support/test_data.h"
#include "tests/validate/evaluate/wall_flight.h"
#include "validate/evaluate/measures.h"

/// Optical flow against a wall whose flow is known in closed form, and against values worked by
/// hand.
namespace terracast::validate {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;
using test::evaluate;
using test::figure;
using test::ScratchFolder;
using testing::HasSubstr;

constexpr double kDepth_m = 65.0;
const Vector3d kStep(1.0, -0.5, 2.0);

/// A result of three frames (two flows): the closed form and an error.
void write_result(const fs::path& folder, const Vector2d& error, const Vector3d& step = kStep) {
  for (int frame = 0; frame < 2; ++frame)
    test::write_flo(folder / fmt::format("{:06}.flo", frame),
                    test::flow_of_pixels([&](int x, int y) {
                      return Vector2d(test::wall_flow(x, y, kDepth_m, step) + error);
                    }));
}

class EvaluateFlow : public testing::Test {
 protected:
  void SetUp() override { test::write_kitti(test::wall_flight(3, kDepth_m, kStep), truth()); }
  fs::path truth() const { return scratch_ / "truth"; }
  fs::path result() const { return scratch_ / "result"; }
  EvaluateOptions options() const { return {.task = "flow", .truth = truth(), .result = result()}; }
  ScratchFolder scratch_;
};

TEST_F(EvaluateFlow, TheClosedFormHasNoError) {
  write_result(result(), {0.0, 0.0});
  const Evaluation evaluation = evaluate(options());
  // Flow of a few px in float32, poses of 12 digits.
  EXPECT_LT(figure(evaluation, "EPE2D"), 1e-6);
  EXPECT_EQ(figure(evaluation, "F1-all"), 0.0);
  EXPECT_EQ(evaluation.rows.back().num_frames, 2);
  EXPECT_EQ(evaluation.rows.back().num_answered_frames, 2);
  EXPECT_EQ(evaluation.rows.back().num_truth, 2 * test::kWallWidth * test::kWallHeight);
  EXPECT_EQ(evaluation.rows.back().num_answered, evaluation.rows.back().num_truth);
}

TEST_F(EvaluateFlow, AConstantErrorIsItsLength) {
  write_result(result(), {3.0, 4.0});
  const Evaluation evaluation = evaluate(options());
  EXPECT_NEAR(figure(evaluation, "EPE2D"), 5.0, 1e-6);
  EXPECT_EQ(figure(evaluation, "F1-all"), 100.0);  // 5 px of under 10
}

TEST_F(EvaluateFlow, SmallErrorsAreNoOutliers) {
  write_result(result(), {0.0, 2.9});
  EXPECT_EQ(figure(evaluate(options()), "F1-all"), 0.0);
}

/// KITTI 2015's development kit: above 3 px and above 5 %, both exclusive.
TEST(FlowOutlier, BothBoundsAreExclusive) {
  const auto above = [](double value) { return std::nextafter(value, 1e9); };
  EXPECT_FALSE(is_flow_outlier(3.0, 1.0));
  EXPECT_TRUE(is_flow_outlier(above(3.0), 1.0));
  EXPECT_TRUE(is_flow_outlier(above(3.0), 0.0));
  EXPECT_FALSE(is_flow_outlier(4.0, 80.0));  // 5 % of 80 is 4
  EXPECT_TRUE(is_flow_outlier(4.0 + 1e-12, 80.0));
  EXPECT_FALSE(is_flow_outlier(10.0, 250.0));
  EXPECT_TRUE(is_flow_outlier(10.0, 199.0));
}

TEST_F(EvaluateFlow, AResultOfNothingIsAsWrongAsTheTruthIsLong) {
  for (int frame = 0; frame < 2; ++frame)
    test::write_flo(result() / fmt::format("{:06}.flo", frame),
                    test::flow_of_pixels([](int, int) { return Vector2d(0.0, 0.0); }));
  long double sum = 0.0L;
  int num_outliers = 0;
  for (int y = 0; y < test::kWallHeight; ++y)
    for (int x = 0; x < test::kWallWidth; ++x) {
      const Vector2d flow = test::wall_flow(x, y, kDepth_m, kStep);
      const long double length =
          std::hypot(static_cast<long double>(flow.x()), static_cast<long double>(flow.y()));
      sum += length;
      num_outliers += length > 3.0L ? 1 : 0;
    }
  const double num_pixels = test::kWallWidth * test::kWallHeight;
  const Evaluation evaluation = evaluate(options());
  EXPECT_NEAR(figure(evaluation, "EPE2D"), static_cast<double>(sum) / num_pixels, 1e-6);
  EXPECT_NEAR(figure(evaluation, "F1-all"), 100.0 * num_outliers / num_pixels, 1e-9);
}

/// A turning flight over hills: every pixel's flow in long double from the tests' own scene.
TEST(EvaluateFlowOfHills, IsWhatBruteForceSays) {
  const ScratchFolder scratch;
  const test::Recording flight = test::record_flight(test::kitti_cameras(), 2);
  test::write_kitti(flight, scratch / "truth");
  const test::SceneCamera& camera = flight.cameras[0];
  std::mt19937 random(7);
  std::uniform_real_distribution<float> drawn(-12.0F, 12.0F);
  std::vector<float> result;
  long double sum = 0.0L;
  std::int64_t num_judged = 0, num_outliers = 0;
  using Vector3l = Eigen::Matrix<long double, 3, 1>;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const float u = drawn(random), v = drawn(random);
      result.push_back(u);
      result.push_back(v);
      const auto depth = static_cast<long double>(static_cast<float>(flight.depth[0][0](x, y)));
      const long double f = camera.focal_px;
      const Vector3l ray((x + 0.5L - camera.width / 2.0L) / f,
                         (y + 0.5L - camera.height / 2.0L) / f, 1.0L);
      const Vector3l world = flight.rotation(0, 0).cast<long double>() * (ray * depth) +
                             flight.centre(0, 0).cast<long double>();
      const Vector3l there = flight.rotation(0, 1).cast<long double>().transpose() *
                             (world - flight.centre(0, 1).cast<long double>());
      const long double true_u = f * (there.x() / there.z() - ray.x());
      const long double true_v = f * (there.y() / there.z() - ray.y());
      if (depth >= 90.0L || std::hypot(true_u, true_v) >= 30.0L) continue;
      ++num_judged;
      const long double error = std::hypot(u - true_u, v - true_v);
      sum += error;
      num_outliers += error > 3.0L && error / std::hypot(true_u, true_v) > 0.05L ? 1 : 0;
    }
  core::write_file(scratch / "result/000000.flo",
                   test::flo_text(camera.width, camera.height, result));
  const Evaluation evaluation = evaluate({.task = "flow",
                                          .truth = scratch / "truth",
                                          .result = scratch / "result",
                                          .max_depth_m = 90.0,
                                          .max_flow_px = 30.0});
  ASSERT_GT(num_judged, 1000);
  ASSERT_LT(num_judged, camera.width * camera.height) << "the limits leave out nothing";
  EXPECT_EQ(evaluation.rows.back().num_truth, num_judged);
  // Truth in float32: 1e-6 px a pixel.
  EXPECT_NEAR(figure(evaluation, "EPE2D"), static_cast<double>(sum / num_judged), 1e-6);
  EXPECT_NEAR(figure(evaluation, "F1-all"),
              100.0 * static_cast<double>(num_outliers) / static_cast<double>(num_judged), 1e-9);
}

TEST_F(EvaluateFlow, DepthLimitIsExclusiveAndSkyNeverCounts) {
  write_result(result(), {0.0, 0.0});
  // Of the first frame: a pixel at the limit, one just below it, one of sky.
  std::vector<float> depths = test::plane(kDepth_m);
  depths[0] = 250.0F;
  depths[1] = std::nextafter(250.0F, 0.0F);
  depths[2] = 0.0F;
  test::write_plane_npy(truth() / "dataset/sequences/00/depth_2/000000.npy", depths);
  const std::int64_t all = 2 * test::kWallWidth * test::kWallHeight;
  EXPECT_EQ(evaluate(options()).rows.back().num_truth, all - 2);
  EvaluateOptions unlimited = options();
  unlimited.max_depth_m = 0.0;
  EXPECT_EQ(evaluate(unlimited).rows.back().num_truth, all - 1);
}

TEST_F(EvaluateFlow, FlowLimitIsExclusive) {
  // A pure shift to the left by exactly f t / Z = 2 px.
  const Vector3d step(1.0, 0.0, 0.0);
  test::write_kitti(test::wall_flight(3, kDepth_m, step), scratch_ / "shift");
  write_result(result(), {0.0, 0.0}, step);
  EvaluateOptions limited = options();
  limited.truth = scratch_ / "shift";
  limited.max_flow_px = 2.0 + 1e-5;  // the closed form's flow is 2 px to 1e-6
  EXPECT_EQ(evaluate(limited).rows.back().num_truth, 2 * test::kWallWidth * test::kWallHeight);
  limited.max_flow_px = 2.0 - 1e-5;
  EXPECT_THROW(
      {
        try {
          evaluate(limited);
        } catch (const core::Error& error) {
          EXPECT_EQ(error.kind(), core::ErrorKind::Input);
          EXPECT_THAT(error.message(), HasSubstr("nothing to score"));
          EXPECT_THAT(error.message(), HasSubstr("65 m away"));
          throw;
        }
      },
      core::Error);
}

TEST_F(EvaluateFlow, PixelsWithoutResultAreWrongOrLeftOutAndAlwaysCounted) {
  for (int frame = 0; frame < 2; ++frame) {
    std::vector<float> flow = test::flow_of_pixels(
        [](int x, int y) { return Vector2d(test::wall_flow(x, y, kDepth_m, kStep)); });
    // Middlebury's unknown in every second pixel.
    for (std::size_t i = 0; i < flow.size(); i += 4) flow[i] = flow[i + 1] = 1.7e9F;
    test::write_flo(result() / fmt::format("{:06}.flo", frame), flow);
  }
  const Evaluation wrong = evaluate(options());
  EXPECT_LT(figure(wrong, "EPE2D"), 1e-6);
  EXPECT_EQ(figure(wrong, "F1-all"), 50.0);
  EXPECT_EQ(2 * wrong.rows.back().num_answered, wrong.rows.back().num_truth);
  EvaluateOptions skipping = options();
  skipping.missing = MissingPixels::Skip;
  const Evaluation skipped = evaluate(skipping);
  EXPECT_EQ(figure(skipped, "F1-all"), 0.0);
  EXPECT_EQ(2 * skipped.rows.back().num_answered, skipped.rows.back().num_truth);
  EXPECT_THAT(table_text(skipped), HasSubstr("50.00 %"));
}

TEST_F(EvaluateFlow, AMissingFrameIsCountedAndNamed) {
  write_result(result(), {0.0, 0.0});
  fs::remove(result() / "000000.flo");
  const Evaluation evaluation = evaluate(options());
  EXPECT_EQ(evaluation.rows.back().num_frames, 2);
  EXPECT_EQ(evaluation.rows.back().num_answered_frames, 1);
  EXPECT_THAT(test::notes_of(evaluation), HasSubstr("1 of 2 frames are missing in the result"));
  EXPECT_THAT(table_text(evaluation), HasSubstr("1/2"));
}

TEST_F(EvaluateFlow, AFileNameThatIsNoUtf8IsToldInTheReport) {
  write_result(result(), {0.0, 0.0});
  fs::copy(result() / "000000.flo", result() / "bad\xff.flo");
  EXPECT_THAT(test::notes_of(evaluate(options(), scratch_ / "report")),
              HasSubstr("no number in \"bad\\xff.flo\""));
  EXPECT_THAT(core::read_text_file(scratch_ / "report/report.json"), HasSubstr("bad\\\\xff.flo"));
}

TEST_F(EvaluateFlow, FilesOfOtherNumbersAreToldAndTwoOfOneFrameRefused) {
  write_result(result(), {0.0, 0.0});
  fs::copy(result() / "000000.flo", result() / "000007.flo");
  fs::copy(result() / "000000.flo", result() / "mean.flo");
  const std::string notes = test::notes_of(evaluate(options()));
  EXPECT_THAT(notes, HasSubstr("\"000007.flo\" is beyond the 3 frames"));
  EXPECT_THAT(notes, HasSubstr("no number in \"mean.flo\""));
  fs::copy(result() / "000000.flo", result() / "frame_0000_v2.flo");
  EXPECT_THROW(evaluate(options()), core::Error);
}

TEST_F(EvaluateFlow, PixelsAndFramesAreAveragedAsAsked) {
  // Frame 0 is judged in a quarter of its pixels and off by 4 px, frame 1 in all and right.
  write_result(result(), {0.0, 0.0});
  test::write_flo(result() / "000000.flo", test::flow_of_pixels([](int x, int y) {
                    return Vector2d(test::wall_flow(x, y, kDepth_m, kStep) + Vector2d(4.0, 0.0));
                  }));
  std::vector<float> depths = test::plane(0.0);
  std::fill(depths.begin(), depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 4),
            static_cast<float>(kDepth_m));
  test::write_plane_npy(truth() / "dataset/sequences/00/depth_2/000000.npy", depths);
  EXPECT_NEAR(figure(evaluate(options()), "EPE2D"), 4.0 * 0.25 / 1.25, 1e-6);
  EXPECT_NEAR(figure(evaluate(options()), "F1-all"), 100.0 * 0.25 / 1.25, 1e-9);
  EvaluateOptions by_frame = options();
  by_frame.average = Averaging::Frames;
  EXPECT_NEAR(figure(evaluate(by_frame), "EPE2D"), 2.0, 1e-6);
  EXPECT_EQ(figure(evaluate(by_frame), "F1-all"), 50.0);
}

TEST_F(EvaluateFlow, EveryFormatGivesTheSame) {
  const std::vector<float> flow = test::flow_of_pixels([](int x, int y) {
    // Multiples of 1/64 px, which KITTI's PNG holds exactly.
    return Vector2d((x - 40) / 64.0, (30 - y) / 32.0);
  });
  write_result(result(), {0.0, 0.0});
  const auto epe_of = [&](const std::string& name, const std::string& content) {
    const fs::path folder = scratch_ / name;
    core::write_file(folder / name, content);
    EvaluateOptions own = options();
    own.result = folder;
    const Evaluation evaluation = evaluate(own);
    EXPECT_EQ(evaluation.rows.back().num_answered_frames, 1) << name;
    return figure(evaluation, "EPE2D");
  };
  const double epe =
      epe_of("000000.flo", test::flo_text(test::kWallWidth, test::kWallHeight, flow));
  EXPECT_GT(epe, 1.0);
  std::vector<float> planar(flow.size());
  const std::size_t num_pixels = flow.size() / 2;
  for (std::size_t i = 0; i < num_pixels; ++i) {
    planar[i] = flow[2 * i];
    planar[num_pixels + i] = flow[2 * i + 1];
  }
  EXPECT_EQ(epe_of("000000_hw2.npy", test::npy_text("72, 96, 2", flow)), epe);
  EXPECT_EQ(epe_of("000000_2hw.npy", test::npy_text("2, 72, 96", planar)), epe);
  EXPECT_EQ(epe_of("000000_f8.npy",
                   test::npy_text("72, 96, 2", std::vector<double>(flow.begin(), flow.end()))),
            epe);
  // OpenCV writes B, G, R: valid, v, u.
  cv::Mat png(test::kWallHeight, test::kWallWidth, CV_16UC3);
  for (int y = 0; y < png.rows; ++y)
    for (int x = 0; x < png.cols; ++x) {
      const std::size_t i =
          static_cast<std::size_t>(y) * test::kWallWidth + static_cast<std::size_t>(x);
      png.at<cv::Vec3w>(y, x) =
          cv::Vec3w(1, static_cast<std::uint16_t>(flow[2 * i + 1] * 64.0F + 32768.0F),
                    static_cast<std::uint16_t>(flow[2 * i] * 64.0F + 32768.0F));
    }
  std::vector<unsigned char> encoded;
  ASSERT_TRUE(cv::imencode(".png", png, encoded));
  EXPECT_EQ(epe_of("000000_10.png", std::string(encoded.begin(), encoded.end())), epe);
  // A pixel that is not valid has no flow.
  png.at<cv::Vec3w>(3, 5) = cv::Vec3w(0, 0, 0);
  ASSERT_TRUE(cv::imencode(".png", png, encoded));
  core::write_file(scratch_ / "hole/000000_10.png", std::string(encoded.begin(), encoded.end()));
  EvaluateOptions hole = options();
  hole.result = scratch_ / "hole";
  const ScoreRow row = evaluate(hole).rows.back();
  EXPECT_EQ(row.num_answered, row.num_truth - 1);
}

TEST_F(EvaluateFlow, KittiTellsNothingOfWhatTheNextFrameSees) {
  write_result(result(), {0.0, 0.0});
  EvaluateOptions masked = options();
  masked.mask = FlowMask::Covisible;
  EXPECT_THROW(evaluate(masked), core::Error);
  masked.mask = FlowMask::InView;
  std::int64_t num_in_view = 0;
  for (int y = 0; y < test::kWallHeight; ++y)
    for (int x = 0; x < test::kWallWidth; ++x) {
      const Vector2d at = test::wall_flow(x, y, kDepth_m, kStep) + Vector2d(x + 0.5, y + 0.5);
      num_in_view +=
          at.x() >= 0.0 && at.y() >= 0.0 && at.x() < test::kWallWidth && at.y() < test::kWallHeight
              ? 1
              : 0;
    }
  EXPECT_LT(num_in_view, test::kWallWidth * test::kWallHeight);
  EXPECT_EQ(evaluate(masked).rows.back().num_truth, 2 * num_in_view);
}

/// TartanAir's two versions, which store flow and masks; 640 pixels wide by definition.
class EvaluateStoredFlow : public testing::TestWithParam<bool> {};

TEST_P(EvaluateStoredFlow, ItsOwnFilesAreRightToTheLastBitAndMasksAreObeyed) {
  const bool is_v1 = GetParam();
  const ScratchFolder scratch;
  test::Recording recording;
  recording.cameras = is_v1 ? test::tartanair_v1_cameras() : test::tartanair_cameras();
  const Vector3d step(10.0, 0.0, 0.0);
  for (int frame = 0; frame < 2; ++frame) {
    recording.body_world.emplace_back(recording.cameras[0].body_from_camera * step * frame);
    recording.world_from_body.push_back(Eigen::Matrix3d::Identity());
  }
  const int height = recording.cameras[0].height;
  recording.color.assign(2, {2, core::Image8(640, height, 3, 100)});
  recording.depth.assign(2, {2, core::Image<double>(640, height, 1, 80.0)});
  fs::path flow;
  if (is_v1) {
    test::write_tartanair_v1(recording, scratch / "truth");
    flow = scratch / "truth/Hills/Easy/P000/flow";
  } else {
    test::write_tartanair(recording, scratch / "truth");
    flow = scratch / "truth/Hills/Data_easy/P000/flow_lcam_front";
  }
  const EvaluateOptions own{.task = "flow", .truth = scratch / "truth", .result = flow};
  const Evaluation evaluation = evaluate(own);
  EXPECT_EQ(figure(evaluation, "EPE2D"), 0.0);
  EXPECT_EQ(figure(evaluation, "F1-all"), 0.0);
  EXPECT_EQ(evaluation.rows.back().num_truth, 640 * height);
  // The wall moves by f t / Z = 40 px to the left: so many columns leave the image.
  for (const FlowMask mask : {FlowMask::InView, FlowMask::Covisible}) {
    EvaluateOptions masked = own;
    masked.mask = mask;
    EXPECT_EQ(evaluate(masked).rows.back().num_truth, 600 * height);
  }
}

INSTANTIATE_TEST_SUITE_P(BothVersions, EvaluateStoredFlow, testing::Bool(),
                         [](const auto& test) { return test.param ? "V1" : "V2"; });

}  // namespace
}  // namespace terracast::validate
