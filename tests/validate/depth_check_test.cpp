#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>

#include "tests/validate/still_images.h"

/// Steps and limits in single depth images of surfaces in closed form.
namespace terracast::validate {
namespace {

constexpr int kWidth = 160, kHeight = 120;

using DepthAt = std::function<double(int x, int y)>;

/// A result of the check of depths as numbers, of two alike images of a camera that looks ahead.
CheckResult result_of(const std::string& name, const DepthAt& depth_m) {
  LoadedImage image;
  image.depth = core::ImageF(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) image.depth(x, y) = static_cast<float>(depth_m(x, y));
  const FrameImages images{std::make_shared<const LoadedImage>(std::move(image))};
  Sequence sequence = still_scene(kWidth, kHeight);
  const Eigen::Matrix3d ahead =
      Eigen::AngleAxisd(-1.0, Eigen::Vector3d::UnitX()).toRotationMatrix();
  for (auto& pose : sequence.cameras[0].local_from_camera) pose->rotation = ahead;
  for (FrameFiles& files : sequence.cameras[0].files) files.depth = "depth.npy";
  return result_of("depth", name, sequence, images, images);
}

double hills_m(int x, int y) {
  return 80.0 + 0.4 * y + 6.0 * std::sin(0.11 * x) * std::cos(0.07 * y) + 0.01 * x;
}
/// Level ground by a camera that does not roll: equally deep along rows.
double level_m(int, int y) { return 100.0 / (0.2 + 0.004 * y); }

TEST(DepthLevels, AreToldFromLevelGround) {
  for (const DepthAt& right : {DepthAt(hills_m), DepthAt(level_m)}) {
    const CheckResult levels = result_of("depth_levels", right);
    EXPECT_TRUE(levels.ok && !levels.skipped) << levels.value << levels.worst;
    EXPECT_NEAR(levels.value, 1.0, 0.05);
    // Depth quantised to 8, 9 and 10 bits.
    for (const double num_steps : {255.0, 511.0, 1023.0}) {
      if (right(3, 7) == right(9, 7)) continue;  // of level ground steps are lines too
      const double step_m = 70.0 / num_steps;
      const CheckResult wrong = result_of(
          "depth_levels", [&](int x, int y) { return step_m * std::round(right(x, y) / step_m); });
      EXPECT_FALSE(wrong.ok) << num_steps << ": " << wrong.value;
    }
  }
}

// From 10 km above level ground, all but straight down, float32 has a step for every sixth pixel.
TEST(DepthLevels, AreNotAskedWhereFloatsAreTooCoarse) {
  const CheckResult levels =
      result_of("depth_levels", [](int x, int y) { return 10000.0 + 0.003 * x + 0.004 * y; });
  EXPECT_TRUE(levels.ok && levels.is_unseen) << levels.value;
}

TEST(DepthLimit, IsToldFromTheFarthestLineOfLevelGround) {
  for (const DepthAt& right : {DepthAt(hills_m), DepthAt(level_m)}) {
    const CheckResult limit = result_of("depth_limit", right);
    EXPECT_TRUE(limit.ok && !limit.skipped) << limit.value << limit.worst;
    const CheckResult wrong = result_of("depth_limit", [&](int x, int y) {
      return std::min(right(x, y), right(80, 0) - 0.2 * (right(80, 0) - right(80, 119)));
    });
    EXPECT_FALSE(wrong.ok) << wrong.value;
  }
}

}  // namespace
}  // namespace terracast::validate
