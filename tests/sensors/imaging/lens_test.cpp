#include "sensors/camera/imaging/lens.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "core/error.h"
#include "sensors/camera/imaging/blur.h"
#include "sensors/camera/imaging/soiling.h"

namespace terracast::sensors {
namespace {

std::unique_ptr<geo::CameraModel> pinhole(int width_px, int height_px, double focal_px) {
  return geo::make_camera(
      {.model = "pinhole",
       .width_px = width_px,
       .height_px = height_px,
       .parameters = {focal_px, focal_px, 0.5 * width_px + 3.0, 0.5 * height_px}});
}

std::array<double, 3> sums_of(const core::ImageF& image) {
  std::array<double, 3> sums = {};
  for (std::size_t i = 0; i < image.data().size(); ++i) sums[i % 3] += double{image.data()[i]};
  return sums;
}

core::ImageF bright_point(int width_px, int height_px, int x, int y) {
  core::ImageF image(width_px, height_px, 3, 0.1f);
  for (int k = 0; k < 3; ++k) image(x, y, k) = 1000.0f * static_cast<float>(k + 1);
  return image;
}

TEST(Vignetting, IsTheFourthPowerOfTheCosine) {
  const auto model = pinhole(60, 40, 30.0);
  const core::ImageF share = vignetting_of({.vignetting_exponent = 4.0}, *model);
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 60; ++x) {
      const double dx = (x + 0.5 - 33.0) / 30.0;
      const double dy = (y + 0.5 - 20.0) / 30.0;
      // cos = 1 / sqrt(1 + tan^2)
      EXPECT_NEAR(share(x, y), 1.0 / std::pow(1.0 + dx * dx + dy * dy, 2.0), 1e-7);
    }
}

TEST(Vignetting, FollowsItsPolynomialToTheCorner) {
  const auto model = pinhole(60, 40, 300.0);
  const core::ImageF share = vignetting_of({.vignetting_polynomial = {-0.3, 0.1, -0.2}}, *model);
  const double corner2 = 33.0 * 33.0 + 20.0 * 20.0;
  for (int x = 0; x < 60; ++x) {
    const double r2 = (std::pow(x + 0.5 - 33.0, 2) + 0.25) / corner2;
    EXPECT_NEAR(share(x, 20), 1.0 - 0.3 * r2 + 0.1 * r2 * r2 - 0.2 * r2 * r2 * r2, 1e-7);
  }
}

/// An edge at a place between pixels, drawn by the share of each pixel that it covers.
TEST(ChromaticAberration, MovesEdgesByTheStatedScale) {
  constexpr int kWidth = 200;
  const Eigen::Vector2d center(90.0, 10.0);
  core::ImageF image(kWidth, 20, 3);
  const auto edge_of = [&](const core::ImageF& seen, int channel) {
    double dark = 0.0;
    for (int x = 0; x < kWidth; ++x) dark += 1.0 - double{seen(x, 10, channel)};
    return dark;
  };
  for (const double edge : {20.3, 88.0, 133.6, 181.2}) {
    for (int y = 0; y < 20; ++y)
      for (int x = 0; x < kWidth; ++x)
        for (int k = 0; k < 3; ++k)
          image(x, y, k) = static_cast<float>(std::clamp(x + 1.0 - edge, 0.0, 1.0));
    core::ImageF seen = image;
    scale_colors({.red_scale_permille = 12.0, .blue_scale_permille = -7.0}, center, seen);
    // Catmull and Rom's cubic overshoots a step by up to 2 / 27, which is cut off.
    EXPECT_NEAR(edge_of(seen, 0), 90.0 + 1.012 * (edge - 90.0), 2.0 / 27.0) << edge;
    EXPECT_EQ(edge_of(seen, 1), edge_of(image, 1));
    EXPECT_NEAR(edge_of(seen, 2), 90.0 + 0.993 * (edge - 90.0), 2.0 / 27.0) << edge;
  }
}

TEST(Glare, KeepsTheLightOfAllPixels) {
  for (const auto& [x, y] : {std::pair(20, 15), std::pair(0, 0), std::pair(39, 29)}) {
    core::ImageF image = bright_point(40, 30, x, y);
    const std::array<double, 3> before = sums_of(image);
    add_glare({.veiling_glare = 0.05, .bloom = 0.2, .bloom_radius_px = 6.0}, image);
    const std::array<double, 3> after = sums_of(image);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(after[k], before[k], 1e-5 * before[k]);
    // Of the point's own light 0.8 * 0.95 stays, and little comes back.
    EXPECT_GT(image(x, y, 0), 0.76f * 1000.0f);
    EXPECT_LT(image(x, y, 0), 0.80f * 1000.0f);
  }
}

TEST(Blur, IsAGaussianOfItsRadius) {
  core::ImageF image(61, 61, 1);
  image(30, 30) = 1.0f;
  const core::ImageF spread = blurred(image, 5.0);
  double second = 0.0;
  for (int y = 0; y < 61; ++y)
    for (int x = 0; x < 61; ++x) second += double{spread(x, y)} * (x - 30) * (x - 30);
  // Cut off at three deviations a Gaussian has 0.973 of its variance; sums over pixels change little.
  EXPECT_NEAR(second, 0.973 * 25.0, 0.01 * 25.0);
  EXPECT_NEAR(spread(35, 30) / spread(30, 30), std::exp(-0.5), 1e-5);
}

TEST(Soiling, TakesAndScattersLight) {
  const SoilingOptions options{.smudges = 3,
                               .smudge_size = 0.2,
                               .smudge_haze = 0.7,
                               .dirt_spots = 5,
                               .dirt_size = 0.1,
                               .dirt_opacity = 0.5};
  const Soiling soiling = draw_soiling(options, 64, 48, 5, 1);
  core::ImageF even(64, 48, 3, 0.4f);
  lay_soiling(options, soiling, even);
  float darkest = 1.0f;
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) {
      EXPECT_NEAR(even(x, y, 1), 0.4f * (1.0f - soiling.opacity(x, y)), 1e-6f);
      darkest = std::min(darkest, even(x, y, 1));
    }
  EXPECT_LT(darkest, 0.3f);
  EXPECT_EQ(draw_soiling(options, 64, 48, 5, 1).haze, soiling.haze);
  EXPECT_NE(draw_soiling(options, 64, 48, 5, 2).haze, soiling.haze);
  // A point in a smudge loses its haze to what is about it.
  core::ImageF image = bright_point(64, 48, 0, 0);
  Soiling smudge{.haze = core::ImageF(64, 48, 1, 0.25f), .opacity = {}};
  lay_soiling(options, smudge, image);
  EXPECT_NEAR(sums_of(image)[0], sums_of(bright_point(64, 48, 0, 0))[0], 0.02);
  EXPECT_LT(image(0, 0, 0), 780.0f);
}

TEST(LensFlawOptions, DarknessBelowNoneIsRefused) {
  LensFlawOptions options;
  options.vignetting_polynomial = {-1.5, 0.0, 0.0};
  EXPECT_THROW(options.validate(), core::Error);
  options.vignetting_polynomial = {-0.9, 0.0, 0.0};
  options.validate();
}

}  // namespace
}  // namespace terracast::sensors
