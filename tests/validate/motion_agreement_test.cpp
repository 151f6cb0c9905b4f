#include "validate/checks/motion_agreement.h"

#include <gtest/gtest.h>

#include <cmath>

namespace terracast::validate {
namespace {

using Eigen::Vector3d;

constexpr double kStep_s = 0.188;

/// A body that flies straight on and begins to climb at the first frame: its acceleration is 0.7 (1 - exp(-t / 0.12)) m/s^2,
/// whose integrals are its velocity and its height.
std::vector<std::optional<StatedMotion>> beginning_to_climb(int num_frames, double off_mps2 = 0.0) {
  constexpr double kMost_mps2 = 0.7, kTime_s = 0.12, kAhead_mps = 31.0;
  std::vector<std::optional<StatedMotion>> motions;
  for (int i = 0; i < num_frames; ++i) {
    const double t = i * kStep_s;
    const double late = 1.0 - std::exp(-t / kTime_s);
    const double climb_mps = kMost_mps2 * (t - kTime_s * late);
    const double height_m = kMost_mps2 * (0.5 * t * t - kTime_s * (t - kTime_s * late));
    motions.push_back(
        StatedMotion{.local_from_body = {.rotation = Eigen::Matrix3d::Identity(),
                                         .translation = Vector3d(kAhead_mps * t, 0.0, height_m)},
                     .velocity_mps = {kAhead_mps, 0.0, climb_mps},
                     .acceleration_mps2 = {0.0, 0.0, kMost_mps2 * late + off_mps2},
                     .turn_body_radps = Vector3d::Zero()});
  }
  return motions;
}

CheckResult acceleration_of(const std::vector<std::optional<StatedMotion>>& motions) {
  return motion_result(motions, kStep_s, kAcceleration, 1.0,
                       {"motion_acceleration", 0.05, "m/s^2", "", "", ""});
}

// What the acceleration does within a step is no mistake, though half of five frames' steps are such.
TEST(MotionAgreement, IsUnseenWhereFiveFramesAreABodysBeginning) {
  for (const int num_frames : {4, 5})
    EXPECT_TRUE(acceleration_of(beginning_to_climb(num_frames)).ok);
}

TEST(MotionAgreement, FindsGravityInAccelerationsThere) {
  for (const int num_frames : {4, 5, 9})
    EXPECT_FALSE(acceleration_of(beginning_to_climb(num_frames, 9.81)).ok) << num_frames;
}

// Later the body climbs evenly, so that a tenth of a metre a second squared shows.
TEST(MotionAgreement, OfMoreFramesFindsWhatIsSmall) {
  EXPECT_TRUE(acceleration_of(beginning_to_climb(12)).ok);
  EXPECT_FALSE(acceleration_of(beginning_to_climb(12)).is_unseen);
  EXPECT_FALSE(acceleration_of(beginning_to_climb(12, 0.1)).ok);
}

}  // namespace
}  // namespace terracast::validate
