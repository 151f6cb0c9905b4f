// Haze against closed forms, and against sums of many short pieces along straight rays over the ellipsoid.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/atomic_file.h"
#include "core/random.h"
#include "core/toml_reader.h"
#include "scene/conditions.h"
#include "scene/media/medium.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_world.h"

namespace terracast::test {
namespace {

using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct HazeScene {
  ScratchFolder folder;
  world::TileStore store = make_tiny_world(folder / "world", [](double, double) { return 0.0; });
  geo::WorldFrame frame{store.manifest().origin};
  scene::Sky sky{scene::daylight_at(Vector3d::Zero(), "2025-06-21T10:00:00Z",
                                    {.sun_azimuth_deg = 140.0, .sun_elevation_deg = 35.0}, frame)};

  std::unique_ptr<scene::Medium> haze(const std::string& keys) {
    core::write_file(folder / "conditions.toml", "[[media]]\nkind = \"exponential_haze\"\n" + keys);
    const auto conditions = core::read_toml<scene::ConditionOptions>(folder / "conditions.toml");
    return conditions.media.at(0)->make({.store = store, .sky = sky, .sea_level_m = 0.0});
  }
};

scene::SeenMedium look(const scene::Medium& medium, const Vector3d& from, const Vector3d& toward,
                       double until_m) {
  const scene::SampleWidth width;
  return medium.look({.origin_world = from,
                      .direction_world = toward.normalized(),
                      .until_m = until_m,
                      .from_height_m = static_cast<float>(from.z()),
                      .sample_width = width,
                      .jitter = 0.5});
}

double height_m(const geo::WorldFrame& frame, const Vector3d& point) {
  return frame.geodetic_from_world(point).height_m;
}

// Below its base haze is even: Beer and Lambert's law with Koschmieder's 3.912 over the range.
TEST(ExponentialHaze, BelowItsBaseKeepsContrastByKoschmiedersLaw) {
  HazeScene scene;
  const auto haze = scene.haze("visibility_km = 4.0\nbase_m = 3000.0\n");
  for (const double distance_m : {10.0, 800.0, 4000.0}) {
    const scene::SeenMedium seen = look(*haze, {0, 0, 500}, {1, 2, 0.1}, distance_m);
    // Floats of 24 bits.
    EXPECT_NEAR(seen.transmittance[0], std::exp(-3.912 * distance_m / 4000.0), 3e-7);
    EXPECT_NEAR(seen.transmittance[2], seen.transmittance[0], 0.0);
  }
  EXPECT_NEAR(look(*haze, {0, 0, 500}, {1, 0, 0}, 4000.0).transmittance[0], 0.02, 2e-5);
}

// Straight up the optical depth is the extinction times the scale height times what the exponential loses.
TEST(ExponentialHaze, VerticalDepthIsTheIntegralOfTheExponential) {
  HazeScene scene;
  const auto haze = scene.haze("visibility_km = 2.0\nbase_m = 100.0\nscale_height_m = 150.0\n");
  const double extinction_per_m = 3.912 / 2000.0;
  const double depth = extinction_per_m * (100.0 - 40.0) +
                       extinction_per_m * 150.0 * (1.0 - std::exp(-(740.0 - 100.0) / 150.0));
  // Pieces have linear heights, which straight up is exact but for the piece that holds the base.
  EXPECT_NEAR(look(*haze, {0, 0, 40}, {0, 0, 1}, 700.0).transmittance[1], std::exp(-depth), 1e-6);
}

// Long rays, drawn at random: the sum over 200 000 pieces with heights over the ellipsoid.
TEST(ExponentialHaze, OverTheRoundEarthFollowsAFineSum) {
  HazeScene scene;
  const double scale_m = 300.0, base_m = 50.0;
  const auto haze = scene.haze("visibility_km = 30.0\nbase_m = 50.0\nscale_height_m = 300.0\n");
  for (std::uint64_t draw = 0; draw < 12; ++draw) {
    const Vector3d from(2e4 * (core::random_unit(5, 1, draw) - 0.5),
                        2e4 * (core::random_unit(5, 2, draw) - 0.5),
                        20.0 + 1500.0 * core::random_unit(5, 3, draw));
    const double angle = 6.28 * core::random_unit(5, 4, draw);
    const Vector3d toward =
        Vector3d(std::cos(angle), std::sin(angle), 0.06 * (core::random_unit(5, 5, draw) - 0.4))
            .normalized();
    // To where the ray meets the ellipsoid, as far as the ground reaches.
    double until_m = 60e3;
    while (height_m(scene.frame, from + until_m * toward) < 0.0) until_m *= 0.9;
    constexpr int kPieces = 200000;
    double depth = 0.0;
    for (int i = 0; i < kPieces; ++i) {
      const double h = height_m(scene.frame, from + (i + 0.5) / kPieces * until_m * toward);
      depth += 3.912 / 30e3 * std::exp(-std::max(h - base_m, 0.0) / scale_m) * until_m / kPieces;
    }
    const double seen_depth = -std::log(look(*haze, from, toward, until_m).transmittance[0]);
    // Heights of approximate_height_m() are within a metre out here, which is 1/300 of the scale height.
    EXPECT_NEAR(seen_depth, depth, depth / 300.0 + 1e-6) << draw;
  }
}

// Where all light is lost, what comes in is that which the haze before scatters: albedo times the source.
TEST(ExponentialHaze, ThickHazeGlowsByItsPhaseFunction) {
  HazeScene scene;
  const auto bright = scene.haze(
      "visibility_km = 0.05\nbase_m = 5000.0\nscale_height_m = 1.0\nalbedo = 0.8\nanisotropy = "
      "0.5\n");
  const auto black = scene.haze("visibility_km = 0.05\nbase_m = 5000.0\nalbedo = 0.0\n");
  const scene::SeenMedium seen = look(*bright, {0, 0, 4990}, {1, 0, 0}, 2000.0);
  EXPECT_LT(seen.transmittance[0], 1e-30F);
  EXPECT_EQ(look(*black, {0, 0, 4990}, {1, 0, 0}, 2000.0).radiance.abs().maxCoeff(), 0.0F);
  // In the middle of a thick layer the sun is gone, and mean sky and ground stay.
  const auto deep = scene.haze("visibility_km = 0.05\nbase_m = 5000.0\nalbedo = 0.8\n");
  const scene::SeenMedium below = look(*deep, {0, 0, 10}, {1, 0, 0}, 2000.0);
  const Eigen::Vector3f up = scene.sky.daylight().up_world.cast<float>();
  const scene::Color around =
      0.5F * (scene.sky.ambient().irradiance(up) + scene.sky.ambient().irradiance(-up)) /
      std::numbers::pi_v<float>;
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(below.radiance[k], 0.8F * around[k], 1e-4F * around[k]);
  EXPECT_GT(seen.radiance[1], below.radiance[1]);
}

TEST(ExponentialHaze, DimsTheSunByWhatLiesAbove) {
  HazeScene scene;
  const auto haze = scene.haze("visibility_km = 3.0\nbase_m = 0.0\nscale_height_m = 100.0\n");
  const double sine = std::sin(35.0 * std::numbers::pi / 180.0);
  const double depth = 3.912 / 3000.0 * 100.0 * std::exp(-0.5) / sine;
  EXPECT_NEAR(haze->sun_transmittance({0, 0, 50}), std::exp(-depth), 1e-6);
}

TEST(ExponentialHaze, KeysOutOfRangeAreRefused) {
  HazeScene scene;
  expect_error(core::ErrorKind::Config, {"visibility_km"},
               [&] { scene.haze("visibility_km = 0.0\n"); });
  expect_error(core::ErrorKind::Config, {"scale_hight_m", "scale_height_m"},
               [&] { scene.haze("scale_hight_m = 10.0\n"); });
}

/// Laws that hold for every medium of the table.
}  // namespace
}  // namespace terracast::test
