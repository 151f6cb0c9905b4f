#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "core/error.h"
#include "tests/support/test_data.h"
#include "tests/validate/evaluate/wall_flight.h"
#include "validate/evaluate/trajectory_error.h"

/// ATE and RPE of trajectories that stand to the truth in known ways.
namespace terracast::validate {
namespace {

namespace fs = std::filesystem;
using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using test::evaluate;
using test::figure;
using test::ScratchFolder;
using testing::HasSubstr;

using Path = std::vector<std::optional<Pose>>;

/// A climbing, rolling turn.
Path turn(int count) {
  Path path;
  for (int i = 0; i < count; ++i) {
    const double angle = 0.3 * i;
    path.push_back(Pose{(AngleAxisd(angle, Vector3d::UnitZ()) *
                         AngleAxisd(0.2 * std::sin(0.7 * i), Vector3d::UnitX()))
                            .toRotationMatrix(),
                        {20.0 * std::sin(angle), 20.0 * std::cos(angle), 0.8 * i}});
  }
  return path;
}

Path moved(const Path& path, double scale, const Matrix3d& rotation, const Vector3d& shift) {
  Path result;
  for (const auto& pose : path)
    result.push_back(
        Pose{rotation * pose->rotation, scale * (rotation * pose->translation) + shift});
  return result;
}

double ate_of(const TrajectoryErrors& errors) {
  double sum = 0.0, count = 0.0;
  for (const auto& error : errors.position_m)
    if (error) {
      sum += *error * *error;
      ++count;
    }
  return std::sqrt(sum / count);
}

double largest(const std::vector<std::optional<double>>& values) {
  double most = -1.0;
  for (const auto& value : values)
    if (value) most = std::max(most, *value);
  return most;
}

const Matrix3d kTurned =
    (AngleAxisd(2.1, Vector3d(0.3, -0.5, 0.8).normalized())).toRotationMatrix();

TEST(TrajectoryErrors, TheTruthItselfIsRightToTheLastBit) {
  const Path truth = turn(12);
  const TrajectoryErrors errors =
      trajectory_errors(truth, truth, align_trajectory(truth, truth, Alignment::None), 1);
  EXPECT_EQ(largest(errors.position_m), 0.0);
  EXPECT_EQ(largest(errors.step_m), 0.0);
}

TEST(TrajectoryErrors, ARigidMotionIsUndoneBySe3) {
  const Path truth = turn(12);
  const Path found = moved(truth, 1.0, kTurned, {100.0, -40.0, 7.0});
  const Similarity laid = align_trajectory(truth, found, Alignment::Se3);
  EXPECT_EQ(laid.scale, 1.0);
  const TrajectoryErrors errors = trajectory_errors(truth, found, laid, 1);
  EXPECT_LT(largest(errors.position_m), 1e-12);  // rounding of 100 m
  EXPECT_LT(largest(errors.step_m), 1e-12);
  EXPECT_GT(largest(trajectory_errors(truth, found, {}, 1).position_m), 50.0);
}

TEST(TrajectoryErrors, ASimilarityIsUndoneBySim3Alone) {
  const Path truth = turn(12);
  const Path found = moved(truth, 0.01, kTurned, {3.0, 2.0, 1.0});
  const Similarity laid = align_trajectory(truth, found, Alignment::Sim3);
  EXPECT_NEAR(laid.scale, 100.0, 1e-10);
  const TrajectoryErrors errors = trajectory_errors(truth, found, laid, 1);
  EXPECT_LT(largest(errors.position_m), 1e-10);  // a hundred times the rounding of 3
  EXPECT_LT(largest(errors.step_m), 1e-10);
  EXPECT_GT(
      ate_of(trajectory_errors(truth, found, align_trajectory(truth, found, Alignment::Se3), 1)),
      5.0);
}

/// A mirror image is no rotation: it must not be undone.
TEST(TrajectoryErrors, AMirrorImageIsNotLaidOnTheTruth) {
  const Path truth = turn(12);
  Path found = truth;
  for (auto& pose : found) pose->translation.x() = -pose->translation.x();
  const Similarity laid = align_trajectory(truth, found, Alignment::Se3);
  EXPECT_NEAR(laid.rotation.determinant(), 1.0, 1e-12);
  EXPECT_GT(ate_of(trajectory_errors(truth, found, laid, 1)), 0.5);  // a mirror would leave 1e-14
}

/// No small turn, shift or change of scale makes the sum of squares less.
TEST(TrajectoryErrors, NoNearbyAlignmentIsBetter) {
  const Path truth = turn(15);
  Path found = moved(truth, 0.5, kTurned, {1.0, 2.0, 3.0});
  for (std::size_t i = 0; i < found.size(); ++i) {
    const auto k = static_cast<double>(i);
    found[i]->translation +=
        0.7 * Vector3d(std::sin(5.1 * k), std::cos(3.3 * k), std::sin(2.7 * k));
  }
  for (const Alignment alignment : {Alignment::Se3, Alignment::Sim3}) {
    const Similarity best = align_trajectory(truth, found, alignment);
    const double ate = ate_of(trajectory_errors(truth, found, best, 1));
    EXPECT_GT(ate, 0.1);
    for (int axis = 0; axis < 3; ++axis)
      for (const double step : {-1e-4, 1e-4}) {
        Similarity near = best;
        near.rotation = AngleAxisd(step, Vector3d::Unit(axis)).toRotationMatrix() * near.rotation;
        // The turn is about the origin; the best shift goes with it.
        Vector3d mean = Vector3d::Zero(), target = Vector3d::Zero();
        for (std::size_t i = 0; i < truth.size(); ++i) {
          mean += found[i]->translation / static_cast<double>(truth.size());
          target += truth[i]->translation / static_cast<double>(truth.size());
        }
        near.translation = target - near.scale * (near.rotation * mean);
        EXPECT_GT(ate_of(trajectory_errors(truth, found, near, 1)), ate);
        near = best;
        near.translation[axis] += step;
        EXPECT_GT(ate_of(trajectory_errors(truth, found, near, 1)), ate);
        if (alignment == Alignment::Se3) continue;
        near = best;
        near.scale *= 1.0 + step;
        near.translation = target - near.scale * (near.rotation * mean);
        EXPECT_GT(ate_of(trajectory_errors(truth, found, near, 1)), ate);
      }
  }
}

TEST(TrajectoryErrors, StepsOfAWrongScaleAreOffByTheirShare) {
  Path truth, found;
  for (int i = 0; i < 10; ++i) {
    truth.push_back(Pose{kTurned, Vector3d(3.0 * i, 0.0, 0.0)});
    found.push_back(Pose{kTurned, Vector3d(3.3 * i, 0.0, 0.0)});
  }
  for (const std::size_t delta : {1U, 4U}) {
    const TrajectoryErrors errors = trajectory_errors(truth, found, {}, delta);
    for (std::size_t i = 0; i < truth.size(); ++i) {
      EXPECT_EQ(errors.step_m[i].has_value(), i + delta < truth.size());
      if (errors.step_m[i]) {
        EXPECT_NEAR(*errors.step_m[i], 0.3 * static_cast<double>(delta), 1e-12);
      }
    }
  }
}

/// The step is taken in the camera's own axes: a camera that is turned by an angle sees a step of
/// length L off by 2 L sin(angle / 2).
TEST(TrajectoryErrors, StepsOfATurnedCameraAreOffByTheChord) {
  Path truth, found;
  const Matrix3d wrong = AngleAxisd(0.2, Vector3d::UnitZ()).toRotationMatrix();
  for (int i = 0; i < 6; ++i) {
    truth.push_back(Pose{Matrix3d::Identity(), Vector3d(5.0 * i, 0.0, 0.0)});
    found.push_back(Pose{wrong, Vector3d(5.0 * i, 0.0, 0.0)});
  }
  const TrajectoryErrors errors = trajectory_errors(truth, found, {}, 1);
  EXPECT_EQ(largest(errors.position_m), 0.0);
  EXPECT_NEAR(largest(errors.step_m), 2.0 * 5.0 * std::sin(0.1), 1e-12);
}

TEST(TrajectoryErrors, GapsAreNotBridged) {
  const Path truth = turn(8);
  Path found = truth;
  found[3].reset();
  const TrajectoryErrors errors = trajectory_errors(truth, found, {}, 1);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(errors.position_m[i].has_value(), i != 3);
    EXPECT_EQ(errors.step_m[i].has_value(), i != 2 && i != 3 && i != 7) << i;
  }
}

TEST(TrajectoryErrors, WhatCannotBeLaidIsRefused) {
  const Path truth = turn(6);
  Path two(6);
  two[0] = truth[0];
  two[4] = truth[4];
  EXPECT_THROW(align_trajectory(truth, two, Alignment::Se3), core::Error);
  EXPECT_NO_THROW(align_trajectory(truth, two, Alignment::None));
  Path still = truth;
  for (auto& pose : still) pose->translation = Vector3d(1e4, -3e3, 0.1);
  EXPECT_THROW(align_trajectory(truth, still, Alignment::Sim3), core::Error);
  EXPECT_NO_THROW(align_trajectory(truth, still, Alignment::Se3));
  EXPECT_THROW(align_trajectory(still, truth, Alignment::Sim3), core::Error);
}

/// Files of the forms, against datasets of KITTI and COLMAP.
class EvaluateTrajectory : public testing::Test {
 protected:
  static constexpr int kFrames = 6;

