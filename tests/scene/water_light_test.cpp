#include "scene/water/water_light.h"

#include <gtest/gtest.h>

#include <cmath>

namespace terracast::scene {
namespace {

TEST(WaterLight, BendsRaysAsSnellSays) {
  const Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  for (double angle = 0.0; angle < 1.57; angle += 0.05) {
    const Eigen::Vector3d down(std::sin(angle), 0.0, -std::cos(angle));
    Eigen::Vector3d bent;
    ASSERT_TRUE(refract(down, normal, 1.0 / kWaterIndex, bent));
    EXPECT_NEAR(bent.x() * kWaterIndex, std::sin(angle), 1e-12);
    EXPECT_NEAR(bent.norm(), 1.0, 1e-12);
    // Back the same way, from below.
    Eigen::Vector3d out;
    ASSERT_TRUE(refract(-bent, -normal, kWaterIndex, out));
    EXPECT_NEAR((out + down).norm(), 0.0, 1e-7);  // near grazing the root loses half the digits
  }
  // Beyond the critical angle, 48.6 degrees, nothing leaves.
  const double critical = std::asin(1.0 / kWaterIndex);
  Eigen::Vector3d out;
  for (const double beside : {-1e-6, 1e-6}) {
    const Eigen::Vector3d up(std::sin(critical + beside), 0.0, std::cos(critical + beside));
    EXPECT_EQ(refract(up, -normal, kWaterIndex, out), beside < 0.0);
  }
}

TEST(WaterLight, ReflectsAsFresnelSays) {
  const auto index = static_cast<float>(kWaterIndex);
  // At the normal ((n - 1) / (n + 1))^2, from both sides; all of it when grazing or beyond the critical angle.
  const float straight = (index - 1.0f) * (index - 1.0f) / ((index + 1.0f) * (index + 1.0f));
  EXPECT_NEAR(fresnel_reflectance(1.0f, 1.0f / index), straight, 1e-6f);
  EXPECT_NEAR(fresnel_reflectance(1.0f, index), straight, 1e-6f);
  EXPECT_NEAR(fresnel_reflectance(1e-4f, 1.0f / index), 1.0f, 1e-2f);
  EXPECT_EQ(fresnel_reflectance(0.6f, index), 1.0f);
  // At Brewster's angle light of one polarisation is not reflected: half of sin^2(i - t), i + t = 90 degrees.
  const float brewster = std::atan(index);
  const float beyond = std::asin(std::sin(brewster) / index);
  EXPECT_NEAR(fresnel_reflectance(std::cos(brewster), 1.0f / index),
              0.5f * std::pow(std::sin(brewster - beyond), 2.0f), 1e-6f);
}

TEST(WaterLight, ClearDeepWaterIsBlueAndFadesAsItsVisibilitySays) {
  for (const double visibility_m : {3.0, 10.0, 40.0}) {
    const WaterOptics sea = optics_of(world::Cover::Sea, visibility_m);
    // Koschmieder: 2 % of the contrast is left at 550 nm. Pure water's own scattering comes on top.
    const double left = std::exp(-visibility_m * static_cast<double>(sea.beam_per_m()[1]));
    EXPECT_NEAR(std::log(left), std::log(0.02), 0.1 + 0.003 * visibility_m);
    // Red goes first.
    EXPECT_GT(sea.fading_per_m()[0], sea.fading_per_m()[1]);
  }
  const Color deep = optics_of(world::Cover::Sea, 40.0).deep_reflectance();
  EXPECT_GT(deep[2], 2.0f * deep[1]);
  EXPECT_GT(deep[1], 2.0f * deep[0]);
  // Of the light that comes down, clear sea sends 2 to 10 % back in the blue (Morel and Prieur 1977, figure 2).
  EXPECT_GT(3.14f * deep[2], 0.02f);
  EXPECT_LT(3.14f * deep[2], 0.10f);
  // Rivers are brown-green: less blue than green.
  const Color river = optics_of(world::Cover::River, 20.0).deep_reflectance();
  EXPECT_LT(river[2], river[1]);
}

}  // namespace
}  // namespace terracast::scene
