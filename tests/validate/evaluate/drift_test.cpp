#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/json.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"
#include "tests/validate/evaluate/wall_flight.h"
#include "validate/evaluate/results/trajectory_files.h"
#include "validate/evaluate/truth_between.h"

/// Drift of segments, alignment about the vertical, and the truth between frames: by closed forms, and by
/// a program of another make.
namespace terracast::validate {
namespace {

namespace fs = std::filesystem;
using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using test::ScratchFolder;
using testing::HasSubstr;

using Path = std::vector<std::optional<Pose>>;
const std::vector<double> kKittiLengths_m{100, 200, 300, 400, 500, 600, 700, 800};

/// Along x by `step_m`, without a turn.
Path straight(int count, double step_m) {
  Path path;
  for (int i = 0; i < count; ++i)
    path.push_back(Pose{Matrix3d::Identity(), Vector3d(step_m * i, 0.0, 0.0)});
  return path;
}

std::vector<double> times_at(std::size_t count, double rate_hz) {
  std::vector<double> times_s;
  for (std::size_t i = 0; i < count; ++i) times_s.push_back(static_cast<double>(i) / rate_hz);
  return times_s;
}

Matrix3d yaw(double angle_rad) {
  return AngleAxisd(angle_rad, Vector3d::UnitZ()).toRotationMatrix();
}

TEST(Drift, AWrongScaleIsItsShareOfTheSegment) {
  const Path truth = straight(1001, 1.0);
  const Drift drift = drift_of(truth, straight(1001, 1.02), 1.0, times_at(1001, 10.0),
                               path_lengths_m(truth), kKittiLengths_m, 10);
  // A segment of L m ends at the first pose beyond: L + 1 steps of a metre, from each tenth pose.
  std::size_t expected = 0;
  for (const double length_m : kKittiLengths_m)
    expected += static_cast<std::size_t>(std::floor((1000.0 - length_m - 1.0) / 10.0)) + 1;
  ASSERT_EQ(drift.segments.size(), expected);
  for (const DriftSegment& segment : drift.segments) {
    const double steps = kKittiLengths_m[segment.length_index] + 1.0;
    EXPECT_NEAR(segment.translation_m, 0.02 * steps, 1e-9);
    EXPECT_EQ(segment.rotation_deg, 0.0);
    EXPECT_NEAR(segment.duration_s, 0.1 * steps, 1e-9);
    EXPECT_EQ(segment.first % 10, 0U);
  }
  // The scale of an alignment undoes it.
  for (const DriftSegment& segment :
       drift_of(truth, straight(1001, 1.02), 1.0 / 1.02, times_at(1001, 10.0),
                path_lengths_m(truth), kKittiLengths_m, 10)
           .segments)
    EXPECT_LT(segment.translation_m, 1e-9);
}

/// Dead reckoning with a gyroscope that drifts by w a metre runs along a circle: the chord from the
/// segment's first pose is (sin(w L) / w, (1 - cos(w L)) / w).
TEST(Drift, AConstantYawRateIsThatOfACircle) {
  constexpr double kYaw_radpm = 0.002;
  Path found;
  for (int i = 0; i < 601; ++i) {
    const double angle = kYaw_radpm * i;
    found.push_back(Pose{yaw(angle), Vector3d(std::sin(angle) / kYaw_radpm,
                                              (1.0 - std::cos(angle)) / kYaw_radpm, 5.0)});
  }
  const Drift drift = drift_of(straight(601, 1.0), found, 1.0, times_at(601, 20.0),
                               path_lengths_m(straight(601, 1.0)), kKittiLengths_m, 10);
  ASSERT_FALSE(drift.segments.empty());
  for (const DriftSegment& segment : drift.segments) {
    const double length_m = kKittiLengths_m[segment.length_index] + 1.0;
    const double angle = kYaw_radpm * length_m;
    EXPECT_NEAR(segment.rotation_deg, degrees_from_radians(angle), 1e-9);
    EXPECT_NEAR(
        segment.translation_m,
        std::hypot(std::sin(angle) / kYaw_radpm - length_m, (1.0 - std::cos(angle)) / kYaw_radpm),
        1e-9);
  }
}

TEST(Drift, SegmentsWithALostEndAreCounted) {
  Path found = straight(301, 1.0);
  found[0].reset();
  found[111].reset();  // the end of 100 m from 10
  Path truth = straight(301, 1.0);
  const auto drift = [&] {
    return drift_of(truth, found, 1.0, times_at(301, 10.0), path_lengths_m(straight(301, 1.0)),
                    std::vector<double>{100.0}, 10);
  };
  EXPECT_EQ(drift().num_lost, 2);
  EXPECT_EQ(drift().num_unjudged, 0);
  EXPECT_EQ(drift().segments.size(), 18U);  // from 0 to 190 there are 20
  // An end that the truth lacks is not the result's loss.
  truth[10].reset();
  truth[20].reset();
  EXPECT_EQ(drift().num_lost, 1);
  EXPECT_EQ(drift().num_unjudged, 2);
  EXPECT_EQ(drift().segments.size(), 17U);
}

/// There and back within a gap of the rows: the chord is 0, the path is not.
TEST(Steps, ThePathBetweenRowsIsThatOfTheFrames) {
  Path frames = straight(6, 2.0);
  for (int i = 4; i >= 0; --i) frames.push_back(frames[static_cast<std::size_t>(i)]);
  EXPECT_EQ(path_lengths_at_m(frames, times_at(11, 1.0),
                              std::vector<double>{-5.0, 0.0, 0.25, 9.5, 10.0, 12.0}),
            (std::vector<double>{0.0, 0.0, 0.5, 19.0, 20.0, 20.0}));
}

TEST(GapsOfRows, AreFilledAtTheRowsMedianInterval) {
  const std::vector<double> frames_s = times_at(11, 1.0);
  const auto filled = [&](const std::vector<double>& times_s) {
    return fill_gaps({times_s, Path(times_s.size(), Pose{Matrix3d::Identity(), Vector3d::Zero()})},
                     frames_s);
  };
  const FilledTrajectory gap = filled({-7.0, 1.0, 1.5, 2.0, 4.25, 4.75, 10.0, 10.5, 30.0});
  EXPECT_EQ(gap.interval_s, 0.5);
  EXPECT_EQ(gap.rows.times_s,
            (std::vector<double>{-7.0, 0.0,  0.5,  1.0,  1.5,  2.0,  2.5,  3.0,  3.5,
                                 4.0,  4.25, 4.75, 5.25, 5.75, 6.25, 6.75, 7.25, 7.75,
                                 8.25, 8.75, 9.25, 9.75, 10.0, 10.5, 30.0}));
  EXPECT_EQ(gap.num_filled, 16);
  for (std::size_t i = 0; i < gap.rows.times_s.size(); ++i) {
    const double time_s = gap.rows.times_s[i];
    EXPECT_EQ(
        gap.rows.world_from_camera[i].has_value(),
        testing::Value(time_s, testing::AnyOf(-7.0, 1.0, 1.5, 2.0, 4.25, 4.75, 10.0, 10.5, 30.0)))
        << time_s;
  }
  // Jitter of less than half an interval is no gap; one row lost of a steady rate is one.
  EXPECT_EQ(filled({0.0, 1.2, 2.0, 3.4, 4.0, 5.0, 6.4, 7.0, 8.0, 9.0, 10.0}).num_filled, 0);
  EXPECT_EQ(filled({0.0, 1.0, 2.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0}).num_filled, 1);
  // Rows all elsewhere are left to those who compare; hostile times end.
  EXPECT_EQ(filled({1e9, 1e9 + 1.0}).num_filled, 0);
  EXPECT_EQ(filled({-1e300, 5.0, 1e300}).num_filled, 10);
  EXPECT_LE(filled({4.0, 4.0 + 1e-12, 4.0 + 2e-12}).num_filled, 1'000'000);
}

TEST(Steps, OfALengthEndBeyondIt) {
  const std::vector<double> path_m = path_lengths_m(straight(8, 2.0));
  EXPECT_EQ(path_m.back(), 14.0);
  const StepEnds ends = steps_of_length(path_m, 4.0);
  for (std::size_t i = 0; i < ends.size(); ++i) {
    EXPECT_EQ(ends[i].has_value(), i + 3 < ends.size());
    if (ends[i]) {
      EXPECT_EQ(*ends[i], i + 3);
    }
  }
}

/// A gap of the truth is crossed by its chord.
TEST(Steps, TheTruePathCrossesGapsStraight) {
  Path truth = straight(5, 3.0);
  truth[2].reset();
  EXPECT_EQ(path_lengths_m(truth), (std::vector<double>{0.0, 3.0, 3.0, 9.0, 12.0}));
}

TEST(YawAlignment, UndoesATurnAboutTheVerticalAndNoOther) {
  Path truth;
  for (int i = 0; i < 20; ++i)
    truth.push_back(
        Pose{yaw(0.2 * i), {30.0 * std::cos(0.3 * i), 20.0 * std::sin(0.2 * i), 0.5 * i}});
  const auto moved = [&](const Matrix3d& rotation) {
    Path path;
    for (const auto& pose : truth)
      path.push_back(Pose{rotation * pose->rotation,
                          rotation * pose->translation + Vector3d(100.0, -50.0, 9.0)});
    return path;
  };
  const auto ate = [&](const Path& found, Alignment alignment) {
    const TrajectoryErrors errors =
        trajectory_errors(truth, found, align_trajectory(truth, found, alignment), 1);
    double square = 0.0;
    for (const auto& error : errors.position_m) square += *error * *error;
    return std::sqrt(square / static_cast<double>(truth.size()));
  };
  EXPECT_LT(ate(moved(yaw(2.5)), Alignment::Yaw), 1e-12);
  // A tilt stays: the best turn about the vertical is none, and leaves what the tilt moved.
  const Matrix3d tilt = AngleAxisd(0.1, Vector3d::UnitX()).toRotationMatrix();
  EXPECT_GT(ate(moved(tilt), Alignment::Yaw), 0.5);
  EXPECT_LT(ate(moved(tilt), Alignment::Se3), 1e-12);
  // No turn nearby is better.
  Path bent = moved(yaw(-1.2) * tilt);
  for (std::size_t i = 0; i < bent.size(); ++i)
    bent[i]->translation += Vector3d(std::sin(7.0 * static_cast<double>(i)),
                                     std::cos(5.0 * static_cast<double>(i)), 0.0);
  const Similarity best = align_trajectory(truth, bent, Alignment::Yaw);
  const auto sum_with = [&](double turn, double rise_m) {
    Vector3d mean = Vector3d::Zero(), target = Vector3d::Zero();
    for (std::size_t i = 0; i < truth.size(); ++i) {
      mean += bent[i]->translation / 20.0;
      target += truth[i]->translation / 20.0;
    }
    Similarity near = best;
    near.rotation = yaw(turn) * best.rotation;
    near.translation = target - near.rotation * mean + Vector3d(0.0, 0.0, rise_m);
    double sum = 0.0;
    for (std::size_t i = 0; i < truth.size(); ++i)
      sum += (near * bent[i]->translation - truth[i]->translation).squaredNorm();
    return sum;
  };
  for (const double step : {-1e-4, 1e-4}) {
    EXPECT_GT(sum_with(step, 0.0), sum_with(0.0, 0.0));
    EXPECT_GT(sum_with(0.0, step), sum_with(0.0, 0.0));
  }
}

/// A smooth flight in closed form.
Pose flown_at(double time_s) {
  return {(AngleAxisd(0.4 * time_s, Vector3d::UnitZ()) *
           AngleAxisd(0.2 * std::sin(0.9 * time_s), Vector3d::UnitX()))
              .toRotationMatrix(),
          Vector3d(40.0 * std::sin(0.4 * time_s), 40.0 * std::cos(0.4 * time_s),
                   60.0 + std::sin(0.8 * time_s))};
}

TEST(TruthBetweenFrames, IsThatOfTheMotionWithinTheBound) {
  const std::vector<double> frames_s = times_at(60, 10.0), rows_s = times_at(1200, 203.0);
  Path frames;
  for (const double time_s : frames_s) frames.emplace_back(flown_at(time_s));
  for (const double bound_m : {1e-3, 3e-2}) {
    const TruthAtTimes truth = truth_at_times(frames, frames_s, rows_s, bound_m, 0.1);
    std::int64_t num_matched = 0;
    for (std::size_t i = 0; i < rows_s.size(); ++i) {
      if (!truth.poses[i]) continue;
      ++num_matched;
      const Pose is = flown_at(rows_s[i]);
      EXPECT_LE((truth.poses[i]->translation - is.translation).norm(), truth.worst_left_out_m);
      EXPECT_LE(
          degrees_from_radians(
              Quaterniond(truth.poses[i]->rotation).angularDistance(Quaterniond(is.rotation))),
          truth.worst_left_out_deg);
    }
    EXPECT_EQ(num_matched + truth.num_outside + truth.num_inexact, 1200);
    EXPECT_GT(num_matched, 900) << bound_m;
    EXPECT_EQ(truth.num_outside, 2);  // after 5.9 s: 1198 / 203 and 1199 / 203
    EXPECT_LE(truth.worst_left_out_m, bound_m);
  }
}

TEST(TruthBetweenFrames, ASharpTurnIsUnmatched) {
  const std::vector<double> frames_s = times_at(30, 10.0);
  Path frames;
  for (const double time_s : frames_s)
    frames.push_back(Pose{Matrix3d::Identity(),
                          Vector3d(10.0 * time_s, time_s < 1.5 ? 0.0 : time_s - 1.5, 0.0)});
  const std::vector<double> rows_s{1.0, 0.55, 1.45, 1.55, 2.45, -0.1, 3.1};
  const TruthAtTimes truth = truth_at_times(frames, frames_s, rows_s, 1e-3, 0.01);
  EXPECT_TRUE(truth.poses[0]);  // a frame's own time
  EXPECT_TRUE(truth.poses[1]);
  EXPECT_FALSE(truth.poses[2]);
  EXPECT_FALSE(truth.poses[3]);
  EXPECT_TRUE(truth.poses[4]);
  EXPECT_EQ(truth.num_inexact, 2);
  EXPECT_EQ(truth.num_outside, 2);
  std::vector<double> twice = frames_s;
  twice[7] = twice[6];
  EXPECT_THROW(truth_at_times(frames, twice, rows_s, 1e-3, 0.01), core::Error);
}

std::string tum_text(const Path& path, const std::vector<double>& times_s) {
  std::string text;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const Quaterniond q(path[i]->rotation);
    const Vector3d& t = path[i]->translation;
    text += fmt::format("{:.9f} {} {} {} {} {} {} {}\n", times_s[i], t.x(), t.y(), t.z(), q.x(),
                        q.y(), q.z(), q.w());
  }
  return text;
}

/// A long flight with drift and noise, in a dataset of KITTI.
class EvaluateDrift : public testing::Test {
 protected:
  static constexpr int kFrames = 60;

