#include <gtest/gtest.h>

#include "tests/validate/still_images.h"

/// Masks of what both of two images see, of a camera that stands still before a surface.
namespace terracast::validate {
namespace {

constexpr int kWidth = 64, kHeight = 48;
constexpr float kGround_m = 90.0F;

/// The check of co-visible pixels, of which a mask claims some.
/// depth_m   of the second image at a pixel; the first one's is the ground's
template <class Depth, class Claims>
CheckResult covisible(const Depth& depth_m, const Claims& claims) {
  LoadedImage first, second;
  first.depth = core::ImageF(kWidth, kHeight, 1, kGround_m);
  second.depth = first.depth;
  FlowFields flow;
  flow.forward = core::ImageF(kWidth, kHeight, 2, 0.0F);
  flow.in_view_forward = core::Image8(kWidth, kHeight, 1, 1);
  flow.covisible_forward = core::Image8(kWidth, kHeight, 1, 0);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      second.depth(x, y) = depth_m(x, y);
      flow.covisible_forward(x, y) = claims(x, y) ? 1 : 0;
    }
  first.flow = std::make_shared<const FlowFields>(std::move(flow));
  return result_of("flow", "flow_covisible", still_scene(kWidth, kHeight),
                   {std::make_shared<const LoadedImage>(std::move(first))},
                   {std::make_shared<const LoadedImage>(std::move(second))});
}

float bare(int, int) { return kGround_m; }

TEST(FlowCovisible, NamesAMaskThatClaimsTooLittle) {
  const auto all_but = [](int step) {
    return [=](int x, int y) { return (y * kWidth + x) % step != 0; };
  };
  const CheckResult one_in_20 = covisible(bare, all_but(20));
  EXPECT_FALSE(one_in_20.ok);
  EXPECT_NEAR(one_in_20.value, 1.0 / 20.0, 1e-3);  // of 64 x 48, of which a border is not asked
  const CheckResult one_in_101 = covisible(bare, all_but(101));
  EXPECT_TRUE(one_in_101.ok);
  EXPECT_NEAR(one_in_101.value, 1.0 / 101.0, 1e-3);
}

// Seen in November 2026: over fields of grain a right dataset had 2.4 in 100 pixels that agreed in depth and were hidden.
TEST(FlowCovisible, AsksNothingBetweenBladesThatAreFinerThanPixels) {
  // Half of the image is stubble: each second column shows blades 12 cm nearer, and ground between
  // them that blades hide from the second image.
  const auto stubble = [](int x, int) {
    return x < kWidth / 2 && x % 2 == 0 ? kGround_m - 0.12F : kGround_m;
  };
  const auto beside_it = [](int x, int) { return x >= kWidth / 2; };
  const CheckResult right = covisible(stubble, beside_it);
  EXPECT_TRUE(right.ok) << right.value;
  EXPECT_FALSE(right.is_unseen);
  // The smooth half is asked for all the same.
  const CheckResult wrong = covisible(stubble, [](int x, int) { return x >= 3 * kWidth / 4; });
  EXPECT_FALSE(wrong.ok);
}

}  // namespace
}  // namespace terracast::validate
