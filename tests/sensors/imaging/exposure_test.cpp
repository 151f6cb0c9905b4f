#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "scene/light/shading.h"
#include "sensors/camera/imaging/development.h"
#include "sensors/camera/imaging/exposure_control.h"
#include "tests/support/expect_error.h"

namespace terracast::sensors {
namespace {

TEST(ExposureControl, MetersMeansAndPercentiles) {
  std::vector<scene::Color> seen;
  for (int i = 1; i <= 100; ++i)
    seen.emplace_back(scene::Color::Constant(0.01f * static_cast<float>(i)));
  ExposureOptions options;
  double sum = 0.0;
  for (int i = 1; i <= 100; ++i) sum += std::log(0.01 * i);
  EXPECT_NEAR(metered_luminance(options, seen), std::exp(sum / 100.0), 1e-6);
  options.meter = "percentile";
  options.meter_percentile = 90.0;
  EXPECT_NEAR(metered_luminance(options, seen), 0.9, 1e-6);
  EXPECT_NEAR(wanted_ev({.target = 0.2}, 0.05), 2.0, 1e-12);
  EXPECT_EQ(wanted_ev({.target = 0.2, .highest_ev = 1.5}, 0.05), 1.5);
}

/// A step of the light, against the exponential that the time constant states.
TEST(ExposureControl, FollowsAStepWithItsTimeConstant) {
  constexpr int kStep = 90;
  std::vector<double> times_s;
  for (int i = 0; i < 150; ++i) times_s.push_back(0.1 * i);
  const auto wanted = [](int frame) { return frame < kStep ? -1.0 : 2.0; };
  for (int frame : {0, 40, kStep - 1})
    EXPECT_NEAR(followed_ev(times_s, frame, 0.8, wanted), -1.0, 1e-12);
  for (int frame = kStep; frame < 140; ++frame) {
    const double made = (followed_ev(times_s, frame, 0.8, wanted) + 1.0) / 3.0;
    // What is older than six time constants is not looked at: the rest weighs as much more.
    EXPECT_NEAR(made, 1.0 - std::exp(-0.1 * (frame - kStep + 1) / 0.8),
                1.001 * std::exp(-6.0) / (1.0 - std::exp(-6.0)))
        << frame;
  }
  EXPECT_EQ(followed_ev(times_s, kStep, 0.0, wanted), 2.0);
}

TEST(ExposureControl, LooksOnceAtAFrame) {
  int num_looks = 0;
  const LightMeters meters({ExposureOptions{}}, [&](int frame, int) {
    ++num_looks;
    return std::vector<scene::Color>{scene::Color::Constant(0.1f * static_cast<float>(frame + 1))};
  });
  EXPECT_NEAR(meters.read(2, 0).luminance, 0.3, 1e-6);
  EXPECT_NEAR(meters.read(2, 0).mean[1], 0.3, 1e-6);
  EXPECT_EQ(num_looks, 1);
}

/// Published chromaticities of illuminants near the Planckian locus.
TEST(Development, BlackBodiesAreWhite) {
  const auto linear_of = [](double x, double y) {
    Eigen::Matrix3d linear_from_xyz;
    linear_from_xyz << 3.2406, -1.5372, -0.4986, -0.9689, 1.8758, 0.0415, 0.0557, -0.2040, 1.0570;
    return Eigen::Array3d(linear_from_xyz * Eigen::Vector3d(x / y, 1.0, (1.0 - x - y) / y));
  };
  // CIE 15: illuminant A is a black body of 2856 K; E's neighbour on the locus is 5455 K.
  const Eigen::Array3d grey =
      linear_of(0.44757, 0.40745) * gains_of_temperature(2856.0).cast<double>();
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(grey[k], 1.0, 0.03) << k;
  EXPECT_NEAR(scene::luminance_of(scene::Color(1.0f / gains_of_temperature(2856.0))), 1.0f, 1e-5f);
  // Warm light takes more blue, cold light more red.
  EXPECT_GT(gains_of_temperature(2500.0)[2], gains_of_temperature(2500.0)[0]);
  EXPECT_LT(gains_of_temperature(12000.0)[2], gains_of_temperature(12000.0)[0]);
  // Pieces of the approximation meet.
  for (const double kelvin : {2222.0, 4000.0})
    EXPECT_LT((gains_of_temperature(kelvin) - gains_of_temperature(kelvin + 0.01)).abs().maxCoeff(),
              0.01f);
}

TEST(Development, CurvesAreAsStated) {
  EXPECT_FLOAT_EQ(Development({.curve = "linear"}).curve(0.25f), 0.25f);
  EXPECT_FLOAT_EQ(Development({.curve = "linear"}).curve(1.25f), 1.0f);
  EXPECT_FLOAT_EQ(Development({.curve = "gamma", .gamma = 2.0}).curve(0.25f), 0.5f);
  // IEC 61966-2-1: a fifth of the light is 0.4845 of white.
  EXPECT_NEAR(Development({.curve = "srgb"}).curve(0.2f), 0.48453, 1e-4);
  EXPECT_FLOAT_EQ(Development(ColorOptions{}).curve(0.3f), scene::srgb_from_linear(0.3f));
}

TEST(Development, SaturationMovesColorsAboutTheirGrey) {
  const scene::Color color(0.5f, 0.2f, 0.1f);
  std::uint8_t rgb[3];
  Development({.saturation = 0.0, .curve = "linear"}).develop(color, rgb);
  const int grey = static_cast<int>(255.0f * scene::luminance_of(color) + 0.5f);
  for (const std::uint8_t value : rgb) EXPECT_EQ(value, grey);
  Development({.saturation = 1.5, .curve = "linear"}).develop(color, rgb);
  EXPECT_EQ(rgb[0],
            static_cast<int>(255.0f * (1.5f * 0.5f - 0.5f * scene::luminance_of(color)) + 0.5f));
}

TEST(ImagingOptions, ContradictionsAreRefused) {
  EXPECT_THROW((ExposureOptions{.lowest_ev = 2.0, .highest_ev = 1.0}.validate()), core::Error);
  EXPECT_THROW((ColorOptions{.white_balance = "gains"}.validate()), core::Error);
  EXPECT_THROW((ColorOptions{.gains = {1.0, 1.0, 1.0}}.validate()), core::Error);
  EXPECT_FALSE(ImagingOptions{}.is_on());
}

TEST(ImagingOptions, KeysThatWouldChangeNothingAreRefusedByName) {
  const auto refuses = [](const auto& options, const std::string& key, const std::string& with) {
    test::expect_error(core::ErrorKind::Config, {key + " is given", "only with " + with},
                       [&] { options.validate(); });
  };
  refuses(ColorOptions{.gamma = 1.2}, "gamma", "curve = \"gamma\"");
  refuses(ColorOptions{.temperature_k = 2500.0}, "temperature_k",
          "white_balance = \"temperature\"");
  refuses(ExposureOptions{.target = 0.5}, "target", "mode = \"automatic\"");
  refuses(ExposureOptions{.mode = "automatic", .meter_percentile = 50.0}, "meter_percentile",
          "meter = \"percentile\"");
  refuses(LensFlawOptions{.bloom_radius_px = 9.0}, "bloom_radius_px", "bloom");
  refuses(SoilingOptions{.smudge_haze = 0.1}, "smudge_haze", "smudges");
  refuses(SoilingOptions{.dirt_size = 0.1}, "dirt_size", "dirt_spots");
  EXPECT_NO_THROW((ColorOptions{.curve = "gamma", .gamma = 1.2}.validate()));
  EXPECT_NO_THROW(
      (ColorOptions{.white_balance = "temperature", .temperature_k = 2500.0}.validate()));
  EXPECT_NO_THROW((ExposureOptions{.mode = "automatic", .target = 0.5}.validate()));
  EXPECT_NO_THROW((SoilingOptions{.smudges = 1, .smudge_haze = 0.1}.validate()));
}

}  // namespace
}  // namespace terracast::sensors