  void SetUp() override {
    test::Recording flown = test::wall_flight(kFrames, 50.0, {0.0, 0.0, 0.0});
    for (int i = 0; i < kFrames; ++i) {
      const auto f = static_cast<std::size_t>(i);
      const Pose pose = flown_at(0.1 * i);
      flown.body_world[f] = pose.translation;
      flown.world_from_body[f] = pose.rotation;
    }
    test::write_kitti(flown, scratch_ / "truth");
    for (std::size_t i = 0; i < kFrames; ++i) {
      truth_.push_back(Pose{flown.rotation(0, i), flown.centre(0, i)});
      const auto k = static_cast<double>(i);
      const Matrix3d off = (AngleAxisd(0.004 * k, Vector3d(0.2, 0.5, 0.8).normalized()) *
                            AngleAxisd(0.01 * std::sin(5.0 * k), Vector3d::UnitY()))
                               .toRotationMatrix();
      found_.push_back(
          Pose{off * truth_[i]->rotation, 0.9 * (off * truth_[i]->translation) +
                                              Vector3d(3.0, 4.0 + 0.1 * std::cos(3.0 * k), -5.0)});
    }
  }
  EvaluateOptions options(const fs::path& result) const {
    return {.task = "trajectory",
            .truth = scratch_ / "truth",
            .result = result,
            .drift_lengths_m = {10.0, 20.0, 40.0},
            .drift_stride_frames = 7};
  }

