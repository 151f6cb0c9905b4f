#include "scene/media/clouds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/parallel.h"
#include "core/random.h"
#include "tests/support/expect_error.h"
#include "tests/support/test_data.h"
#include "world/tile_store.h"

namespace terracast::scene {
namespace {

constexpr double kPi = std::numbers::pi;

geo::WorldFrame frame_of_test() {
  return geo::WorldFrame({.lat_deg = 42.5, .lon_deg = 1.5, .height_m = 0.0});
}

/// A full box with its middle at its origin.
world::Volume box(const Eigen::Vector3i& size, double voxel_m) {
  world::Volume volume;
  volume.name = "box";
  volume.size = size;
  volume.voxel_m = voxel_m;
  volume.lowest_m = -0.5 * voxel_m * size.cast<double>();
  volume.density.assign(static_cast<std::size_t>(size.prod()), 255);
  return volume;
}

/// A full sphere about its origin; voxels count by the share of them that is inside.
world::Volume sphere(double radius_m, double voxel_m) {
  const int side = static_cast<int>(std::ceil(2.0 * radius_m / voxel_m)) + 2;
  world::Volume volume = box({side, side, side}, voxel_m);
  constexpr int kParts = 4;
  for (int z = 0; z < side; ++z)
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < side; ++x) {
        int inside = 0;
        for (int k = 0; k < kParts * kParts * kParts; ++k) {
          const Eigen::Vector3d part(k % kParts, k / kParts % kParts, k / (kParts * kParts));
          const Eigen::Vector3d at =
              volume.lowest_m +
              voxel_m * (Eigen::Vector3d(x, y, z) + (part.array() + 0.5).matrix() / kParts);
          inside += at.norm() < radius_m ? 1 : 0;
        }
        volume.density[volume.index(x, y, z)] =
            static_cast<std::uint8_t>(std::lround(255.0 * inside / (kParts * kParts * kParts)));
      }
  return volume;
}

Clouds clouds_of(world::Volume volume, const world::VolumePlace& place,
                 const Eigen::Vector3d& sun = Eigen::Vector3d::UnitZ()) {
  std::vector<world::Volume> volumes;
  volumes.push_back(std::move(volume));
  return Clouds(std::move(volumes), {place}, frame_of_test(), sun);
}

Sky sky_of(const Eigen::Vector3d& sun) {
  Daylight daylight;
  daylight.sun_direction_world = sun;
  return Sky(daylight);
}

Eigen::Vector3d drawn_direction(std::uint64_t index) {
  const double z = core::random_between(-1.0, 1.0, 1, 1, index);
  const double turn = core::random_between(0.0, 2.0 * kPi, 1, 2, index);
  const double level = std::sqrt(1.0 - z * z);
  return {level * std::cos(turn), level * std::sin(turn), z};
}

TEST(Clouds, ABoxDimsByBeerAndLambertsLaw) {
  // The place lies at the world's origin, where up is z. 20 voxels of 5 m, twice as large: 200 m.
  const Clouds clouds =
      clouds_of(box({20, 20, 20}, 5.0),
                {.place_world = {0.0, 0.0, 0.0}, .scale = 2.0, .extinction_per_m = 0.004});
  // Through the middle of the box density rises and falls over a voxel at each side, half of it beyond
  // the side: what is lost is that of the box. Steps of a voxel from a side meet straight lines.
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d axis = Eigen::Vector3d::Unit(k);
    EXPECT_NEAR(clouds.optical_depth(-500.0 * axis, axis, 1e9), 0.8, 1e-6);
    EXPECT_NEAR(clouds.optical_depth(500.0 * axis, -axis, 1e9), 0.8, 1e-6);
    EXPECT_NEAR(clouds.optical_depth(-500.0 * axis, axis, 500.0), 0.4, 1e-6);
    // From the middle the last step goes over the ramp: an eighth of a voxel's 0.04.
    EXPECT_NEAR(clouds.optical_depth(Eigen::Vector3d::Zero(), axis, 1e9), 0.4, 0.006);
  }
  EXPECT_EQ(clouds.optical_depth({-500.0, 300.0, 0.0}, Eigen::Vector3d::UnitX(), 1e9), 0.0);
  // Marched by steps of two voxels, kept by steps of 1/64.
  EXPECT_NEAR(clouds.sun_transmittance({3.0, 4.0, -400.0}), std::exp(-0.8), 0.01);
  EXPECT_NEAR(clouds.sun_transmittance({3.0, 4.0, 400.0}), 1.0, 1e-12);
  // Turned by a quarter about up it is the same; by an eighth longer by the root of 2, less
  // what the ramps of two sides at once lack: a quarter of a voxel at each edge.
  world::VolumePlace turned{.heading_rad = kPi / 4.0, .scale = 2.0, .extinction_per_m = 0.004};
  const Clouds eighth = clouds_of(box({20, 20, 20}, 5.0), turned);
  EXPECT_NEAR(eighth.optical_depth({-500.0, 0.0, 0.0}, Eigen::Vector3d::UnitX(), 1e9, 20.0),
              0.8 * std::sqrt(2.0), 0.025);
}