  static const test::Recording& flight() {
    static const test::Recording recording = [] {
      // Of a banked, climbing turn the poses alone.
      test::Recording flown = test::wall_flight(kFrames, 50.0, {0.0, 0.0, 0.0});
      for (int i = 0; i < kFrames; ++i) {
        const auto f = static_cast<std::size_t>(i);
        flown.body_world[f] = Vector3d(4.0 * i, 0.7 * i * i, 80.0 + std::sin(0.9 * i));
        flown.world_from_body[f] = (AngleAxisd(0.2 * i, Vector3d::UnitZ()) *
                                    AngleAxisd(0.1 * std::sin(i), Vector3d::UnitX()))
                                       .toRotationMatrix();
      }
      return flown;
    }();
    return recording;
  }

  void SetUp() override { test::write_kitti(flight(), truth()); }
  fs::path truth() const { return scratch_ / "truth"; }
  EvaluateOptions options(const fs::path& result) const {
    return {.task = "trajectory", .truth = truth(), .result = result};
  }
  /// Poses of the left camera in the scene's frame.
  static Matrix3d rotation(int frame) {
    return flight().rotation(0, static_cast<std::size_t>(frame));
  }
  static Vector3d centre(int frame) { return flight().centre(0, static_cast<std::size_t>(frame)); }

