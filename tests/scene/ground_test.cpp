#include "scene/ground/ground.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "core/lanes.h"
#include "core/random.h"
#include "scene/ground/noise.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_world.h"

namespace terracast::scene {
namespace {

Eigen::Vector3d random_place(std::uint64_t index, double reach_m) {
  return {core::random_between(-reach_m, reach_m, 1, 0, index),
          core::random_between(-reach_m, reach_m, 1, 1, index),
          core::random_between(0.0, 3000.0, 1, 2, index)};
}

/// place(lane) says where each lane is.
template <class Place>
NoisePlaces noise_places(double footprint_m, const Place& place) {
  core::Lanes3d points;
  core::Lanes<double> footprints_m;
  for (int i = 0; i < core::kLanes; ++i) {
    const Eigen::Vector3d point = place(i);
    for (std::size_t k = 0; k < 3; ++k) points[k][i] = point[static_cast<int>(k)];
    footprints_m[i] = footprint_m;
  }
  NoisePlaces places;
  places.set(points, footprints_m);
  return places;
}

TEST(Noise, OctavesHaveUnitRms) {
  double value = 0.0;
  double slope_square = 0.0;
  int num_samples = 0;
  core::Lanes<float> weight;
  core::Lanes<float> below;
  for (int i = 0; i < core::kLanes; ++i) {
    weight[i] = 1.0f;
    below[i] = 1e9f;
  }
  for (std::uint64_t packet = 0; packet < 4000; ++packet) {
    const NoisePlaces places = noise_places(0.0, [&](int i) {
      return random_place(packet * core::kLanes + static_cast<std::uint64_t>(i), 20e3);
    });
    NoiseSlope slope{};
    const NoiseSum sum = sum_noise_with_slope(places, 4, 2, 5, weight, below, slope);
    for (int i = 0; i < core::kLanes; ++i) {
      value += static_cast<double>(sum.value[i] * sum.value[i]);
      for (int plane = 0; plane < kNumNoisePlanes; ++plane)
        slope_square += static_cast<double>(slope.u[plane][i] * slope.u[plane][i]);
      EXPECT_EQ(sum.left_out[i], 0.0f);
      ++num_samples;
    }
  }
  // 64,000 samples of octaves that are independent from cell to cell: 1 % is 4 sigma.
  EXPECT_NEAR(std::sqrt(value / num_samples), 1.0, 0.01);
  EXPECT_NEAR(std::sqrt(slope_square / num_samples / 3.0), 1.0, 0.01);
}

TEST(Noise, StepsAreRoundedDown) {
  core::Lanes<double> metres;
  core::Lanes<std::int32_t> steps;
  for (std::uint64_t packet = 0; packet < 20000; ++packet) {
    for (int i = 0; i < core::kLanes; ++i) {
      const std::uint64_t index = packet * core::kLanes + static_cast<std::uint64_t>(i);
      metres[i] = core::random_between(-3e5, 3e5, 4, 0, index);
      if (index % 3 == 0) metres[i] = std::round(metres[i] / kNoiseStep_m) * kNoiseStep_m;
    }
    count_steps(metres, steps);
    for (int i = 0; i < core::kLanes; ++i) {
      const auto whole = static_cast<std::int64_t>(std::floor(metres[i] / kNoiseStep_m));
      ASSERT_EQ(steps[i], static_cast<std::int32_t>(static_cast<std::uint32_t>(whole)))
          << metres[i];
    }
  }
}

TEST(Noise, AllOctavesAreThoseOfAFootprintOfZero) {
  for (std::uint64_t packet = 0; packet < 500; ++packet) {
    const NoisePlaces places = noise_places(0.0, [&](int i) {
      return random_place(packet * core::kLanes + static_cast<std::uint64_t>(i), 20e3);
    });
    for (const auto& [coarsest, finest] : {std::pair(12, 8), std::pair(7, 5), std::pair(4, -7)}) {
      const NoiseSum sum = sum_noise(places, coarsest, finest, 7);
      const core::Lanes<float> all = sum_all_noise(places, coarsest, finest, 7);
      for (int i = 0; i < core::kLanes; ++i) ASSERT_EQ(all[i], sum.value[i]);
    }
  }
}

// Against central differences, at a place 25 km out where floats of the world would be 2 mm apart.
TEST(Noise, SlopesAreTheDerivativeAndPlacesAreSharpFarOut) {
  core::Lanes<float> weight;
  core::Lanes<float> below;
  const NoisePlane& plane = noise_planes()[(-2 + 192) % kNumNoisePlanes];
  const double step_m = 4 * kNoiseStep_m;
  for (int i = 0; i < core::kLanes; ++i) {
    weight[i] = 1.0f;
    below[i] = 1e9f;
  }
  const auto beside = [&](double steps) {
    return noise_places(0.0, [&](int i) -> Eigen::Vector3d {
      return Eigen::Vector3d(25000.0 + 0.0371 * i, -24000.0 + 0.0213 * i, 512.0) +
             steps * step_m * plane.u.cwiseProduct(Eigen::Vector3d(1, 1, 0));
    });
  };
  const NoisePlaces places = beside(0.0);
  const NoisePlaces ahead = beside(1.0);
  const NoisePlaces behind = beside(-1.0);
  NoiseSlope slope{};
  NoiseSlope unused{};
  const NoiseSum here = sum_noise_with_slope(places, -2, -2, 9, weight, below, slope);
  const NoiseSum up = sum_noise_with_slope(ahead, -2, -2, 9, weight, below, unused);
  const NoiseSum down = sum_noise_with_slope(behind, -2, -2, 9, weight, below, unused);
  bool varies = false;
  for (int i = 0; i < core::kLanes; ++i) {
    // Values and slopes are scaled to unit rms by 0.1760 and 0.5098 a cell of 0.25 m; coordinates
    // round to a step.
    const double difference =
        static_cast<double>(up.value[i] - down.value[i]) * 0.1760 / (2.0 * step_m) * 0.25;
    EXPECT_NEAR(difference, static_cast<double>(slope.u[(-2 + 192) % kNumNoisePlanes][i]) * 0.5098,
                0.35);
    varies = varies || std::abs(here.value[i] - here.value[0]) > 0.05f;
  }
  EXPECT_TRUE(varies);
}

TEST(Noise, OctavesFadeSmoothlyWithTheFootprint) {
  const auto here = [](int) { return Eigen::Vector3d(1234.5, 678.9, 100.0); };
  float last = 0.0f;
  for (int k = 0; k < 2000; ++k) {
    const double footprint_m = 0.01 * std::exp(0.004 * k);
    const float value = sum_noise(noise_places(footprint_m, here), 6, -7, 3).value[0];
    // One octave in 14 comes in over a factor of two: 173 steps; no step may bring more than a
    // sixteenth of one.
    if (k > 0) {
      EXPECT_LT(std::abs(value - last), 0.06f) << footprint_m;
    }
    last = value;
  }
  const NoisePlaces places = noise_places(64.0, here);
  EXPECT_EQ(sum_noise(places, 6, -7, 3).value[0],
            0.0f);  // all octaves are finer than the footprint
  EXPECT_EQ(sum_noise(places, 6, -7, 3).left_out[0], 1.0f);
}

// Along u, by central differences, at beds whose coordinates the test makes.
TEST(Noise, SlopesOfGivenCoordinatesAreTheDerivative) {
  core::Lanes<float> footprint_m{};
  core::Lanes<float> weight;
  core::Lanes<std::int32_t> u, v, ahead, behind;
  constexpr int kSteps = 64;
  for (int i = 0; i < core::kLanes; ++i) {
    const auto index = static_cast<std::uint64_t>(i);
    weight[i] = 0.5f;
    u[i] = static_cast<std::int32_t>(core::random_between(-4e8, 4e8, 6, 0, index));
    v[i] = static_cast<std::int32_t>(core::random_between(-4e8, 4e8, 6, 1, index));
    ahead[i] = u[i] + kSteps;
    behind[i] = u[i] - kSteps;
  }
  for (const int level : {1, 4, 6}) {
    core::Lanes<float> slope{};
    const NoiseSum here =
        sum_noise_at_with_slope(u, v, footprint_m, level, level, 5, weight, slope);
    const NoiseSum plain = sum_noise_at(u, v, footprint_m, level, level, 5);
    const NoiseSum up = sum_noise_at(ahead, v, footprint_m, level, level, 5);
    const NoiseSum down = sum_noise_at(behind, v, footprint_m, level, level, 5);
    const double cell_m = std::ldexp(1.0, level);
    for (int i = 0; i < core::kLanes; ++i) {
      EXPECT_EQ(here.value[i], plain.value[i]);
      // Both are scaled to unit rms: by 0.1760 of a value and 0.5098 of a slope a cell.
      const double difference = static_cast<double>(up.value[i] - down.value[i]) * 0.1760 * cell_m /
                                (2.0 * kSteps * kNoiseStep_m);
      // Floats of the values: 2e-7 over a thirty-second of a metre; the third derivative adds less.
      EXPECT_NEAR(difference, static_cast<double>(slope[i]) * 0.5098 / 0.5, 2e-3) << level;
    }
  }
}

GroundPacket packet_at(const Ground& ground, std::uint64_t first, double footprint_m) {
  GroundPlaces places;
  for (int i = 0; i < core::kLanes; ++i) {
    const auto index = first + static_cast<std::uint64_t>(i);
    Eigen::Vector3d normal(core::random_between(-0.9, 0.9, 2, 0, index),
                           core::random_between(-0.9, 0.9, 2, 1, index), 1.0);
    normal.normalize();
    world::SurfaceSample surface;
    surface.spacing_m = 4.0;
    surface.cover = static_cast<world::Cover>(index % 8 == 0);
    surface.moisture = core::random_unit(2, 2, index);
    places.set(i, random_place(index, 20e3), normal, surface, footprint_m);
  }
  GroundPacket packet;
  ground.set(places, packet);
  return packet;
}

TEST(Ground, ClassesDoNotDependOnTheFootprint) {
  const Ground ground({.sea_level_m = 0.0, .has_sea = true});
  std::set<int> seen;
  for (std::uint64_t first = 0; first < 16000; first += core::kLanes) {
    core::Lanes<std::uint8_t> near;
    core::Lanes<std::uint8_t> far;
    ground.classify(packet_at(ground, first, 0.01), near);
    ground.classify(packet_at(ground, first, 300.0), far);
    for (int i = 0; i < core::kLanes; ++i) {
      EXPECT_EQ(near[i], far[i]);
      seen.insert(near[i]);
    }
  }
  // Sea, rock, scree, grass, soil, snow at least: the palette is used.
  EXPECT_GE(seen.size(), 6u);
}

TEST(Ground, LooksArePhysicalAndNormalsUnit) {
  const Ground ground({.sea_level_m = 0.0, .has_sea = true});
  for (const double footprint_m : {0.02, 1.0, 40.0, 5000.0}) {
    for (std::uint64_t first = 0; first < 1600; first += core::kLanes) {
      GroundLook look;
      ground.look(packet_at(ground, first, footprint_m), look);
      for (int i = 0; i < core::kLanes; ++i) {
        double square = 0.0;
        for (std::size_t k = 0; k < 3; ++k) {
          EXPECT_GT(look.albedo[k][i], 0.0f);
          EXPECT_LE(look.albedo[k][i], 0.9f);
          square += static_cast<double>(look.normal[k][i] * look.normal[k][i]);
        }
        EXPECT_NEAR(square, 1.0, 1e-5);
        EXPECT_GE(look.openness[i], 0.0f);
        EXPECT_LE(look.openness[i], 1.0f);
      }
    }
  }
}

/// A crag of one slope, with gullies or without, about `middle`; `place(lane)` in its plane, metres east and north.
template <class Place>
GroundLook look_at_crag(const Ground& ground, const Eigen::Vector3d& middle, double moisture,
                        double footprint_m, const Place& place) {
  GroundPlaces places;
  const Eigen::Vector3d normal = Eigen::Vector3d(0.9, -0.7, 1.0).normalized();
  world::SurfaceSample surface;
  surface.spacing_m = 32.0;
  surface.cover = world::Cover::Bare;
  surface.moisture = moisture;
  for (int i = 0; i < core::kLanes; ++i) {
    const Eigen::Vector2d at = place(i);
    places.set(i, middle + Eigen::Vector3d(at.x(), at.y(), -0.9 * at.x() + 0.7 * at.y()), normal,
               surface, footprint_m);
  }
  GroundPacket packet;
  ground.set(places, packet);
  GroundLook look;
  ground.look(packet, look);
  return look;
}

// What is seen from far is the mean of what is seen from near: beds, gullies and scars neither darken nor
// brighten a face as it comes nearer.
TEST(Ground, CragsSeenFromFarAreTheMeanOfThoseSeenFromNear) {
  const Ground ground({.sea_level_m = 0.0, .has_sea = false});
  constexpr int kNumFaces = 150;
  for (const double moisture : {0.05, 0.14, 0.40}) {
    for (const double footprint_m : {4.0, 24.0, 100.0}) {
      Eigen::Vector3d near = Eigen::Vector3d::Zero();
      Eigen::Vector3d far = Eigen::Vector3d::Zero();
      for (std::uint64_t face = 0; face < kNumFaces; ++face) {
        const Eigen::Vector3d middle(core::random_between(-20e3, 20e3, 8, 0, face),
                                     core::random_between(-20e3, 20e3, 8, 1, face),
                                     core::random_between(1200.0, 2400.0, 8, 2, face));
        // Strewn over a footprint's window by the R2 sequence (Roberts 2018).
        const auto strewn = [&](int index) -> Eigen::Vector2d {
          return footprint_m *
                 Eigen::Vector2d(std::fmod(0.7548776662466927 * index + 0.5, 1.0) - 0.5,
                                 std::fmod(0.5698402909980532 * index + 0.5, 1.0) - 0.5);
        };
        const GroundLook whole =
            look_at_crag(ground, middle, moisture, footprint_m,
                         [](int) -> Eigen::Vector2d { return Eigen::Vector2d::Zero(); });
        constexpr int kNumPackets = 8;
        for (std::size_t k = 0; k < 3; ++k)
          far[static_cast<int>(k)] += static_cast<double>(whole.albedo[k][0]) / kNumFaces;
        for (int packet = 0; packet < kNumPackets; ++packet) {
          const GroundLook part = look_at_crag(ground, middle, moisture, 0.02, [&](int i) {
            return strewn(packet * core::kLanes + i);
          });
          for (std::size_t k = 0; k < 3; ++k)
            for (int i = 0; i < core::kLanes; ++i)
              near[static_cast<int>(k)] +=
                  static_cast<double>(part.albedo[k][i]) / (kNumFaces * kNumPackets * core::kLanes);
        }
      }
      // The mean of 150 faces is good to 0.012. Grass on ledges hides pale beds more often than others, which from
      // far are told apart no more: 0.03. What cracks, stones and debris between them shade: 0.03.
      for (int k = 0; k < 3; ++k)
        EXPECT_NEAR(far[k] / near[k], 1.0, 0.08)
            << "colour " << k << ", moisture " << moisture << ", footprint " << footprint_m;
    }
  }
}

// What a town has on steep slopes is not paved: it looks as thickets do there, and on level ground
// otherwise than they.
TEST(Ground, TownsPaveNoSlopes) {
  const Ground ground({.sea_level_m = 0.0, .has_sea = false});
  const auto look_at = [&](world::Cover cover, std::uint64_t first, double slope) {
    GroundPlaces places;
    for (int i = 0; i < core::kLanes; ++i) {
      world::SurfaceSample surface;
      surface.spacing_m = 8.0;
      surface.cover = cover;
      surface.moisture = 0.2;
      // As far out, "up" is not the plane's: the slope is small beside what decides.
      Eigen::Vector3d point = 0.1 * random_place(first + static_cast<std::uint64_t>(i), 20e3);
      places.set(i, point, Eigen::Vector3d(-slope, 0.0, 1.0).normalized(), surface, 0.1);
    }
    GroundPacket packet;
    ground.set(places, packet);
    GroundLook look;
    ground.look(packet, look);
    return look;
  };
  const auto share_of_thickets = [&](double slope_deg) {
    constexpr std::uint64_t kNum = 8000;
    const double slope = std::tan(slope_deg * EIGEN_PI / 180.0);
    int num = 0;
    for (std::uint64_t first = 0; first < kNum; first += core::kLanes) {
      const core::Lanes<float> town = look_at(world::Cover::BuiltUp, first, slope).albedo[0];
      const core::Lanes<float> thicket = look_at(world::Cover::Shrubs, first, slope).albedo[0];
      for (int i = 0; i < core::kLanes; ++i) num += town[i] == thicket[i] ? 1 : 0;
    }
    return static_cast<double>(num) / kNum;
  };
  // Half of the ground is paved at 15 degrees: hardly any of it is all thicket at 10, most at 20.
  EXPECT_LT(share_of_thickets(1.0), 0.01);
  EXPECT_LT(share_of_thickets(10.0), 0.05);
  EXPECT_GT(share_of_thickets(20.0), 0.5);
  EXPECT_EQ(share_of_thickets(38.0), 1.0);
}

// Gullies gather snow where there is some: more of it than ribs of the same height.
TEST(Ground, SnowLiesInGulliesBelowItsLineAndTheirClassSaysSo) {
  const Ground ground({.sea_level_m = 0.0, .has_sea = false, .snow_line_m = 2900.0});
  int num_snow[2] = {0, 0};
  for (std::uint64_t first = 0; first < 8000; first += core::kLanes)
    for (const int is_gully : {0, 1}) {
      GroundPlaces places;
      for (int i = 0; i < core::kLanes; ++i) {
        const auto index = first + static_cast<std::uint64_t>(i);
        const double turn = core::random_between(0.0, 6.28, 9, 0, index);
        world::SurfaceSample surface;
        surface.spacing_m = 8.0;
        surface.cover = world::Cover::Bare;
        surface.moisture = is_gully != 0 ? 0.40 : 0.05;
        Eigen::Vector3d point = random_place(index, 20e3);
        point.z() = core::random_between(2400.0, 2800.0, 9, 1, index);
        point.z() -= approximate_height_m(point) - point.z();
        places.set(i, point, Eigen::Vector3d(std::cos(turn), std::sin(turn), 1.2).normalized(),
                   surface, 0.02);
      }
      GroundPacket packet;
      ground.set(places, packet);
      core::Lanes<std::uint8_t> classes;
      ground.classify(packet, classes);
      GroundLook look;
      ground.look(packet, look);
      for (int i = 0; i < core::kLanes; ++i) {
        const bool is_snow = classes[i] == static_cast<std::uint8_t>(core::SemanticClass::Snow);
        num_snow[is_gully] += is_snow ? 1 : 0;
        // Half of it snow at least.
        if (is_snow) {
          EXPECT_GT(look.albedo[2][i], 0.30f);
        }
      }
    }
  EXPECT_GT(num_snow[1], 3 * num_snow[0]);
  EXPECT_GT(num_snow[1], 400);
  EXPECT_LT(num_snow[1], 6000);
}

// Waves that the footprint leaves out go on as a spread of slopes: all in all water is as rough from far as from
// near. Lakes have no waves of 8 m and more.
TEST(Ground, WaterIsAsRoughFromFarAsFromNear) {
  const Ground ground({.sea_level_m = 0.0, .has_sea = true});
  for (const world::Cover cover : {world::Cover::Sea, world::Cover::Lake, world::Cover::River}) {
    double first = 0.0;
    for (const double footprint_m : {0.02, 0.7, 3.0, 11.0, 200.0}) {
      double drawn = 0.0;
      double spread = 0.0;
      int num_places = 0;
      for (std::uint64_t index = 0; index < 24000; index += core::kLanes) {
        GroundPlaces places;
        world::SurfaceSample surface;
        surface.spacing_m = 4.0;
        surface.cover = cover;
        for (int i = 0; i < core::kLanes; ++i) {
          Eigen::Vector3d point = random_place(index + static_cast<std::uint64_t>(i), 20e3);
          point.z() = 0.0;
          places.set(i, point, Eigen::Vector3d::UnitZ(), surface, footprint_m);
        }
        GroundPacket packet;
        ground.set(places, packet);
        GroundLook look;
        ground.look(packet, look);
        for (int i = 0; i < core::kLanes; ++i) {
          const double up = static_cast<double>(look.normal[2][i]);
          drawn += 1.0 / (up * up) - 1.0;  // squared tangent
          spread += static_cast<double>(look.wave_variance[i]);
          ++num_places;
        }
      }
      drawn /= num_places;
      spread /= num_places;
      if (first == 0.0) first = drawn + spread;
      // 24,000 squares of slopes are good to 1 %, gusts of the spread to 1 % of it; while an octave fades, what
      // of it is drawn and what is left out are each known by its weight squared.
      EXPECT_NEAR((drawn + spread) / first, 1.0, 0.04)
          << static_cast<int>(cover) << " at " << footprint_m << " m: drawn " << drawn;
      if (cover != world::Cover::Sea && footprint_m > 10.0) {
        EXPECT_LT(drawn, 1e-9);
      }
    }
  }
}

TEST(Climate, SeaLevelComesFromTheSea) {
  const test::ScratchFolder folder;
  test::TinyWorldOptions options;
  options.coarsest_level = 3;
  options.finest_level = 3;
  options.cover = [](double x, double) { return x < 0.0 ? world::Cover::Sea : world::Cover::Land; };
  const auto store = test::make_tiny_world(
      folder / "sea", [](double x, double) { return x < 0.0 ? 48.0 : 60.0; }, options);
  const Climate climate = climate_of(store, 1);
  EXPECT_TRUE(climate.has_sea);
  EXPECT_NEAR(climate.sea_level_m, 48.0, 0.5);  // the Earth falls away by 0.7 m at 3 km
  // 46 degrees north: the Alps' snow line in summer, about 2900 m.
  EXPECT_NEAR(climate.snow_line_m, 2930.0, 100.0);
}

TEST(Climate, SeaBeyondTheSquareDoesNotCount) {
  // So far out the height of a place is known to metres only, and beaches are narrow.
  const test::ScratchFolder folder;
  test::TinyWorldOptions options;
  options.coarsest_level = 3;
  options.finest_level = 3;
  options.cover = [](double x, double) { return x < 0.0 ? world::Cover::Sea : world::Cover::Land; };
  const auto store = test::make_tiny_world(
      folder / "sea", [](double x, double) { return x < -1000.0 ? 148.0 : 48.0; }, options);
  world::WorldManifest manifest = store.manifest();
  manifest.size_m = 2000.0;
  world::write_manifest(folder / "sea", std::move(manifest));
  EXPECT_NEAR(climate_of(world::TileStore::open(folder / "sea"), 1).sea_level_m, 48.0, 0.5);
}

}  // namespace
}  // namespace terracast::scene
