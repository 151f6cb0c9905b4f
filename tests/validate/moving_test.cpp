#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/validate/still_images.h"

/// What moves, in images that are made here of a camera and a body that both stand still.
namespace terracast::validate {
namespace {

constexpr int kWidth = 48, kHeight = 40;
constexpr int kLeft = 10, kTop = 8, kSide = 24;  // of the body in the image

/// A hull 30 m before the camera, ground behind it.
/// depth_m  of the body at a pixel of it
template <class Depth>
FrameImages image_of(int left, const Depth& depth_m) {
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  LoadedImage image;
  image.depth = core::ImageF(kWidth, kHeight, 1, 90.0F);
  image.moving = core::Image16(kWidth, kHeight, 1, 0);
  image.moving_depth = core::ImageF(kWidth, kHeight, 1, kNone);
  for (int y = kTop; y < kTop + kSide; ++y)
    for (int x = left; x < left + kSide; ++x) {
      image.depth(x, y) = kNone;
      image.moving(x, y) = 1;
      image.moving_depth(x, y) = static_cast<float>(depth_m(x, y));
    }
  return {std::make_shared<const LoadedImage>(std::move(image))};
}

CheckResult result_of(const std::string& name, const FrameImages& first,
                      const FrameImages& second) {
  Sequence sequence = still_scene(kWidth, kHeight);
  sequence.moving = Moving{.names = {"helicopter"}, .masks = "moving", .states = {}};
  sequence.moving->states.assign(2, {MovingState{}});
  return result_of("moving", name, sequence, first, second);
}
CheckResult seen_through(const FrameImages& first, const FrameImages& second) {
  return result_of("moving_see_through", first, second);
}

/// The image with the flow of what stands still, all of it called co-visible.
FrameImages with_flow(const FrameImages& images) {
  LoadedImage image = *images[0];
  FlowFields flow;
  flow.forward = core::ImageF(kWidth, kHeight, 2, 0.0F);
  flow.in_view_forward = core::Image8(kWidth, kHeight, 1, 1);
  flow.covisible_forward = core::Image8(kWidth, kHeight, 1, 1);
  image.flow = std::make_shared<const FlowFields>(std::move(flow));
  return {std::make_shared<const LoadedImage>(std::move(image))};
}

double hull(int, int) { return 30.0; }
/// Wires 2 m before the hull, thinner than a pixel: the centres of one pixel in `step` meet one.
auto with_wires(int step, int offset) {
  return [=](int x, int y) { return (x + offset) % step == 0 && y % 2 == 0 ? 28.0 : 30.0; };
}

// 5.9 % of a helicopter of 68 pixels were seen through: its skids, before its hull.
TEST(MovingSeeThrough, LeavesOutWhatIsThinnerThanAPixel) {
  const CheckResult result = seen_through(image_of(kLeft, with_wires(5, 0)), image_of(kLeft, hull));
  EXPECT_FALSE(result.skipped) << result.worst;
  EXPECT_TRUE(result.ok) << result.value;
  EXPECT_EQ(result.value, 0.0);
}

TEST(MovingSeeThrough, FindsABodyThatStandsElsewhere) {
  // By five pixels of 24: of the points whose 3 x 3 pixels show the body three columns of 22 see the ground.
  const CheckResult result = seen_through(image_of(kLeft, hull), image_of(kLeft + 5, hull));
  EXPECT_FALSE(result.ok);
  EXPECT_NEAR(result.value, 3.0 / 22.0, 1.0 / 22.0);
  // A slanted side is one side: nearer by 0.8 m a pixel.
  const auto slanted = [](int x, int) { return 60.0 - 0.8 * x; };
  const auto farther = [&](int x, int y) { return slanted(x, y) + 4.0; };
  EXPECT_FALSE(seen_through(image_of(kLeft, slanted), image_of(kLeft, farther)).ok);
}

// Three pixels of 97 000 made a right dataset wrong: gaps of a helicopter's tail between pixels' centres.
TEST(MovingFlow, WhatIsSeenBetweenPixelsIsNoContradiction) {
  const FrameImages shown = with_flow(image_of(kLeft, hull));
  const auto rough = [](int x, int y) { return (x + y) % 2 == 0 ? 25.0 : 26.0; };
  const CheckResult between = result_of("moving_flow", shown, image_of(kLeft, rough));
  EXPECT_FALSE(between.skipped) << between.worst;
  EXPECT_TRUE(between.ok) << between.worst;
  const CheckResult behind =
      result_of("moving_flow", shown, image_of(kLeft, [](int, int) { return 25.0; }));
  EXPECT_FALSE(behind.ok);
  EXPECT_NE(behind.worst.find("something nearer"), std::string::npos) << behind.worst;
}

// ---- moving.csv against its own poses

constexpr int kNumRows = 40;
constexpr double kStep_s = 0.1;

/// A body that goes ahead in waves of height, or at one; turned a little, as sequences' frames are to the world's.
/// is_settled   its motion is stated as that of what rides the ground: vertical velocities over 0.1 s, no acceleration
///              up or down
std::vector<MovingState> waves(double height_m, bool is_settled) {
  const Eigen::Matrix3d local_from_world =
      Eigen::AngleAxisd(5e-3, Eigen::Vector3d(1.0, 2.0, 0.0).normalized()).toRotationMatrix();
  constexpr double kSpeed_mps = 10.0, kPull_mps2 = 0.5, kRate_radps = 2.0, kSettle_s = 0.05;
  const auto z = [&](double t) { return height_m * std::sin(kRate_radps * t); };
  std::vector<MovingState> states;
  for (int i = 0; i < kNumRows; ++i) {
    const double t = kStep_s * i;
    MovingState state;
    state.local_from_body = {
        local_from_world,
        local_from_world * Eigen::Vector3d(kSpeed_mps * t + 0.5 * kPull_mps2 * t * t, 30.0, z(t))};
    state.motion.velocity_mps = {kSpeed_mps + kPull_mps2 * t, 0.0,
                                 height_m * kRate_radps * std::cos(kRate_radps * t)};
    state.motion.acceleration_mps2 = {kPull_mps2, 0.0, -kRate_radps * kRate_radps * z(t)};
    if (is_settled) {
      state.motion.velocity_mps.z() = (z(t + kSettle_s) - z(t - kSettle_s)) / (2.0 * kSettle_s);
      state.motion.acceleration_mps2.z() = 0.0;
    }
    states.push_back(state);
  }
  return states;
}

CheckResult motion_of(const std::string& name,
                      const std::vector<std::vector<MovingState>>& bodies) {
  Sequence sequence = still_scene(kWidth, kHeight);
  sequence.rate_hz = 1.0 / kStep_s;
  sequence.moving = Moving{.names = {}, .masks = "moving", .states = {}};
  sequence.moving->states.resize(kNumRows);
  for (const std::vector<MovingState>& states : bodies) {
    sequence.moving->names.push_back("body" + std::to_string(sequence.moving->names.size()));
    sequence.moving->bodies.emplace_back();
    for (std::size_t i = 0; i < states.size(); ++i)
      sequence.moving->states[i].emplace_back(states[i]);
  }
  const FrameImages none = image_of(kLeft, hull);
  return result_of("moving_bodies", name, sequence, none, none);
}

TEST(MovingMotion, OfWhatRidesTheGroundTheMotionAlongItIsJudged) {
  const auto rides = waves(0.5, true), flies = waves(0.5, false);
  for (const char* name : {"moving_velocity", "moving_acceleration", "moving_turn_rate"}) {
    const bool is_turn = std::string(name) == "moving_turn_rate";
    const CheckResult alone = motion_of(name, {rides});
    EXPECT_EQ(alone.is_unseen, is_turn) << name << ": " << alone.worst;
    EXPECT_TRUE(alone.ok) << name << ": " << alone.value;
    const CheckResult both = motion_of(name, {rides, flies});
    EXPECT_FALSE(both.skipped) << name << ": " << both.worst;
    EXPECT_TRUE(both.ok) << name << ": " << both.value;
    EXPECT_NE(both.summary.find("1 that ride"), std::string::npos) << both.summary;
  }
  std::vector<MovingState> wrong = rides;
  for (MovingState& state : wrong) state.motion.velocity_mps.x() *= 1.002;
  EXPECT_FALSE(motion_of("moving_velocity", {wrong}).ok);
}

TEST(MovingMotion, WhatRidesAtOneSpeedStraightOnIsLeftOut) {
  std::vector<MovingState> rides = waves(0.5, true);
  for (std::size_t i = 0; i < rides.size(); ++i) {
    rides[i].local_from_body.translation.x() = 10.0 * kStep_s * static_cast<double>(i);
    rides[i].motion.velocity_mps.x() = 10.0;
    rides[i].motion.acceleration_mps2.x() = 0.0;
  }
  for (const char* name : {"moving_velocity", "moving_acceleration", "moving_turn_rate"}) {
    const CheckResult alone = motion_of(name, {rides});
    EXPECT_TRUE(alone.is_unseen && alone.ok) << name;
    EXPECT_NE(alone.worst.find("rides the ground"), std::string::npos) << alone.worst;
  }
}

TEST(MovingMotion, MistakesOfWhatFliesAreFound) {
  std::vector<MovingState> states = waves(0.5, false);
  for (MovingState& state : states) state.motion.velocity_mps *= 1.002;
  const CheckResult result = motion_of("moving_velocity", {states});
  EXPECT_FALSE(result.skipped) << result.worst;
  EXPECT_FALSE(result.ok) << result.value;
}

}  // namespace
}  // namespace terracast::validate
