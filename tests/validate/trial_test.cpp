#include "validate/causes/trial.h"

#include <gtest/gtest.h>

/// Frames of a long flight that a diagnosis looks at.
namespace terracast::validate {
namespace {

/// A camera on the body, 4 m a frame along a straight line from `start_m`.
Sequence straight_flight(int num_frames, double start_m) {
  Sequence sequence;
  sequence.name = "P000";
  sequence.num_frames = num_frames;
  sequence.rate_hz = 1.0;
  Camera camera;
  camera.name = "cam0";
  camera.intrinsics = {64, 48, 50.0, 50.0, 32.0, 24.0};
  camera.body_from_camera = Pose{};
  camera.files.resize(static_cast<std::size_t>(num_frames));
  for (int f = 0; f < num_frames; ++f)
    camera.local_from_camera.emplace_back(
        Pose{Eigen::Matrix3d::Identity(), {start_m + 4.0 * f, 0.0, 0.0}});
  sequence.cameras.push_back(camera);
  return sequence;
}

Trial trial_at(const std::string& format, const Sequence& sequence, int frame) {
  static Dataset dataset;
  dataset.format = format;
  CheckResult failed;
  failed.name = "georeference_position";
  failed.worst = "cam0, frame " + std::to_string(frame);
  return make_trial(dataset, sequence, {failed});
}

// Which of two that contradict each other is a frame off the origin tells, wherever they do.
TEST(Trial, KnowsInTheMiddleOfAFlightWhetherItsPosesBeginAtTheOrigin) {
  const Trial late = trial_at("tartanair", straight_flight(40, 0.0), 30);
  EXPECT_GT(late.first_frame, 20);
  EXPECT_TRUE(late.begins_at_origin);
  EXPECT_FALSE(trial_at("tartanair", straight_flight(40, 4.0), 30).begins_at_origin);
  EXPECT_FALSE(trial_at("tartanair", straight_flight(40, -4.0), 0).begins_at_origin);
  // georeference.csv places these.
  EXPECT_FALSE(trial_at("kitti", straight_flight(40, 0.0), 0).begins_at_origin);
}

}  // namespace
}  // namespace terracast::validate