TEST(Clouds, AShadowIsThatOfTheChordTowardTheSunFromAnySide) {
  // 62 voxels a side: the shadow's grid of every third one ends beyond each face.
  constexpr double kRadius_m = 300.0, kVoxel_m = 10.0, kExtinction_per_m = 0.002;
  for (std::uint64_t i = 0; i < 40; ++i) {
    const Eigen::Vector3d sun = drawn_direction(i);
    const Clouds clouds =
        clouds_of(sphere(kRadius_m, kVoxel_m), {.extinction_per_m = kExtinction_per_m}, sun);
    for (std::uint64_t k = 0; k < 20; ++k) {
      const double miss_m = core::random_between(0.0, 0.7 * kRadius_m, 1, 4 + k, i);
      const Eigen::Vector3d point = miss_m * sun.unitOrthogonal() - 800.0 * sun;
      const double chord_m = 2.0 * std::sqrt(kRadius_m * kRadius_m - miss_m * miss_m);
      // A third of a step of two voxels at each rim is 0.027, a step of the grid's values 0.016, and between its
      // cells of 30 m a chord bends by up to 30² / 8 · 2 / (300 · 0.71³) m in each of two directions: 0.008.
      EXPECT_NEAR(-std::log(clouds.sun_transmittance(point)), kExtinction_per_m * chord_m, 0.051)
          << sun.transpose() << ", " << miss_m;
      EXPECT_NEAR(clouds.sun_transmittance(800.0 * sun), 1.0, 1e-12);
    }
  }
}

TEST(Clouds, ShadowsAreTheSameWhicheverPlacesAskFirst) {
  const Eigen::Vector3d sun = Eigen::Vector3d(0.5, -0.3, 0.6).normalized();
  constexpr std::int64_t kPlaces = 4000;
  const auto shadows = [&](bool is_backward, bool is_parallel) {
    const Clouds clouds = clouds_of(sphere(300.0, 10.0), {.extinction_per_m = 0.002}, sun);
    std::vector<double> lights(kPlaces);
    const auto look = [&](std::int64_t i) {
      const auto k = static_cast<std::uint64_t>(is_backward ? kPlaces - 1 - i : i);
      lights[k] =
          clouds.sun_transmittance(core::random_between(0.0, 320.0, 1, 7, k) * drawn_direction(k));
    };
    if (is_parallel)
      core::parallel_for(kPlaces, look);
    else
      for (std::int64_t i = 0; i < kPlaces; ++i) look(i);
    return lights;
  };
  const std::vector<double> expected = shadows(false, false);
  EXPECT_EQ(shadows(true, false), expected);
  EXPECT_EQ(shadows(false, true), expected);
  EXPECT_EQ(shadows(true, true), expected);
}

TEST(Clouds, ASphereDimsByItsChords) {
  constexpr double kRadius_m = 300.0, kVoxel_m = 10.0;
  const Clouds clouds =
      clouds_of(sphere(kRadius_m, kVoxel_m),
                {.place_world = {1000.0, -2000.0, 700.0}, .extinction_per_m = 0.01});
  for (std::uint64_t i = 0; i < 500; ++i) {
    const Eigen::Vector3d direction = drawn_direction(i);
    const Eigen::Vector3d aside = direction.unitOrthogonal();
    const double miss_m = core::random_between(0.0, 0.8 * kRadius_m, 1, 3, i);
    const Eigen::Vector3d origin =
        Eigen::Vector3d(1000.0, -2000.0, 700.0) + miss_m * aside - 800.0 * direction;
    const double chord_m = 2.0 * std::sqrt(kRadius_m * kRadius_m - miss_m * miss_m);
    // The rim is as sharp as voxels are: a fraction of one at each end, slanted.
    EXPECT_NEAR(clouds.optical_depth(origin, direction, 1e9, 4.0), 0.01 * chord_m,
                0.01 * 0.35 * kVoxel_m);
  }
}

