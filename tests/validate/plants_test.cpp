#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <memory>
#include <optional>

#include "tests/validate/still_images.h"

/// What colour plants have beside the sky, in images of two halves.
namespace terracast::validate {
namespace {

using Color = std::array<std::uint8_t, 3>;

constexpr int kWidth = 100, kHeight = 80;
constexpr std::uint8_t kGrass = 5, kRock = 6;

struct Scene {
  Color plants;
  std::optional<Color> sky;
  std::uint8_t ground_class = kGrass;
  float depth_m = 50.0F;
  const char* white_balance = "scene";
};

/// The result of plants' colours, of two alike images.
CheckResult result_of(const Scene& scene) {
  LoadedImage image;
  image.color = core::Image8(kWidth, kHeight, 3);
  image.depth = core::ImageF(kWidth, kHeight);
  image.segmentation = core::Image8(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const bool is_sky = scene.sky && y < kHeight / 2;
      const Color& color = is_sky ? *scene.sky : scene.plants;
      for (int k = 0; k < 3; ++k) image.color(x, y, k) = color[static_cast<std::size_t>(k)];
      image.depth(x, y) = is_sky ? std::numeric_limits<float>::infinity() : scene.depth_m;
      image.segmentation(x, y) = is_sky ? 0 : scene.ground_class;
    }
  const FrameImages images{std::make_shared<const LoadedImage>(std::move(image))};
  Sequence sequence = still_scene(kWidth, kHeight);
  sequence.classes = {{0, "sky"}, {kGrass, "grass"}, {kRock, "rock"}};
  sequence.cameras[0].imaging.white_balance = scene.white_balance;
  return result_of("colors", "colors_plants", sequence, images, images);
}

Color swapped(const Color& color) { return {color[2], color[1], color[0]}; }

constexpr Color kSunlit = {110, 120, 70};    // (blue - red) / (blue + red) = -0.22
constexpr Color kBlueSky = {110, 150, 210};  // 0.31
constexpr Color kGreySky = {180, 182, 190};  // 0.03

TEST(ColorsOfPlants, InSunlightAreRedderThanTheSkyAndTheSun) {
  for (const auto& sky :
       {std::optional(kBlueSky), std::optional(kGreySky), std::optional<Color>()}) {
    const CheckResult right = result_of({kSunlit, sky});
    EXPECT_TRUE(right.ok && !right.skipped) << right.worst;
    EXPECT_NEAR(right.value, -0.22, 0.01);
    const CheckResult wrong =
        result_of({swapped(kSunlit), sky ? std::optional(swapped(*sky)) : std::nullopt});
    EXPECT_FALSE(wrong.ok) << wrong.value << " of " << wrong.bound;
  }
}

// What the light alone explains calls nothing wrong, and is not called right: with swapped channels it would be as far
// on the other side.
TEST(ColorsOfPlants, AsBlueAsWhatLightsThemAreUnseen) {
  for (const Scene& scene : {Scene{{90, 110, 110}, kBlueSky},  // 0.1 in the light of a blue sky
                             Scene{{80, 100, 140}, kBlueSky},  // 0.27, in haze
                             Scene{{100, 110, 130}, std::nullopt},      // 0.13, no sky in the image
                             Scene{swapped(kSunlit), kGreySky, kRock},  // no plants
                             Scene{swapped(kSunlit), kGreySky, kGrass, 600.0F},  // far away
                             Scene{swapped(kSunlit), kGreySky, kGrass, 50.0F, "daylight"},
                             Scene{{200, 255, 255}, kGreySky},  // cut to white
                             Scene{{20, 30, 30}, kGreySky}}) {  // dark
    const CheckResult result = result_of(scene);
    EXPECT_TRUE(result.ok && result.is_unseen) << result.value << " of " << result.bound;
  }
}

}  // namespace
}  // namespace terracast::validate
