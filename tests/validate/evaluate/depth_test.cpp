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

/// Depth against a truth that each test writes: measures in closed form and by hand.
namespace terracast::validate {
namespace {

namespace fs = std::filesystem;
using test::evaluate;
using test::figure;
using test::plane;
using test::ScratchFolder;
using testing::HasSubstr;

constexpr double kTruth_m = 40.0;

class EvaluateDepth : public testing::Test {
 protected:
  void SetUp() override {
    test::write_kitti(test::wall_flight(2, kTruth_m, {1.0, 0.0, 0.0}), truth());
  }
  fs::path truth() const { return scratch_ / "truth"; }
  fs::path result() const { return scratch_ / "result"; }
  EvaluateOptions options() const {
    return {.task = "depth", .truth = truth(), .result = result()};
  }
  void set_truth(int frame, const std::vector<float>& depths) const {
    test::write_plane_npy(truth() / fmt::format("dataset/sequences/00/depth_2/{:06}.npy", frame),
                          depths);
  }
  void set_result(int frame, const std::vector<float>& depths) const {
    test::write_plane_npy(result() / fmt::format("{:06}.npy", frame), depths);
  }
  ScratchFolder scratch_;
};

TEST_F(EvaluateDepth, TheTruthItselfIsRightToTheLastBit) {
  for (int frame = 0; frame < 2; ++frame) set_result(frame, plane(kTruth_m));
  const Evaluation evaluation = evaluate(options());
  for (const char* name : {"AbsRel", "SqRel", "RMSE", "RMSE log"})
    EXPECT_EQ(figure(evaluation, name), 0.0) << name;
  for (const char* name : {"d<1.25", "d<1.25^2", "d<1.25^3"})
    EXPECT_EQ(figure(evaluation, name), 1.0) << name;
  EXPECT_EQ(evaluation.rows.back().num_frames, 2);
}

TEST_F(EvaluateDepth, AFactorGivesTheClosedForm) {
  // 1.5 times the truth: between 1.25 and 1.25^2.
  for (int frame = 0; frame < 2; ++frame) set_result(frame, plane(1.5 * kTruth_m));
  const Evaluation evaluation = evaluate(options());
  EXPECT_DOUBLE_EQ(figure(evaluation, "AbsRel"), 0.5);
  EXPECT_DOUBLE_EQ(figure(evaluation, "SqRel"), 0.25 * kTruth_m);
  EXPECT_DOUBLE_EQ(figure(evaluation, "RMSE"), 0.5 * kTruth_m);
  EXPECT_NEAR(figure(evaluation, "RMSE log"), std::log(1.5), 1e-12);
  EXPECT_EQ(figure(evaluation, "d<1.25"), 0.0);
  EXPECT_EQ(figure(evaluation, "d<1.25^2"), 1.0);
}

/// Four pixels worked by hand: truth 2, 4, 8, 16 m, result 3, 4, 6, 24 m.
TEST_F(EvaluateDepth, FourPixelsAreAsWorkedByHand) {
  std::vector<float> is = plane(0.0), says = plane(1.0);
  const float truths[] = {2.0F, 4.0F, 8.0F, 16.0F}, results[] = {3.0F, 4.0F, 6.0F, 24.0F};
  std::copy(std::begin(truths), std::end(truths), is.begin());
  std::copy(std::begin(results), std::end(results), says.begin());
  set_truth(0, is);
  set_result(0, says);
  const Evaluation evaluation = evaluate(options());
  EXPECT_EQ(evaluation.rows.back().num_truth, 4);
  EXPECT_DOUBLE_EQ(figure(evaluation, "AbsRel"), (0.5 + 0.0 + 0.25 + 0.5) / 4.0);
  EXPECT_DOUBLE_EQ(figure(evaluation, "SqRel"), (0.5 + 0.0 + 0.5 + 4.0) / 4.0);
  EXPECT_DOUBLE_EQ(figure(evaluation, "RMSE"), std::sqrt((1.0 + 0.0 + 4.0 + 64.0) / 4.0));
  // Ratios 1.5, 1, 4/3, 1.5 against 1.25, 1.5625, 1.953125.
  EXPECT_EQ(figure(evaluation, "d<1.25"), 0.25);
  EXPECT_EQ(figure(evaluation, "d<1.25^2"), 1.0);
}

TEST_F(EvaluateDepth, RandomDepthsAreWhatBruteForceSays) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> drawn(1.0F, 150.0F);
  long double sums[4] = {}, shares[3] = {};
  std::int64_t count = 0;
  for (int frame = 0; frame < 2; ++frame) {
    std::vector<float> is = plane(1.0), says = is;
    for (std::size_t i = 0; i < is.size(); ++i) {
      is[i] = drawn(random);
      says[i] = drawn(random);
      if (!(is[i] < 100.0F)) continue;
      const long double d = says[i], t = is[i];
      ++count;
      sums[0] += std::abs(d - t) / t;
      sums[1] += (d - t) * (d - t) / t;
      sums[2] += (d - t) * (d - t);
      sums[3] += std::log(d / t) * std::log(d / t);
      for (int k = 0; k < 3; ++k)
        shares[k] += std::max(d / t, t / d) < std::pow(1.25L, k + 1) ? 1.0L : 0.0L;
    }
    set_truth(frame, is);
    set_result(frame, says);
  }
  const Evaluation evaluation = evaluate(options());
  EXPECT_EQ(evaluation.rows.back().num_truth, count);
  const auto n = static_cast<long double>(count);
  // Sums of 1e4 doubles.
  EXPECT_NEAR(figure(evaluation, "AbsRel"), static_cast<double>(sums[0] / n), 1e-9);
  EXPECT_NEAR(figure(evaluation, "SqRel"), static_cast<double>(sums[1] / n), 1e-7);
  EXPECT_NEAR(figure(evaluation, "RMSE"), static_cast<double>(std::sqrt(sums[2] / n)), 1e-9);
  EXPECT_NEAR(figure(evaluation, "RMSE log"), static_cast<double>(std::sqrt(sums[3] / n)), 1e-9);
  EXPECT_NEAR(figure(evaluation, "d<1.25"), static_cast<double>(shares[0] / n), 1e-12);
  EXPECT_NEAR(figure(evaluation, "d<1.25^2"), static_cast<double>(shares[1] / n), 1e-12);
  EXPECT_NEAR(figure(evaluation, "d<1.25^3"), static_cast<double>(shares[2] / n), 1e-12);
}

TEST(DepthRatio, TheBoundIsExclusiveBothWays) {
  EXPECT_FALSE(is_ratio_under(5.0, 4.0, 1.25));
  EXPECT_FALSE(is_ratio_under(4.0, 5.0, 1.25));
  EXPECT_TRUE(is_ratio_under(std::nextafter(5.0, 0.0), 4.0, 1.25));
  EXPECT_TRUE(is_ratio_under(4.0, std::nextafter(5.0, 0.0), 1.25));
}

TEST_F(EvaluateDepth, TheLimitIsExclusiveAndSkyNeverCounts) {
  std::vector<float> is = plane(kTruth_m);
  is[0] = 100.0F;
  is[1] = std::nextafter(100.0F, 0.0F);
  is[2] = 0.0F;
  set_truth(0, is);
  set_result(0, plane(kTruth_m));
  const std::int64_t all = test::kWallWidth * test::kWallHeight;
  EXPECT_EQ(evaluate(options()).rows.back().num_truth, all - 2);
  EvaluateOptions unlimited = options();
  unlimited.max_depth_m = 0.0;
  EXPECT_EQ(evaluate(unlimited).rows.back().num_truth, all - 1);
}

TEST_F(EvaluateDepth, ValuesThatAreNoDepthAreMissingNotWrongNumbers) {
  std::vector<float> says = plane(kTruth_m);
  says[0] = 0.0F;
  says[1] = -3.0F;
  says[2] = std::numeric_limits<float>::quiet_NaN();
  says[3] = std::numeric_limits<float>::infinity();
  set_result(0, says);
  const Evaluation evaluation = evaluate(options());
  const ScoreRow& row = evaluation.rows.back();
  EXPECT_EQ(row.num_answered, row.num_truth - 4);
  EXPECT_EQ(figure(evaluation, "AbsRel"), 0.0);
  EXPECT_DOUBLE_EQ(figure(evaluation, "d<1.25"),
                   static_cast<double>(row.num_answered) / static_cast<double>(row.num_truth));
  EXPECT_EQ(row.num_answered_frames, 1);
  EXPECT_EQ(row.num_frames, 2);
}

TEST_F(EvaluateDepth, MediansTakeAwayTheScaleOfEachImage) {
  // The number of pixels is even: both in the middle count.
  std::vector<float> is = plane(0.0);
  for (std::size_t i = 0; i < is.size(); ++i) is[i] = 10.0F + static_cast<float>(i) / 128.0F;
  for (int frame = 0; frame < 2; ++frame) {
    std::vector<float> says = is;
    for (float& value : says) value *= frame == 0 ? 0.25F : 8.0F;
    set_truth(frame, is);
    set_result(frame, says);
  }
  EvaluateOptions scaled = options();
  EXPECT_GT(figure(evaluate(scaled), "AbsRel"), 0.5);
  scaled.is_depth_median_scaled = true;
  const Evaluation evaluation = evaluate(scaled);
  EXPECT_EQ(figure(evaluation, "AbsRel"), 0.0);  // powers of two are exact
  EXPECT_THAT(test::notes_of(evaluation), HasSubstr("0.125 to 4"));
  // Two pixels alone: medians 3 and 6 of truth 2, 4 and result 4, 8; scaled exactly.
  std::vector<float> two = plane(0.0), twice = plane(1.0);
  two[0] = 2.0F, two[1] = 4.0F, twice[0] = 3.0F, twice[1] = 9.0F;
  for (int frame = 0; frame < 2; ++frame) {
    set_truth(frame, two);
    set_result(frame, twice);
  }
  // Scale 3 / 6: 1.5 against 2 and 4.5 against 4.
  EXPECT_DOUBLE_EQ(figure(evaluate(scaled), "AbsRel"), 0.5 * (0.25 + 0.125));
}

TEST_F(EvaluateDepth, ClampedResultsEndAtTheLimit) {
  set_result(0, plane(1000.0));
  EvaluateOptions clamped = options();
  clamped.is_depth_clamped = true;
  EXPECT_DOUBLE_EQ(figure(evaluate(clamped), "RMSE"), 100.0 - kTruth_m);
  EXPECT_DOUBLE_EQ(figure(evaluate(options()), "RMSE"), 1000.0 - kTruth_m);
}

TEST_F(EvaluateDepth, DisparityBecomesDepthByThePair) {
  // f b = 65 px m: 40 m are 1.625 px, which counts of 1/256 hold exactly.
  const double disparity_px = test::kWallFocal_px * test::kWallBaseline_m / kTruth_m;
  cv::Mat png(test::kWallHeight, test::kWallWidth, CV_16UC1, cv::Scalar(disparity_px * 256.0));
  png.at<std::uint16_t>(7, 9) = 0;
  fs::create_directories(result());
  ASSERT_TRUE(cv::imwrite((result() / "000001_10.png").string(), png));
  EvaluateOptions own = options();
  own.result.clear();
  own.disparity = result();
  const Evaluation evaluation = evaluate(own);
  EXPECT_LT(figure(evaluation, "RMSE"), 1e-5);  // float32 of 40 m, calib.txt of 12 digits
  EXPECT_EQ(evaluation.rows.back().num_answered, evaluation.rows.back().num_truth - 1);
  own.cameras = {"image_3"};
  EXPECT_THROW(evaluate(own), core::Error);
}

TEST_F(EvaluateDepth, EveryFormatGivesTheSame) {
  // Multiples of 1/256 m below 256 m, which KITTI's PNG holds exactly.
  std::vector<float> says = plane(0.0);
  for (std::size_t i = 0; i < says.size(); ++i)
    says[i] = 10.0F + static_cast<float>(i % 977) / 256.0F;
  const auto figure_of = [&](const std::string& name, const std::string& content) {
    core::write_file(scratch_ / name / name, content);
    EvaluateOptions own = options();
    own.result = scratch_ / name;
    const Evaluation evaluation = evaluate(own);
    EXPECT_EQ(evaluation.rows.back().num_answered, evaluation.rows.back().num_truth) << name;
    return figure(evaluation, "SqRel");
  };
  const double right = figure_of("000000.npy", test::npy_text("72, 96", says));
  EXPECT_EQ(figure_of("000000_f8.npy",
                      test::npy_text("1, 72, 96", std::vector<double>(says.begin(), says.end()))),
            right);
  const int width = test::kWallWidth, height = test::kWallHeight;
  cv::Mat values(height, width, CV_32FC1, says.data());
  const auto encoded = [](const char* extension, const cv::Mat& image) {
    std::vector<unsigned char> bytes;
    EXPECT_TRUE(cv::imencode(extension, image, bytes));
    return std::string(bytes.begin(), bytes.end());
  };
  cv::Mat counts;
  values.convertTo(counts, CV_16UC1, 256.0);
  EXPECT_EQ(figure_of("000000_kitti.png", encoded(".png", counts)), right);
  // TartanAir: OpenCV's B, G, R, A are the bytes of the float.
  const cv::Mat bgra(height, width, CV_8UC4, says.data());
  EXPECT_EQ(figure_of("000000_depth.png", encoded(".png", bgra)), right);
  EXPECT_EQ(figure_of("000000_opencv.pfm", encoded(".pfm", values)), right);
  // PFM by hand, rows from the bottom up, in both byte orders.
  for (const bool is_big : {false, true}) {
    test::ByteWriter pfm;
    pfm.put_text(is_big ? "Pf\n96 72\n1.0\n" : "Pf\n96 72\n-1.0\n");
    for (int y = height - 1; y >= 0; --y)
      for (int x = 0; x < width; ++x) {
        test::ByteWriter one;
        one.put(values.at<float>(y, x));
        if (is_big) std::reverse(one.text.begin(), one.text.end());
        pfm.put_text(one.text);
      }
    EXPECT_EQ(figure_of(is_big ? "000000_big.pfm" : "000000_little.pfm", pfm.text), right);
  }
}

TEST_F(EvaluateDepth, SeveralCamerasLieInFoldersOfTheirNames) {
  const ScratchFolder scratch;
  test::Recording recording = test::wall_flight(2, kTruth_m, {0.5, 0.0, 0.0});
  recording.cameras[0].name = "rig/cam0";
  recording.cameras[1].name = "rig/cam1";
  test::write_colmap(recording, scratch / "truth");
  for (int camera = 0; camera < 2; ++camera)
    for (int frame = 0; frame < 2; ++frame)
      test::write_plane_npy(scratch / fmt::format("result/rig/cam{}/{:06}.npy", camera, frame),
                            plane(kTruth_m * (camera == 0 ? 1.0 : 1.125)));
  EvaluateOptions own{.task = "depth", .truth = scratch / "truth", .result = scratch / "result"};
  // Of one camera its folder is found too.
  EXPECT_EQ(figure(evaluate(own), "AbsRel"), 0.0);
  own.cameras = {"all"};
  const Evaluation evaluation = evaluate(own);
  ASSERT_EQ(evaluation.rows.size(), 3U);
  EXPECT_EQ(evaluation.rows[0].values[0], 0.0);
  EXPECT_DOUBLE_EQ(evaluation.rows[1].values[0].value_or(-1.0), 0.125);
  EXPECT_DOUBLE_EQ(figure(evaluation, "AbsRel"), 0.0625);
  fs::remove_all(scratch / "result/rig/cam1");
  EXPECT_THROW(evaluate(own), core::Error);
  own.cameras = {"rig/cam7"};
  EXPECT_THROW(evaluate(own), core::Error);
}

// KITTI's right camera has no depth: nobody need have results of it.
TEST_F(EvaluateDepth, ACameraWithoutTruthIsLeftOutAndTold) {
  for (int frame = 0; frame < 2; ++frame)
    test::write_plane_npy(scratch_ / fmt::format("all/00/image_2/{:06}.npy", frame),
                          plane(kTruth_m));
  EvaluateOptions own = options();
  own.result = scratch_ / "all";
  own.cameras = {"all"};
  const Evaluation evaluation = evaluate(own);
  EXPECT_EQ(figure(evaluation, "AbsRel"), 0.0);
  EXPECT_EQ(evaluation.rows.back().num_frames, 2);
  EXPECT_THAT(test::notes_of(evaluation),
              HasSubstr("00, image_3: the dataset has no truth of any frame: left out"));
  own.cameras = {"image_3"};
  EXPECT_THROW(evaluate(own), core::Error);
}

TEST_F(EvaluateDepth, TruthThatIsDamagedGivesNoFigure) {
  set_result(0, plane(kTruth_m));
  fs::resize_file(truth() / "dataset/sequences/00/depth_2/000000.npy", 1000);
  EXPECT_THROW(evaluate(options()), core::Error);
  // A frame whose truth is missing is told.
  fs::remove(truth() / "dataset/sequences/00/depth_2/000000.npy");
  set_result(1, plane(kTruth_m));
  const Evaluation evaluation = evaluate(options());
  EXPECT_EQ(evaluation.rows.back().num_frames, 1);
  EXPECT_THAT(test::notes_of(evaluation), HasSubstr("the dataset has no truth of 1 of 2 frames"));
}

}  // namespace
}  // namespace terracast::validate
