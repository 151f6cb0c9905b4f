#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "scene/ground/ground.h"

// Snowfields and glaciers.
namespace terracast::scene {
namespace {

constexpr double kSnowLine_m = 2900.0;

/// Ground under a cover about a height, on slopes to all sides.
/// rise   of the slope
GroundPacket packet_at(const Ground& ground, world::Cover cover, double height_m, double rise,
                       double footprint_m, std::uint64_t first) {
  GroundPlaces places;
  for (int i = 0; i < core::kLanes; ++i) {
    const auto index = first + static_cast<std::uint64_t>(i);
    const double turn = core::random_between(0.0, 6.28, 3, 0, index);
    Eigen::Vector3d point(core::random_between(-2e4, 2e4, 3, 1, index),
                          core::random_between(-2e4, 2e4, 3, 2, index), height_m);
    point.z() -= approximate_height_m(point) - height_m;
    world::SurfaceSample surface;
    surface.spacing_m = 16.0;
    surface.cover = cover;
    surface.moisture = 0.3;
    places.set(i, point,
               Eigen::Vector3d(rise * std::cos(turn), rise * std::sin(turn), 1.0).normalized(),
               surface, footprint_m);
  }
  GroundPacket packet;
  ground.set(places, packet);
  return packet;
}

struct Albedo {
  double mean[3] = {};
  double deviation = 0.0;  ///< of green
};

Albedo albedo_of(const Ground& ground, world::Cover cover, double height_m, double rise,
                 double footprint_m) {
  Albedo found;
  constexpr std::uint64_t kNumPlaces = 16000;
  double squares = 0.0;
  for (std::uint64_t first = 0; first < kNumPlaces; first += core::kLanes) {
    GroundLook look;
    ground.look(packet_at(ground, cover, height_m, rise, footprint_m, first), look);
    for (int i = 0; i < core::kLanes; ++i) {
      for (std::size_t k = 0; k < 3; ++k)
        found.mean[k] += static_cast<double>(look.albedo[k][i]) / kNumPlaces;
      squares += std::pow(static_cast<double>(look.albedo[1][i]), 2.0) / kNumPlaces;
    }
  }
  found.deviation = std::sqrt(std::max(squares - found.mean[1] * found.mean[1], 0.0));
  return found;
}

Ground ground_of(bool has_mapped_ice) {
  return Ground({.has_sea = false, .snow_line_m = kSnowLine_m, .has_mapped_ice = has_mapped_ice});
}

TEST(Snow, IsBrightHighUpAndIceIsBlueBelowTheLine) {
  const Ground mapped = ground_of(true);
  const Albedo fresh = albedo_of(mapped, world::Cover::Snow, 4200.0, 0.1, 0.05);
  const Albedo ice = albedo_of(mapped, world::Cover::Snow, 2300.0, 0.1, 0.05);
  EXPECT_GT(fresh.mean[1], 0.75);
  EXPECT_LT(fresh.deviation, 0.05);
  // Glacier ice reflects 0.3 to 0.45 (Cuffey and Paterson 2010), less where it is dirty.
  EXPECT_GT(ice.mean[1], 0.30);
  EXPECT_LT(ice.mean[1], 0.48);
  EXPECT_GT(ice.mean[2] / ice.mean[0], 1.1);
  EXPECT_GT(ice.deviation, 0.06);
  // Where snow is guessed or derived, what lies below the line has fallen, and is no glacier's.
  const Albedo fallen = albedo_of(ground_of(false), world::Cover::Snow, 2300.0, 0.1, 0.05);
  EXPECT_GT(fallen.mean[1], 0.6);
  EXPECT_LT(fallen.mean[2] / fallen.mean[0], 1.12);
  // The bare rock of the same height is not touched.
  const Albedo rock = albedo_of(mapped, world::Cover::Bare, 2300.0, 0.1, 0.05);
  const Albedo same = albedo_of(ground_of(false), world::Cover::Bare, 2300.0, 0.1, 0.05);
  EXPECT_EQ(rock.mean[1], same.mean[1]);
}

TEST(Snow, SeenFromFarIsTheMeanOfWhatItIsFromNear) {
  const Ground ground = ground_of(true);
  for (const double rise : {0.1, 0.35})
    for (const double height_m : {2300.0, 2850.0, 4200.0}) {
      const Albedo near = albedo_of(ground, world::Cover::Snow, height_m, rise, 0.02);
      const Albedo far = albedo_of(ground, world::Cover::Snow, height_m, rise, 300.0);
      EXPECT_NEAR(far.mean[1], near.mean[1], 0.02) << rise << " " << height_m;
      EXPECT_LT(far.deviation, near.deviation);
    }
}

TEST(Snow, IsBrokenWhereIceFlowsOverSteepGround) {
  const Ground ground = ground_of(true);
  const auto share_of_slits = [&](double rise) {
    int num_slits = 0;
    for (std::uint64_t first = 0; first < 16000; first += core::kLanes) {
      GroundLook look;
      ground.look(packet_at(ground, world::Cover::Snow, 2500.0, rise, 0.05, first), look);
      for (int i = 0; i < core::kLanes; ++i)
        num_slits += look.albedo[0][i] < 0.14F && look.albedo[2][i] > 1.4F * look.albedo[0][i];
    }
    return num_slits / 16000.0;
  };
  EXPECT_LT(share_of_slits(0.05), 1e-3);
  EXPECT_GT(share_of_slits(0.35), 0.01);
}

TEST(Snow, IsCarvedAlongTheWind) {
  // Normals lean across the wind: along the directions of the first plane's u.
  const Ground ground = ground_of(false);
  double across = 0.0, along = 0.0;
  const Eigen::Vector3d u = noise_planes()[0].u.normalized(), v = noise_planes()[0].v.normalized();
  for (std::uint64_t first = 0; first < 16000; first += core::kLanes) {
    GroundLook look;
    ground.look(packet_at(ground, world::Cover::Snow, 4200.0, 0.0, 0.02, first), look);
    for (int i = 0; i < core::kLanes; ++i) {
      const Eigen::Vector3d normal(look.normal[0][i], look.normal[1][i], look.normal[2][i]);
      across += std::pow(normal.dot(u), 2.0);
      along += std::pow(normal.dot(v), 2.0);
    }
  }
  EXPECT_GT(across, 1.3 * along);
}

}  // namespace
}  // namespace terracast::scene