  /// Lines of a file, one a frame.
  fs::path write_lines(const std::string& name, const std::function<std::string(int)>& line) const {
    std::string text;
    for (int i = 0; i < kFrames; ++i) text += line(i) + "\n";
    core::write_file(scratch_ / name, text);
    return scratch_ / name;
  }
  static std::string tum_line(int frame, double time_s) {
    const Quaterniond q(rotation(frame));
    const Vector3d t = centre(frame);
    return fmt::format("{:.9f} {} {} {} {} {} {} {}", time_s, t.x(), t.y(), t.z(), q.x(), q.y(),
                       q.z(), q.w());
  }
  static std::string kitti_line(int frame) {
    const Matrix3d r = rotation(0).transpose() * rotation(frame);
    const Vector3d t = rotation(0).transpose() * (centre(frame) - centre(0));
    std::string line;
    for (int row = 0; row < 3; ++row)
      line +=
          fmt::format("{}{} {} {} {}", row > 0 ? " " : "", r(row, 0), r(row, 1), r(row, 2), t[row]);
    return line;
  }

  ScratchFolder scratch_;
};

// Places of dataset and result differ by the 1e-6 m (and 13 decimals of a degree) of the truth's
// first place, poses by their 12 digits.
constexpr double kRounding_m = 1e-5;

TEST_F(EvaluateTrajectory, AllFormsOfTheTruthAreRight) {
  const auto tum = write_lines("tum.txt", [](int i) { return tum_line(i, 0.1 * i); });
  const auto kitti = write_lines("kitti.txt", [](int i) { return kitti_line(i); });
  // TartanAir: x north, y east, z down; the camera's x forward, y right, z down.
  const auto tartanair = write_lines("tartanair.txt", [](int i) {
    Matrix3d ned_from_enu, rdf_from_frd;
    ned_from_enu << 0, 1, 0, 1, 0, 0, 0, 0, -1;
    rdf_from_frd << 0, 1, 0, 0, 0, 1, 1, 0, 0;
    const Quaterniond q(Matrix3d(ned_from_enu * rotation(i) * rdf_from_frd));
    const Vector3d t = ned_from_enu * centre(i);
    return fmt::format("{} {} {} {} {} {} {}", t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
  });
  std::string images = "# Image list with two lines of data per image:\n";
  test::ByteWriter binary;
  binary.put(std::uint64_t{kFrames + 1});
  for (int i = 0; i <= kFrames; ++i) {
    // The last is an image of another folder.
    const int frame = std::min(i, kFrames - 1);
    const std::string name =
        i < kFrames ? fmt::format("image_2/{:06}.png", i) : "image_9/000001.png";
    const Quaterniond q(Matrix3d(rotation(frame).transpose()));
    const Vector3d t = -(rotation(frame).transpose() * centre(frame));
    images += fmt::format("{} {} {} {} {} {} {} {} 1 {}\n\n", i + 1, q.w(), q.x(), q.y(), q.z(),
                          t.x(), t.y(), t.z(), name);
    binary.put(static_cast<std::uint32_t>(i + 1));
    for (const double value : {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()}) binary.put(value);
    binary.put(std::uint32_t{1}).put_text(name).put('\0').put(std::uint64_t{0});
  }
  core::write_file(scratch_ / "colmap_text/images.txt", images);
  core::write_file(scratch_ / "colmap_binary/images.bin", binary.text);
  for (const fs::path& result :
       {tum, kitti, tartanair, scratch_ / "colmap_text", scratch_ / "colmap_binary"}) {
    const bool is_colmap = fs::is_directory(result);
    for (const Alignment alignment : {Alignment::None, Alignment::Se3, Alignment::Sim3}) {
      EvaluateOptions own = options(result);
      own.align = alignment;
      const Evaluation evaluation = evaluate(own);
      EXPECT_EQ(evaluation.rows.back().num_answered_frames, kFrames) << result;
      EXPECT_LT(figure(evaluation, "RPE"), kRounding_m) << result;
      // The scene's frame is that of its place, the dataset's local frame the same.
      EXPECT_LT(figure(evaluation, "ATE"), kRounding_m) << result;
      if (is_colmap) {
        EXPECT_THAT(test::notes_of(evaluation), HasSubstr("1 of 7 images are not of image_2"));
      }
    }
  }
}

TEST_F(EvaluateTrajectory, AConstantShiftIsItsLengthWithoutAlignment) {
  const auto result = write_lines("shifted.txt", [](int i) {
    const Quaterniond q(rotation(i));
    const Vector3d t = centre(i) + Vector3d(1.0, 2.0, 2.0);
    return fmt::format("{} {} {} {} {} {} {} {}", 0.1 * i, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(),
                       q.w());
  });
  EvaluateOptions own = options(result);
  own.align = Alignment::None;
  const Evaluation evaluation = evaluate(own);
  EXPECT_NEAR(figure(evaluation, "ATE"), 3.0, kRounding_m);
  EXPECT_NEAR(figure(evaluation, "ATE mean"), 3.0, kRounding_m);
  EXPECT_LT(figure(evaluation, "RPE"), kRounding_m);
  EXPECT_LT(figure(evaluate(options(result)), "ATE"), kRounding_m);  // se3 by default
}

TEST_F(EvaluateTrajectory, LostFramesAreCountedAndNamed) {
  const auto rows = write_lines("lost.txt", [](int i) {
    return i == 2 ? "nan nan nan nan nan nan nan nan nan nan nan nan" : kitti_line(i);
  });
  const Evaluation evaluation = evaluate(options(rows));
  EXPECT_EQ(evaluation.rows.back().num_frames, kFrames);
  EXPECT_EQ(evaluation.rows.back().num_answered_frames, kFrames - 1);
  EXPECT_THAT(test::notes_of(evaluation), HasSubstr("1 of 6 frames are missing in the result"));
  EXPECT_LT(figure(evaluation, "ATE"), kRounding_m);
  // Fewer rows: the last frames are missing.
  std::string text;
  for (int i = 0; i < 4; ++i) text += kitti_line(i) + "\n";
  core::write_file(scratch_ / "short.txt", text);
  EXPECT_EQ(evaluate(options(scratch_ / "short.txt")).rows.back().num_answered_frames, 4);
  // More are another sequence's.
  for (int i = 0; i < 4; ++i) text += kitti_line(i) + "\n";
  core::write_file(scratch_ / "long.txt", text);
  EXPECT_THROW(evaluate(options(scratch_ / "long.txt")), core::Error);
}

TEST_F(EvaluateTrajectory, TimeStampsFindTheirFrames) {
  // 5 ms late, and two rows in the middle of nowhere.
  std::string text = "# time x y z qx qy qz qw\n";
  for (int i = 0; i < kFrames; ++i) text += tum_line(i, 0.1 * i + 0.005) + "\n";
  text += tum_line(0, 0.05) + "\n" + tum_line(0, 77.0) + "\n";
  core::write_file(scratch_ / "late.txt", text);
  const Evaluation late = evaluate(options(scratch_ / "late.txt"));
  EXPECT_EQ(late.rows.back().num_answered_frames, kFrames);
  EXPECT_THAT(test::notes_of(late), HasSubstr("2 of 8 rows are not used"));
  EXPECT_LT(figure(late, "ATE"), kRounding_m);
  EvaluateOptions strict = options(scratch_ / "late.txt");
  strict.max_time_difference_s = 0.004;
  EXPECT_THROW(evaluate(strict), core::Error);
  strict.time_offset_s = -0.005;
  EXPECT_EQ(evaluate(strict).rows.back().num_answered_frames, kFrames);
  // Of two rows of a frame the nearer counts, whichever comes first.
  for (const bool is_nearer_first : {true, false}) {
    std::string both;
    for (int i = 0; i < kFrames; ++i) {
      const std::string near = tum_line(i, 0.1 * i + 0.001) + "\n";
      const std::string far = tum_line((i + 1) % kFrames, 0.1 * i + 0.004) + "\n";
      both += is_nearer_first ? near + far : far + near;
    }
    core::write_file(scratch_ / "both.txt", both);
    const Evaluation evaluation = evaluate(options(scratch_ / "both.txt"));
    EXPECT_LT(figure(evaluation, "ATE"), kRounding_m) << is_nearer_first;
    EXPECT_THAT(test::notes_of(evaluation), HasSubstr("6 of 12 rows are not used"));
  }
}

TEST_F(EvaluateTrajectory, FilesAreFoundInAFolderByTheSequence) {
  write_lines("results/00.txt", [](int i) { return kitti_line(i); });
  EXPECT_LT(figure(evaluate(options(scratch_ / "results")), "ATE"), kRounding_m);
  write_lines("others/01.txt", [](int i) { return kitti_line(i); });
  EXPECT_THROW(evaluate(options(scratch_ / "others")), core::Error);
  EXPECT_THROW(evaluate(options(scratch_ / "nothing")), core::Error);
}

TEST_F(EvaluateTrajectory, DamagedFilesAreRefused) {
  const auto refused = [&](const std::string& text) {
    core::write_file(scratch_ / "bad.txt", text);
    try {
      evaluate(options(scratch_ / "bad.txt"));
    } catch (const core::Error& error) {
      EXPECT_EQ(error.kind(), core::ErrorKind::Input) << text;
      EXPECT_THAT(error.message(), HasSubstr("bad.txt")) << text;
      return true;
    }
    return false;
  };
  const std::string row = kitti_line(0);
  EXPECT_TRUE(refused(""));
  EXPECT_TRUE(refused("# only a comment\n"));
  EXPECT_TRUE(refused("1 2 3\n"));
  EXPECT_TRUE(refused(row + "\n" + row.substr(0, row.rfind(' ')) + "\n"));
  EXPECT_TRUE(refused(row + "\n\n" + row + "\n"));  // a blank line between rows
  EXPECT_TRUE(refused("1 0 0 1e12 0 1 0 0 0 0 1 0\n"));
  EXPECT_TRUE(refused("2 0 0 1 0 1 0 0 0 0 1 0\n"));   // no rotation
  EXPECT_TRUE(refused("-1 0 0 1 0 1 0 0 0 0 1 0\n"));  // a mirror
  EXPECT_TRUE(refused("0 1 2 3 0 0 0 0\n"));           // no quaternion
  EXPECT_TRUE(refused("0 1 2 inf 0 0 0 1\n"));
  EXPECT_TRUE(refused("0 1 2 x 0 0 0 1\n"));
  const std::string lost = "nan nan nan nan nan nan nan\n";
  EXPECT_TRUE(refused(lost + lost));
  core::write_file(scratch_ / "model/images.bin", std::string(20, '\xff'));
  EXPECT_THROW(evaluate(options(scratch_ / "model")), core::Error);
  core::write_file(scratch_ / "model/images.bin", std::string(8, '\0'));
  EXPECT_THROW(evaluate(options(scratch_ / "model")), core::Error);
}

}  // namespace
}  // namespace terracast::validate