  ScratchFolder scratch_;
  Path truth_, found_;
};

TEST_F(EvaluateDrift, AnotherProgramHasTheSameFigures) {
  const std::vector<double> times_s = times_at(kFrames, 10.0);
  core::write_file(scratch_ / "is.txt", tum_text(truth_, times_s));
  core::write_file(scratch_ / "says.txt", tum_text(found_, times_s));
  for (const bool is_scaled : {false, true}) {
    const test::ProgramResult other = test::run_command(
        TERRACAST_NODE, {TERRACAST_SOURCE_DIR "/tests/validate/evaluate/trajectory_scores.mjs",
                         (scratch_ / "is.txt").string(), (scratch_ / "says.txt").string(),
                         is_scaled ? "1" : "0", "7", "10", "20", "40"});
    ASSERT_EQ(other.status, 0) << other.output;
    const core::Json scores = core::Json::parse(other.output, "scores");
    EvaluateOptions own = options(scratch_ / "says.txt");
    own.align = is_scaled ? Alignment::Sim3 : Alignment::Se3;
    const Evaluation evaluation = test::evaluate(own);
    const auto expect = [&](const char* measure, const char* key) {
      // Poses of the dataset have 12 digits and places 1e-6 m, over the shortest segment's 10 m.
      const double value = scores.at(key).number();
      EXPECT_GT(value, 0.0);
      EXPECT_NEAR(test::figure(evaluation, measure), value, 1e-5 * (1.0 + value)) << measure;
    };
    expect("ATE", "ate");
    expect("RPE", "rpe");
    expect("RPE turn", "rpe_deg");
    expect("t_rel", "t_rel");
    expect("r_rel", "r_rel");
    expect("t_drift", "t_drift");
    expect("r_drift", "r_drift");
    for (const auto& [name, value] : evaluation.subjects[0].found)
      if (name == "scale") {
        EXPECT_NEAR(value, scores.at("scale").number(), 1e-6);
      }
  }
}

TEST_F(EvaluateDrift, RowsBetweenFramesAreComparedAtTheirOwnTimes) {
  // 97 Hz: all but the first row lie between frames. The camera of KITTI's rig, as of the frames.
  const Matrix3d body_from_camera = flown_at(0.0).rotation.transpose() * truth_[0]->rotation;
  const Vector3d camera_body =
      flown_at(0.0).rotation.transpose() * (truth_[0]->translation - flown_at(0.0).translation);
  const std::vector<double> times_s = times_at(560, 97.0);
  Path rows;
  for (const double time_s : times_s) {
    const Pose body = flown_at(time_s);
    rows.push_back(
        Pose{body.rotation * body_from_camera, body.rotation * camera_body + body.translation});
  }
  core::write_file(scratch_ / "fast.txt", tum_text(rows, times_s));
  EvaluateOptions own = options(scratch_ / "fast.txt");
  own.is_at_result_times = true;
  own.align = Alignment::None;
  const Evaluation evaluation = test::evaluate(own);
  // Left-out frames bound the truth by 1 mm; at half their step it is a sixteenth.
  EXPECT_LT(test::figure(evaluation, "ATE"), 1e-4);
  EXPECT_GT(evaluation.rows.back().num_answered_frames, 400);
  EXPECT_THAT(test::notes_of(evaluation),
              HasSubstr("of 560 rows are compared, at their own times"));
  // To the last frame, at 5.9 s, 13 rows are lacking, most of them where no truth is known.
  EXPECT_THAT(test::notes_of(evaluation), HasSubstr("13 more would fill its gaps"));
  // As rows of frames they are up to 5 ms late, 0.08 m, and that is said.
  own.is_at_result_times = false;
  const Evaluation nearest = test::evaluate(own);
  EXPECT_GT(test::figure(nearest, "ATE"), 0.01);
  EXPECT_THAT(test::notes_of(nearest), HasSubstr("s from their frames'"));
  own.is_at_result_times = true;
  own.max_truth_error_m = 0.0;
  own.time_offset_s = 0.001;  // no row at a frame's own time
  EXPECT_THROW(test::evaluate(own), core::Error);
  own.time_offset_s = 0.0;
  core::write_file(scratch_ / "fast.txt", "0 0 0 0 0 0 0 1\n0 0 0 0 0 0 0 1\n");
  EXPECT_THROW(test::evaluate(own), core::Error);  // not sorted
  core::write_file(scratch_ / "fast.txt", "0 0 0 0 0 0 0\n");
  EXPECT_THROW(test::evaluate(own), core::Error);  // no times
}

/// Rows of 1 s at each end of the flight: what lies between is missing, no step and no segment crosses it.
TEST_F(EvaluateDrift, AGapOfTheRowsIsMissingAndNotBridged) {
  // Rows at frames' own times have a truth to the last bit; 10 Hz.
  const std::vector<double> times_s = times_at(kFrames, 10.0);
  Path rows;
  std::vector<double> rows_s;
  for (std::size_t i = 0; i < kFrames; ++i)
    if (i < 10 || i >= 50) {
      rows.push_back(truth_[i]);
      rows_s.push_back(times_s[i]);
    }
  core::write_file(scratch_ / "gap.txt", tum_text(rows, rows_s));
  EvaluateOptions own = options(scratch_ / "gap.txt");
  own.is_at_result_times = true;
  own.drift_lengths_m = {10.0, 10.0, 40.0};
  own.drift_stride_frames = 1;
  const fs::path report = scratch_ / "report";
  const Evaluation at_rows = test::evaluate(own, report);
  EXPECT_EQ(at_rows.rows.back().num_answered_frames, 20);
  EXPECT_EQ(at_rows.rows.back().num_frames, kFrames);
  EXPECT_THAT(test::notes_of(at_rows), HasSubstr("40 of 60 rows are missing"));
  EXPECT_THAT(test::notes_of(at_rows), HasSubstr("(1 s, 1.1 s, "));
  const core::Json json = core::Json::read(report / "report.json");
  EXPECT_NEAR(json.at("subjects").at(0).at("frames").at(59).at("time_s").number(), 5.9, 1e-12);
  // The same poses by frames have the same steps, segments and lost ends.
  own.is_at_result_times = false;
  const Evaluation at_frames = test::evaluate(own);
  EXPECT_EQ(at_rows.subjects[0].found, at_frames.subjects[0].found);
  std::int64_t num_steps = 0;
  for (const FrameScore& frame : at_rows.subjects[0].frames) num_steps += frame.sums[2].count;
  EXPECT_EQ(num_steps, 18);
  EXPECT_THAT(test::notes_of(at_rows), HasSubstr("segments have an end without pose"));
  // A length given twice counts once.
  std::size_t num_keys = 0;
  for (const auto& [name, value] : at_rows.subjects[0].found)
    num_keys += name == "t_rel of 10 m" ? 1 : 0;
  EXPECT_EQ(num_keys, 1U);
}

/// A long path of which all ends are lost is not called short.
TEST_F(EvaluateDrift, LostEndsAreNotAShortPath) {
  const std::vector<double> times_s = times_at(kFrames, 10.0);
  const Path start(truth_.begin(), truth_.begin() + 5);
  core::write_file(scratch_ / "start.txt", tum_text(start, {times_s.begin(), times_s.begin() + 5}));
  EvaluateOptions own = options(scratch_ / "start.txt");
  own.drift_lengths_m = {40.0};
  const Evaluation evaluation = test::evaluate(own);
  EXPECT_THAT(test::notes_of(evaluation), HasSubstr("segments have an end without pose"));
  EXPECT_THAT(test::notes_of(evaluation), testing::Not(HasSubstr("--drift-length-m")));
}

TEST_F(EvaluateDrift, AShortPathHasNoSegmentsAndSaysSo) {
  core::write_file(scratch_ / "says.txt", tum_text(found_, times_at(kFrames, 10.0)));
  EvaluateOptions own = options(scratch_ / "says.txt");
  own.drift_lengths_m = {800.0, 500.0};
  const Evaluation evaluation = test::evaluate(own);
  EXPECT_EQ(test::figure(evaluation, "t_rel"), -1.0);  // nothing
  EXPECT_THAT(test::notes_of(evaluation),
              HasSubstr("m, has no segment of 500 m (--drift-length-m)"));
  EXPECT_THAT(test::notes_of(evaluation), HasSubstr("not scaled; sim3 would scale by 1.1"));
}

TEST_F(EvaluateDrift, StepsOfALengthCountMetres) {
  core::write_file(scratch_ / "says.txt", tum_text(truth_, times_at(kFrames, 10.0)));
  EvaluateOptions own = options(scratch_ / "says.txt");
  own.rpe_delta_m = 5.0;
  const Evaluation evaluation = test::evaluate(own);
  EXPECT_LT(test::figure(evaluation, "RPE"), 1e-5);
  // 16 m/s, 10 Hz: four frames a step, so the last four have none.
  std::size_t num_steps = 0;
  for (const FrameScore& frame : evaluation.subjects[0].frames)
    num_steps += static_cast<std::size_t>(frame.sums[2].count);
  EXPECT_EQ(num_steps, 56U);
}

}  // namespace
}  // namespace terracast::validate