TEST(Clouds, FinerStepsConverge) {
  const Clouds clouds = clouds_of(sphere(200.0, 20.0), {.extinction_per_m = 0.01});
  double worst_one = 0.0, worst_four = 0.0;
  for (std::uint64_t i = 0; i < 200; ++i) {
    const Eigen::Vector3d direction = drawn_direction(i);
    const Eigen::Vector3d origin = 60.0 * direction.unitOrthogonal() - 500.0 * direction;
    const double fine = clouds.optical_depth(origin, direction, 1e9, 64.0);
    worst_one = std::max(worst_one, std::abs(clouds.optical_depth(origin, direction, 1e9) - fine));
    worst_four =
        std::max(worst_four, std::abs(clouds.optical_depth(origin, direction, 1e9, 4.0) - fine));
  }
  // The sphere's depth is 3.8: a step a voxel errs by up to a part of a voxel's 0.2 at each rim.
  EXPECT_LT(worst_one, 0.1);
  EXPECT_LT(worst_four, 0.25 * worst_one);
}

TEST(Clouds, WhatIsSeenThroughThemIsDimmedByTheSameLaw) {
  const Eigen::Vector3d sun = Eigen::Vector3d(0.3, -0.4, 0.8).normalized();
  const Clouds clouds = clouds_of(box({20, 20, 20}, 5.0), {.extinction_per_m = 0.01}, sun);
  const Sky sky = sky_of(sun);
  const auto look = [&](double until_m, double jitter) {
    return clouds.look({-500.0, 0.0, 0.0}, Eigen::Vector3d::UnitX(), until_m, {.angle_rad = 1e-3},
                       jitter, sky);
  };
  EXPECT_NEAR(look(1e9, 0.5).transmittance, std::exp(-1.0), 1e-5);
  // Any jitter loses as much, but for the ramps at both sides: half a voxel of 0.05 each.
  EXPECT_NEAR(look(1e9, 0.0).transmittance, std::exp(-1.0), 0.02);
  EXPECT_NEAR(look(500.0, 0.5).transmittance, std::exp(-0.5), 1e-5);
  EXPECT_EQ(look(440.0, 0.5).transmittance, 1.0f);
  EXPECT_TRUE((look(440.0, 0.5).radiance == 0.0f).all());
  EXPECT_GT(look(1e9, 0.5).radiance.minCoeff(), 0.0f);
  EXPECT_GT(look(1e9, 0.5).distance_m, 450.0);
  EXPECT_LT(look(1e9, 0.5).distance_m, 500.0);
}

TEST(Clouds, ThinOnesScatterOnceByTheirPhaseFunction) {
  // So thin that neither light on its way nor higher orders' depths count.
  const Eigen::Vector3d sun = Eigen::Vector3d(1.0, 0.0, 1.0).normalized();
  constexpr double kExtinction_per_m = 1e-6;
  const Clouds clouds =
      clouds_of(box({20, 20, 20}, 5.0),
                {.extinction_per_m = kExtinction_per_m, .albedo = 1.0, .anisotropy = 0.8}, sun);
  const Sky sky = sky_of(sun);
  // Toward the sun and away from it: the difference is that of the phase functions, ambient light
  // being the same.
  const auto bright = clouds.look(-500.0 * sun, sun, 1e9, {.angle_rad = 1e-3}, 0.5, sky);
  const auto dark = clouds.look(500.0 * sun, -sun, 1e9, {.angle_rad = 1e-3}, 0.5, sky);
  const double depth = clouds.optical_depth(-500.0 * sun, sun, 1e9);
  const auto phases = [](double cosine) {
    double sum = 0.0, weight = 1.0, g = 0.8;
    for (int order = 0; order < 8; ++order) {
      sum += weight * (1.0 - g * g) / (4.0 * kPi * std::pow(1.0 + g * g - 2.0 * g * cosine, 1.5));
      weight *= 0.8;
      g *= 0.5;
    }
    return sum;
  };
  const double expected =
      depth * (phases(1.0) - phases(-1.0)) * static_cast<double>(sky.sun_irradiance()[1]);
  // Both are small differences of floats.
  EXPECT_NEAR(static_cast<double>(bright.radiance[1] - dark.radiance[1]) / expected, 1.0, 0.01);
}

