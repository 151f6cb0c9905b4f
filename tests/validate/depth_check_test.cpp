#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "tests/validate/still_images.h"

/// Steps and limits in single depth images of surfaces in closed form.
namespace terracast::validate {
namespace {

constexpr int kWidth = 160, kHeight = 120;

using DepthAt = std::function<double(int x, int y)>;

/// A result of the check of depths as numbers, of two alike images of each of some cameras that look ahead.
CheckResult result_of(const std::string& name, const std::vector<DepthAt>& depths_m) {
  FrameImages images;
  for (const DepthAt& depth_m : depths_m) {
    LoadedImage image;
    image.depth = core::ImageF(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) image.depth(x, y) = static_cast<float>(depth_m(x, y));
    images.push_back(std::make_shared<const LoadedImage>(std::move(image)));
  }
  Sequence sequence = still_scene(kWidth, kHeight);
  const Eigen::Matrix3d ahead =
      Eigen::AngleAxisd(-1.0, Eigen::Vector3d::UnitX()).toRotationMatrix();
  for (auto& pose : sequence.cameras[0].local_from_camera) pose->rotation = ahead;
  for (FrameFiles& files : sequence.cameras[0].files) files.depth = "depth.npy";
  sequence.cameras.resize(depths_m.size(), sequence.cameras[0]);
  for (std::size_t i = 0; i < depths_m.size(); ++i)
    sequence.cameras[i].name = "cam" + std::to_string(i);
  return result_of("depth", name, sequence, images, images);
}

CheckResult result_of(const std::string& name, const DepthAt& depth_m) {
  return result_of(name, std::vector<DepthAt>{depth_m});
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

// Of four cameras one is rounded, cut off, or shows too little.
TEST(DepthNumbers, AreJudgedByTheWorstCamera) {
  const DepthAt rounded = [](int x, int y) { return std::round(hills_m(x, y)); };
  const DepthAt cut = [](int x, int y) { return std::min(hills_m(x, y), hills_m(80, 90)); };
  const DepthAt centimetres = [](int x, int y) { return 0.01 * std::round(100.0 * hills_m(x, y)); };
  const DepthAt sky = [](int, int) { return std::numeric_limits<double>::infinity(); };
  const DepthAt little = [](int x, int y) {
    return y > 117 ? hills_m(x, y) : std::numeric_limits<double>::infinity();
  };
  const struct {
    const char* name;
    DepthAt wrong;
  } cases[] = {{"depth_steps", centimetres}, {"depth_levels", rounded}, {"depth_limit", cut}};
  for (const auto& one : cases) {
    const CheckResult right = result_of(one.name, {hills_m, hills_m, hills_m, hills_m});
    EXPECT_TRUE(right.ok && !right.skipped) << one.name << ": " << right.value;
    const CheckResult wrong = result_of(one.name, {hills_m, hills_m, one.wrong, hills_m});
    EXPECT_FALSE(wrong.ok) << one.name << ": " << wrong.value;
    EXPECT_NE(wrong.worst.find("cam2"), std::string::npos) << one.name << ": " << wrong.worst;
    const CheckResult unseen = result_of(one.name, {hills_m, hills_m, hills_m, little});
    EXPECT_TRUE(unseen.ok && unseen.is_unseen) << one.name << ": " << unseen.value;
    // What sees no ground has no numbers to be looked at.
    const CheckResult above = result_of(one.name, {hills_m, hills_m, sky});
    EXPECT_TRUE(above.ok && !above.skipped) << one.name << ": " << above.value;
  }
}

}  // namespace
}  // namespace terracast::validate
