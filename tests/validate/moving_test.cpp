#include <gtest/gtest.h>

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

}  // namespace
}  // namespace terracast::validate