TEST(Clouds, SkyAndGroundLightThemByTwoStreams) {
  // At night only sky and ground give light. A level slab, 40 voxels of 5 m thick, so wide that one sees no
  // sides, seen straight from above and from below: the light that comes to the eye from each depth, summed in
  // closed form's place by 4000 thin layers.
  const Eigen::Vector3d sun = Eigen::Vector3d(1.0, 0.0, -0.04).normalized();
  const Sky sky = sky_of(sun);
  ASSERT_TRUE(sky.is_night());
  constexpr double kExtinction_per_m = 0.02, kThick_m = 200.0, kAlbedo = 0.95, kCosine = 0.8;
  const Clouds clouds = clouds_of(
      box({80, 80, 40}, 5.0),
      {.extinction_per_m = kExtinction_per_m, .albedo = kAlbedo, .anisotropy = kCosine}, sun);
  const auto through = [](double depth) { return 1.0 / (1.0 + 0.75 * (1.0 - kCosine) * depth); };
  for (const double side : {1.0, -1.0}) {
    const auto seen =
        clouds.look(side * 500.0 * Eigen::Vector3d::UnitZ(), -side * Eigen::Vector3d::UnitZ(), 1e9,
                    {.angle_rad = 1e-3}, 0.5, sky);
    for (int k = 0; k < 3; ++k) {
      const double from_sky =
          0.5 / kPi * static_cast<double>(sky.ambient().irradiance(Eigen::Vector3f::UnitZ())[k]);
      const double from_ground =
          0.5 / kPi * static_cast<double>(sky.ambient().irradiance(-Eigen::Vector3f::UnitZ())[k]);
      double expected = 0.0;
      constexpr int kLayers = 4000;
      const double whole = kExtinction_per_m * kThick_m;
      for (int i = 0; i < kLayers; ++i) {
        const double before = whole * (i + 0.5) / kLayers;
        const double above = side > 0.0 ? before : whole - before;
        expected += kAlbedo * std::exp(-before) * (whole / kLayers) *
                    (from_sky * through(above) + from_ground * through(whole - above));
      }
      // Depths stand on cells of 4 voxels, 0.4 of depth each: at the faces they end half a cell inside,
      // 0.2 of depth, which is 3 % of the light.
      EXPECT_NEAR(static_cast<double>(seen.radiance[k]), expected, 0.03 * expected) << side;
    }
  }
}

TEST(Volumes, OfAStoreAreThoseThatWereWrittenOrRefused) {
  const test::ScratchFolder folder;
  world::Volume volume = sphere(50.0, 7.0);
  world::WorldManifest manifest;
  manifest.coarsest_level = 1;
  manifest.layers.emplace_back();
  manifest.volumes.push_back(world::write_volume(folder.path(), 0, volume));
  manifest.volume_places.push_back({.volume = 0,
                                    .layer = 0,
                                    .place_world = {12.0, -3.5, 900.25},
                                    .heading_rad = 0.75,
                                    .scale = 1.5,
                                    .extinction_per_m = 0.03,
                                    .albedo = 0.9,
                                    .anisotropy = 0.5});
  world::write_manifest(folder.path(), manifest);
  const world::TileStore store = world::TileStore::open(folder.path());
  volume.name = "box";
  EXPECT_EQ(store.load_volume(0), volume);
  EXPECT_EQ(store.manifest().volume_places.at(0).place_world, Eigen::Vector3d(12.0, -3.5, 900.25));
  EXPECT_EQ(store.manifest().volume_places.at(0).scale, 1.5);
  world::write_volume(folder.path(), 0, sphere(50.0, 7.5));
  EXPECT_THROW(store.load_volume(0), core::Error);

  const std::vector<std::byte> bytes = world::encode_volume(volume);
  for (std::size_t cut : {std::size_t{0}, std::size_t{10}, bytes.size() - 1})
    EXPECT_THROW(world::decode_volume(std::span(bytes).first(cut), "cut"), core::Error);
  for (const Eigen::Vector3i& size :
       {Eigen::Vector3i(0, 1, 1), Eigen::Vector3i(5000, 1, 1), Eigen::Vector3i(4096, 4096, 4096)})
    EXPECT_THROW(world::check_volume("v", size), core::Error);
}

}  // namespace
}  // namespace terracast::scene
