#include "validate/sampling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/random.h"

namespace terracast::validate {
namespace {

/// A camera at a height above a plane, looking straight down on waves.
struct DownwardView {
  Camera camera;
  LoadedImage image;
  View view;

  explicit DownwardView(double height_m) {
    camera.intrinsics = {64, 64, 64.0, 64.0, 32.0, 32.0};
    image.depth = core::ImageF(64, 64, 1, static_cast<float>(height_m));
    image.grey = core::ImageF(64, 64);
    for (int y = 0; y < 64; ++y)
      for (int x = 0; x < 64; ++x) {
        const double east_m = height_m * (x + 0.5 - 32.0) / 64.0;
        const double south_m = height_m * (y + 0.5 - 32.0) / 64.0;
        image.grey(x, y) =
            static_cast<float>(128.0 + 40.0 * std::sin(0.4 * east_m) * std::sin(0.3 * south_m));
      }
    view.camera = &camera;
    view.image = &image;
    view.local_from_camera.rotation = Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
    view.local_from_camera.translation = {0.0, 0.0, height_m};
  }
};

TEST(PatchMatching, TakesOnlyWhatBothImagesShowAboutAsLarge) {
  const DownwardView view(100.0);
  for (const double height_m : {70.0, 90.0, 100.0, 120.0, 145.0}) {
    const DownwardView other(height_m);
    const auto match = match_patch(view.view, other.view, 32, 32);
    ASSERT_TRUE(match && match->has_converged) << height_m;
    // Waves of 10 pixels and more: cubics keep their place to a hundredth of a pixel.
    EXPECT_LT(match->shift_px.norm(), 0.01) << height_m;
  }
  for (const double height_m : {40.0, 65.0, 155.0, 300.0})
    EXPECT_FALSE(match_patch(view.view, DownwardView(height_m).view, 32, 32)) << height_m;
}

TEST(PatchMatching, KnowsThatShadingGoesAlongWithTheImage) {
  DownwardView here(100.0), there(100.0);
  // Weak waves below brightness that rises to the right in one image, and falls in the other.
  const auto shade = [](DownwardView& view, double per_px) {
    for (int y = 0; y < 64; ++y)
      for (int x = 0; x < 64; ++x) {
        float& value = view.image.grey(x, y);
        value = static_cast<float>(128.0 + 0.3 * (static_cast<double>(value) - 128.0) +
                                   per_px * (x + 0.5 - 32.0));
      }
  };
  shade(here, 4.0);
  shade(there, -4.0);
  const auto unstated = match_patch(here.view, there.view, 30, 31);
  EXPECT_TRUE(!unstated || unstated->correlation < 0.0);
  here.camera.imaging.has_shading = true;
  const auto stated = match_patch(here.view, there.view, 30, 31);
  ASSERT_TRUE(stated && stated->has_converged);
  EXPECT_GT(stated->correlation, 0.999);
  EXPECT_LT(stated->shift_px.norm(), 0.01);
}

TEST(PatchesPerFact, IsWhatTheVarianceOfAMeanOverPatchesOfNoiseGrowsBy) {
  // Against images of white noise: a patch says the mean of its 49 pixels, so that its variance is 1/49.
  constexpr int kWidth = 64, kHeight = 48, kTrials = 2000;
  constexpr std::size_t kPatches = 200;
  core::ImageF noise(kWidth, kHeight);
  double sum_of_squares = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::uint64_t draw = 0;
    const auto unit = [&] {
      return core::random_unit(7, static_cast<std::uint64_t>(trial), draw++);
    };
    // Uniform values of variance 1.
    for (float& value : noise.data()) value = static_cast<float>(std::sqrt(12.0) * (unit() - 0.5));
    double mean = 0.0;
    for (std::size_t k = 0; k < kPatches; ++k) {
      const int x = kPatchRadius_px + static_cast<int>(unit() * (kWidth - kPatchSide_px + 1));
      const int y = kPatchRadius_px + static_cast<int>(unit() * (kHeight - kPatchSide_px + 1));
      for (int dy = -kPatchRadius_px; dy <= kPatchRadius_px; ++dy)
        for (int dx = -kPatchRadius_px; dx <= kPatchRadius_px; ++dx)
          mean += static_cast<double>(noise(x + dx, y + dy)) / kPatchPixels / kPatches;
    }
    sum_of_squares += mean * mean;
  }
  const double of_independent = 1.0 / kPatchPixels / kPatches;
  // Patches' centres keep 3 pixels from the border, 58 x 42 of 64 x 48: a quarter more of them share a pixel. A
  // variance over 2000 trials is known to 3 % (sqrt(2 / 2000)); 5 of those.
  const double grown = sum_of_squares / kTrials / of_independent;
  EXPECT_GT(grown, 0.85 * patches_per_fact(kPatches, kWidth, kHeight));
  EXPECT_LT(grown, 1.15 * 1.26 * patches_per_fact(kPatches, kWidth, kHeight));
}

TEST(MedianEstimates, AreOffByNoMoreThanTheySayHoweverValuesScatter) {
  constexpr std::uint64_t kSeed = 7;
  constexpr double kTruth = 0.3;
  for (const int count : {30, 100, 1000}) {
    for (std::uint64_t turn = 0; turn < 300; ++turn) {
      std::vector<double> values;
      for (int i = 0; i < count; ++i) {
        // Tails as those of Cauchy's distribution, whose mean does not exist.
        const double share = core::random_between(0.001, 0.999, kSeed, turn,
                                                  static_cast<std::uint64_t>(10000 * count + i));
        values.push_back(kTruth + 0.1 * std::tan(3.14159265358979 * (share - 0.5)));
      }
      const MedianEstimate estimate = estimate_median(values);
      ASSERT_LE(std::abs(estimate.median - kTruth), estimate.unsure) << count << ", " << turn;
      // Of Cauchy's the median errs by pi/2 of the scale over sqrt(n).
      if (count == 1000) {
        EXPECT_LT(estimate.unsure, 2.0 * 5.0 * 0.157 / std::sqrt(1000.0));
      }
    }
  }
}

TEST(MedianEstimates, CountOnlyWhatIsSureWhereTheyDoNotTell) {
  std::vector<double> few(20, 7.0);
  EXPECT_TRUE(std::isinf(estimate_median(few).unsure));
  EXPECT_EQ(estimate_median(few).judged(), 0.0);
  std::vector<double> equal(100, 0.2);
  EXPECT_TRUE(estimate_median(equal).tells(0.1));
  EXPECT_DOUBLE_EQ(estimate_median(equal).judged(), 0.2);
  const MedianEstimate broad{.median = -3.0, .unsure = 1.0};
  EXPECT_FALSE(broad.tells(0.1));
  EXPECT_DOUBLE_EQ(broad.judged(), 2.0);
}

}  // namespace
}  // namespace terracast::validate
