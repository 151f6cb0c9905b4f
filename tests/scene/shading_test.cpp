#include "scene/light/shading.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "geo/sun.h"
#include "geo/units.h"

namespace terracast::scene {
namespace {

constexpr double kPi = std::numbers::pi;

Daylight daylight(double elevation_deg, double visibility_m = 60e3) {
  const double elevation = geo::radians_from_degrees(elevation_deg);
  return {.sun_direction_world = {std::cos(elevation), 0.0, std::sin(elevation)},
          .up_world = Eigen::Vector3d::UnitZ(),
          .visibility_m = visibility_m};
}

Eigen::Vector3f direction_of(double azimuth, double elevation) {
  return {static_cast<float>(std::cos(elevation) * std::cos(azimuth)),
          static_cast<float>(std::cos(elevation) * std::sin(azimuth)),
          static_cast<float>(std::sin(elevation))};
}

/// Of sky and of ground that sends back 0.15, over all directions.
std::array<double, 3> mean_radiance(const Sky& sky) {
  std::array<double, 3> mean{};
  constexpr int kRings = 200, kSectors = 40;
  for (int ring = 0; ring < kRings; ++ring)
    for (int sector = 0; sector < kSectors; ++sector) {
      const double z = 2.0 * (ring + 0.5) / kRings - 1.0;
      const Color seen =
          z > 0.0 ? sky.radiance(direction_of(2.0 * kPi * (sector + 0.5) / kSectors, std::asin(z)))
                  : Color(sky.global_irradiance() * static_cast<float>(0.15 / kPi));
      for (std::size_t k = 0; k < 3; ++k)
        mean[k] += static_cast<double>(seen[static_cast<int>(k)]) / (kRings * kSectors);
    }
  return mean;
}

TEST(Shading, WhiteFurnaceGivesOne) {
  const Ambient furnace([](const Eigen::Vector3f&) -> Color { return Color::Ones(); });
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3f normal = direction_of(0.7 * i, 0.06 * i - 1.5);
    const Color leaving =
        lambert_radiance(Color::Ones(), 0.3f, Color::Zero(), furnace.irradiance(normal));
    for (int k = 0; k < 3; ++k)  // 48 rings integrate z^2 to 1 in 2304.
      EXPECT_NEAR(leaving[k], 1.0f, 5e-4f);
  }
}

TEST(Shading, ALitPlaneFollowsTheCosine) {
  for (const double angle_deg : {0.0, 25.0, 60.0, 89.0, 120.0}) {
    const float cosine = static_cast<float>(std::cos(geo::radians_from_degrees(angle_deg)));
    const Color leaving =
        lambert_radiance(Color::Constant(0.5f), cosine, Color::Constant(100.0f), Color::Zero());
    EXPECT_NEAR(leaving[1], 0.5 / kPi * 100.0 * static_cast<double>(std::max(0.0f, cosine)), 1e-4);
  }
}

// A packet of the whole path: matt ground, no air between, sun alone or shadow alone.
TEST(Shading, PacketsOfGroundFollowTheCosineToo) {
  const Sky sky(daylight(90.0));
  GroundPacket places{};
  GroundLook look{};
  ViewPacket view{};
  for (int i = 0; i < core::kLanes; ++i) {
    const double slope = 0.09 * i;
    look.normal[0][i] = static_cast<float>(std::sin(slope));
    look.normal[2][i] = static_cast<float>(std::cos(slope));
    for (std::size_t k = 0; k < 3; ++k) look.albedo[k][i] = 0.2f;
    look.openness[i] = 0.0f;
    view.sky_share[i] = 1.0f;
    view.direction[2][i] = -1.0f;
    view.sun_share[i] = i % 2 == 0 ? 1.0f : 0.0f;
  }
  core::Lanes3f radiance;
  shade_ground(places, look, view, sky, radiance);
  for (int i = 0; i < core::kLanes; ++i) {
    const double expected =
        i % 2 == 0 ? 0.2 / kPi * static_cast<double>(sky.sun_irradiance()[0]) * std::cos(0.09 * i)
                   : 0.0;
    EXPECT_NEAR(radiance[0][i], expected, 1e-4 * static_cast<double>(sky.sun_irradiance()[0]));
  }
}

// Fresnel's formula for n = 1.333 in closed form; Schlick's fit is good to 0.02 up to 70 degrees
// and 0.07 beyond.
TEST(Shading, WaterReflectsAsFresnelSays) {
  for (double angle = 0.0; angle < 1.56; angle += 0.05) {
    const double c = std::cos(angle);
    const double t = std::sqrt(1.0 - std::pow(std::sin(angle) / 1.333, 2));
    const double s = std::pow((c - 1.333 * t) / (c + 1.333 * t), 2);
    const double p = std::pow((t - 1.333 * c) / (t + 1.333 * c), 2);
    EXPECT_NEAR(water_reflectance(static_cast<float>(c)), 0.5 * (s + p),
                angle < 1.22 ? 0.02 : 0.07);
  }
}

TEST(Sky, ContrastFallsToTwoPercentAtTheVisibility) {
  const Sky sky(daylight(45.0, 20e3));
  const AirPath air = sky.air(20e3f, 0.0f, 0.0f, 0.0f);
  EXPECT_NEAR(air.transmittance[1], 0.02, 1e-4);          // Koschmieder: exp(-3.912)
  EXPECT_LT(air.transmittance[2], air.transmittance[1]);  // blue is scattered most
  EXPECT_GT(air.transmittance[0], air.transmittance[1]);
}

TEST(Sky, AirIsTheIntegralOverItsHeights) {
  const Sky sky(daylight(45.0, 30e3));
  const double rayleigh = 1.16e-5;
  const double mie = 3.912 / 30e3 - rayleigh;
  for (const auto& [from_m, to_m] : {std::pair{100.0, 2600.0}, std::pair{3000.0, 10.0},
                                     std::pair{500.0, 500.5}, std::pair{0.0, 0.0}}) {
    const double distance_m = 12e3;
    double depth = 0.0;
    constexpr int kSteps = 2000;
    for (int i = 0; i < kSteps; ++i) {
      const double h = from_m + (to_m - from_m) * (i + 0.5) / kSteps;
      depth +=
          (rayleigh * std::exp(-h / 8000.0) + mie * std::exp(-h / 1200.0)) * distance_m / kSteps;
    }
    const AirPath air = sky.air(static_cast<float>(distance_m), static_cast<float>(from_m),
                                static_cast<float>(to_m), 0.3f);
    EXPECT_NEAR(air.transmittance[1], std::exp(-depth), 2e-5);  // float, and the midpoint rule
  }
}

TEST(Sky, FarGroundBecomesTheHorizon) {
  const Sky sky(daylight(40.0));
  for (double azimuth = 0.0; azimuth < 6.0; azimuth += 0.7) {
    const Eigen::Vector3f level = direction_of(azimuth, 0.0);
    const float cos_sun = level.dot(sky.daylight().sun_direction_world.cast<float>());
    const Color far = sky.air(3e6f, 500.0f, 500.0f, cos_sun).inscatter;
    const Color horizon = sky.radiance(level);
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(far[k] / horizon[k], 1.0f, 0.02f);  // table of 129 cosines
  }
}

// Air without end glows by its own scattering alone: sunlight by the phase functions of Rayleigh and of Henyey
// and Greenstein, and the mean radiance of sky and ground, here by a sum over directions.
TEST(Sky, AirWithoutEndGlowsAsItScatters) {
  for (const double elevation_deg : {15.0, 50.0}) {
    for (const double visibility_m : {150e3, 60e3, 15e3}) {
      const Sky sky(daylight(elevation_deg, visibility_m));
      const double wavelength_um[3] = {0.610, 0.550, 0.465};
      const std::array<double, 3> around = mean_radiance(sky);
      const double cosine = std::cos(geo::radians_from_degrees(elevation_deg));
      for (const double azimuth : {0.0, 1.0, 2.0, kPi}) {
        const double cos_sun = cosine * std::cos(azimuth);
        const Color glow = sky.air_glow(static_cast<float>(cos_sun));
        const Color other = sky.air_glow(static_cast<float>(-cosine));
        double seen[2][3];
        for (int k = 0; k < 3; ++k) {
          const double molecules = 1.16e-5 * std::pow(wavelength_um[k] / 0.550, -4.08);
          const double haze =
              (3.912 / visibility_m - 1.16e-5) * std::pow(wavelength_um[k] / 0.550, -1.3);
          int row = 0;
          for (const double c : {cos_sun, -cosine}) {
            const double rayleigh = 3.0 / (16.0 * kPi) * (1.0 + c * c);
            const double mie = (1.0 - 0.76 * 0.76) /
                               (4.0 * kPi * std::pow(1.0 + 0.76 * 0.76 - 2.0 * 0.76 * c, 1.5));
            seen[row++][k] = static_cast<double>(sky.sun_irradiance()[k]) *
                             (molecules * rayleigh + 0.95 * haze * mie) / (molecules + haze);
          }
        }
        // The sky's horizon, a tenth of all directions, has the glow in it, which has not: it is so much brighter
        // or darker than Perez' by a third at most.
        for (int k = 0; k < 3; ++k) {
          const double molecules = 1.16e-5 * std::pow(wavelength_um[k] / 0.550, -4.08);
          const double haze =
              (3.912 / visibility_m - 1.16e-5) * std::pow(wavelength_um[k] / 0.550, -1.3);
          const double share = (molecules + 0.95 * haze) / (molecules + haze);
          const double expected = seen[0][k] + share * around[static_cast<std::size_t>(k)];
          EXPECT_NEAR(static_cast<double>(glow[k]), expected, 0.05 * expected);
        }
        // The light from all sides, the same in every direction, cancels in the difference.
        for (int k = 0; k < 3; ++k)
          EXPECT_NEAR(static_cast<double>(glow[k] - other[k]), seen[0][k] - seen[1][k],
                      1e-4 * static_cast<double>(glow[k]));
      }
    }
  }
}

// Photographs of hazy days show distant land going to a bluish white, not to a brown: against what is white in
// the light of the day, blue is the strongest channel at the horizon across from the sun, red the weakest.
TEST(Sky, TheHorizonIsABluishWhite) {
  for (const double elevation_deg : {30.0, 50.0, 70.0}) {
    for (const double visibility_m : {150e3, 60e3, 30e3, 15e3}) {
      const Sky sky(daylight(elevation_deg, visibility_m));
      for (const double azimuth : {0.5 * kPi, 0.75 * kPi, kPi}) {
        const Color horizon = sky.radiance(direction_of(azimuth, 0.0)) / sky.global_irradiance();
        EXPECT_LT(horizon[0], horizon[1]) << elevation_deg << ", " << visibility_m;
        EXPECT_LT(horizon[1], horizon[2]) << elevation_deg << ", " << visibility_m;
        // White rather than blue: what is blue is the sky above.
        EXPECT_LT(horizon[2], 1.6f * horizon[0]) << elevation_deg << ", " << visibility_m;
      }
    }
  }
}

// Measured clear days: 90 to 110 klx direct at 60 degrees, 10 to 30 klx diffuse; the sky is blue
// and brightest beside the sun.
TEST(Sky, ClearDaysHaveTheLightOfClearDays) {
  const Sky sky(daylight(60.0, 40e3));
  EXPECT_GT(luminance_of(sky.sun_irradiance()), 85.0f);
  EXPECT_LT(luminance_of(sky.sun_irradiance()), 112.0f);
  const float diffuse = luminance_of(sky.ambient().irradiance(Eigen::Vector3f::UnitZ()));
  EXPECT_GT(diffuse, 10.0f);
  EXPECT_LT(diffuse, 40.0f);
  const Color away = sky.radiance(direction_of(kPi, 0.9));
  EXPECT_GT(away[2], 1.5f * away[0]);
  EXPECT_GT(luminance_of(sky.radiance(direction_of(0.1, 1.0))), 2.0f * luminance_of(away));
}

TEST(Sky, LowSunIsRedAndNightIsDark) {
  const Sky noon(daylight(70.0));
  const Sky evening(daylight(2.0));
  const Sky night(daylight(-12.0));
  EXPECT_LT(evening.sun_irradiance()[2] / evening.sun_irradiance()[0],
            0.3f * noon.sun_irradiance()[2] / noon.sun_irradiance()[0]);
  EXPECT_EQ(luminance_of(night.sun_irradiance()), 0.0f);
  EXPECT_LT(luminance_of(night.global_irradiance()),
            1e-2f * luminance_of(noon.global_irradiance()));
}

TEST(Sky, TheDiscHasTheSunsSizeAndLight) {
  const Sky sky(daylight(50.0));
  const Eigen::Vector3d sun = sky.daylight().sun_direction_world;
  const Eigen::Vector3d beside(0.0, 1.0, 0.0);
  const auto at = [&](double angle) {
    return luminance_of(shade_sky(sky, std::cos(angle) * sun + std::sin(angle) * beside));
  };
  EXPECT_GT(at(0.999 * geo::kSunAngularRadius_rad),
            1000.0f * at(1.001 * geo::kSunAngularRadius_rad));
  const double solid_angle = kPi * std::pow(geo::kSunAngularRadius_rad, 2);
  EXPECT_NEAR(luminance_of(sky.sun_radiance() * static_cast<float>(solid_angle)) /
                  luminance_of(sky.sun_irradiance()),
              1.0f, 1e-4f);
}

TEST(Exposure, CurvesAreMonotonicAndEndAtWhite) {
  float last = -1.0f;
  for (float x = 0.0f; x < 50.0f; x += 0.01f) {
    const float y = film_curve(x);
    EXPECT_GT(y, last);
    EXPECT_LE(y, 1.0f);
    last = y;
  }
  EXPECT_EQ(film_curve(0.4f), 0.4f);
  // IEC 61966-2-1: linear 0.2140 is 0.5.
  EXPECT_NEAR(srgb_from_linear(0.21404f), 0.5f, 1e-4f);
  EXPECT_NEAR(srgb_from_linear(1.0f), 1.0f, 1e-6f);
}

TEST(Exposure, ASunlitGreyLandsAtItsPlace) {
  const Sky sky(daylight(55.0));
  const Color grey = sky.global_irradiance() * static_cast<float>(0.18 / kPi);
  std::uint8_t rgb[3];
  Exposure(sky, 1.0).develop(grey, rgb);
  // 0.24 linear is 0.527 in sRGB, 134 of 255; white balance makes it neutral.
  for (const std::uint8_t value : rgb) EXPECT_NEAR(value, 134, 1);
}

}  // namespace
}  // namespace terracast::scene
