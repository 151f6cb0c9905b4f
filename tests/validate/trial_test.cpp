#include "validate/causes/trial.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "core/atomic_file.h"
#include "core/image_io.h"
#include "tests/support/test_data.h"
#include "validate/sequence_part.h"

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

// A trial that left out what moves ended the program where its masks were read, and one without the steps of stored
// flow held right flow against too narrow a bound.
TEST(Trial, IsOfAllThatTheSequenceSays) {
  const test::ScratchFolder scratch;
  Sequence sequence = straight_flight(40, 0.0);
  sequence.rate_hz = 4.0;
  sequence.moving = Moving{.names = {"car", "van"}, .masks = "masks", .states = {}};
  sequence.moving->states.resize(40);
  Camera& camera = sequence.cameras[0];
  camera.flow_step_px = 1.0 / 64;
  camera.flow_reach_px = 512.0;
  camera.imaging.red_scale = 1.01;
  for (int f = 0; f < 40; ++f) {
    const auto i = static_cast<std::size_t>(f);
    BodyMotion motion;
    motion.velocity_mps.x() = f;
    sequence.motion.emplace_back(motion);
    MovingState state;
    state.local_from_body.translation.y() = f;
    sequence.moving->states[i] = {std::nullopt, state};
    sequence.times_s.push_back(0.25 * f);
    camera.stamps_s.push_back(0.25 * f + 0.01);
    camera.files[i].moving = fmt::format("{:02}.png", f);
    core::Image16 mask(64, 48, 1, 0);
    mask(f, 7) = 2;
    core::write_file(scratch / camera.files[i].moving, core::encode_png(mask));
  }
  Dataset dataset;
  dataset.root = scratch.path();
  dataset.format = "tartanair";
  CheckResult failed;
  failed.name = "moving_flow";
  failed.worst = "cam0, frame 30";
  const Trial trial = make_trial(dataset, sequence, {failed});
  const int first = trial.first_frame;
  ASSERT_GT(first, 20);
  ASSERT_EQ(trial.num_frames(), 6);
  const Camera& part = trial.camera(0);
  EXPECT_EQ(part.flow_step_px, 1.0 / 64);
  EXPECT_EQ(part.flow_reach_px, 512.0);
  EXPECT_EQ(part.imaging.red_scale, 1.01);
  ASSERT_TRUE(trial.sequence.moving);
  EXPECT_EQ(trial.sequence.moving->names.size(), 2u);
  for (int f = 0; f < 6; ++f) {
    const auto i = static_cast<std::size_t>(f);
    EXPECT_EQ(trial.sequence.times_s[i], 0.25 * f);
    EXPECT_NEAR(part.stamps_s[i], 0.25 * f + 0.01, 1e-12);
    EXPECT_EQ(trial.sequence.motion[i]->velocity_mps.x(), first + f);
    EXPECT_EQ(trial.sequence.moving->state(f, 1), nullptr);
    ASSERT_NE(trial.sequence.moving->state(f, 2), nullptr);
    EXPECT_EQ(trial.sequence.moving->state(f, 2)->local_from_body.translation.y(), first + f);
    EXPECT_EQ(trial.image(0, f).body_at(first + f, 7), 2) << "the mask of its own frame";
  }
}

TEST(Trial, LooksAtTheCamerasThatFailedAndAtTheirNeighbours) {
  Sequence sequence = straight_flight(3, 0.0);
  const Camera camera = sequence.cameras[0];
  sequence.cameras.clear();
  for (int c = 0; c < 40; ++c) {
    sequence.cameras.push_back(camera);
    sequence.cameras.back().name = fmt::format("rig/cam{}", c);
    sequence.cameras.back().files[1].depth = fmt::format("depth/{}/1.npy", c);
  }
  sequence.stereo = StereoPair{.left = 20, .right = 21, .baseline_m = 0.5};
  Dataset dataset;
  dataset.format = "tartanair";
  CheckResult pair, file;
  pair.name = "photometric_channels";
  pair.worst = "rig/cam17 in rig/cam3";  // names no cam1
  file.name = "structure";
  file.worst = "depth/30/1.npy: a depth that is none";
  const Trial trial = make_trial(dataset, sequence, {pair, file});
  std::vector<std::string> names;
  for (const Camera& one : trial.sequence.cameras) names.push_back(one.name);
  // Named are 3, 17 and 30; the pair's are 20 and 21; of the neighbours the nearest come first.
  EXPECT_EQ(names, (std::vector<std::string>{"rig/cam2", "rig/cam3", "rig/cam4", "rig/cam17",
                                             "rig/cam18", "rig/cam20", "rig/cam21", "rig/cam30"}));
  EXPECT_EQ(trial.num_cameras_left_out, 32);
  ASSERT_TRUE(trial.sequence.stereo);
  EXPECT_EQ(trial.sequence.stereo->left, 5);
  EXPECT_EQ(trial.sequence.stereo->right, 6);
  EXPECT_EQ(trial.camera_names({0, 1, 2, 3, 4, 5, 6, 7}), "all 8 cameras that were looked at");
  // Of few cameras all are.
  sequence.cameras.resize(8);
  sequence.stereo.reset();
  const Trial whole = make_trial(dataset, sequence, {pair});
  EXPECT_EQ(whole.num_cameras(), 8);
  EXPECT_EQ(whole.camera_names({0, 1, 2, 3, 4, 5, 6, 7}), "all cameras");
}

/// A trial of two cameras that look down on a plane side by side, with colours of it.
Trial trial_of_a_plane(Effort* effort) {
  static Dataset dataset;
  dataset.format = "tartanair";
  Trial trial;
  trial.dataset = &dataset;
  trial.effort = effort;
  trial.sequence = straight_flight(3, 0.0);
  trial.sequence.cameras.push_back(trial.sequence.cameras[0]);
  trial.sequence.cameras[1].name = "cam1";
  LoadedImage image;
  image.depth = core::ImageF(64, 48, 1, 100.0F);
  image.color = core::Image8(64, 48, 3, 100);
  image.grey = core::ImageF(64, 48, 1, 100.0F);
  trial.images.assign(3, FrameImages(2, std::make_shared<const LoadedImage>(image)));
  return trial;
}

TEST(Effort, CountsPairsByChecksAndEndsAtItsBound) {
  // Of 3 frames of 2 cameras 2 pairs share a time, and 2 of each camera each step: 2 + 6 + 6 pairs.
  constexpr std::int64_t kPairs = 14;
  Effort enough(2 * kPairs + kPairs);
  measure(trial_of_a_plane(&enough), {"reprojection", "photometric"});
  EXPECT_EQ(enough.spent(), 2 * kPairs);
  depth_disagreement(trial_of_a_plane(&enough));
  EXPECT_EQ(enough.spent(), 3 * kPairs);
  EXPECT_THROW(depth_disagreement(trial_of_a_plane(&enough)), EffortSpent);
  EXPECT_LE(enough.spent(), enough.bound());
  // Checks of poses alone compare no images.
  Effort none(0);
  measure(trial_of_a_plane(&none), {"calibration", "trajectory"});
  EXPECT_EQ(none.spent(), 0);
}

}  // namespace
}  // namespace terracast::validate
