#include "world/ray_query.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/random.h"
#include "tests/support/brute_terrain.h"
#include "tests/support/test_data.h"
#include "tests/world/mountains.h"
#include "tests/world/rays.h"
#include "world/embree_scene.h"

namespace terracast::world {
namespace {

using test::cast;
using test::cast_all;
using test::is_blocked;
using test::kInfinity;
using test::mixed_rays;
using test::same_bits;

TEST(RayClosedForms, Plane) {
  const test::ScratchFolder folder;
  const auto height = [](double x, double y) { return 100.0 + 0.25 * x - 0.125 * y; };
  test::TinyWorldOptions options = test::mountain_options(3);
  const TileStore store = test::make_tiny_world(folder / "world", height, options);
  const RayQuery query(store, finest_cut(store), {});
  const Eigen::Vector3d normal = Eigen::Vector3d(-0.25, 0.125, 1.0).normalized();
  std::size_t num_hits = 0;
  const std::vector<WorldRay> rays = mixed_rays(query, 2048.0, 20'000);
  const std::vector<SurfaceHit> hits = cast_all(query, rays);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Eigen::Vector3d& o = rays[i].origin_world;
    const Eigen::Vector3d& d = rays[i].direction_world;
    const double t =
        (100.0 + 0.25 * o.x() - 0.125 * o.y() - o.z()) / (d.z() - 0.25 * d.x() + 0.125 * d.y());
    const Eigen::Vector3d point = o + t * d;
    const double margin_m = 2048.0 - point.head<2>().cwiseAbs().maxCoeff();
    if (std::abs(margin_m) < 1e-6) continue;
    if (t > 0.0 && margin_m > 0.0) {
      ASSERT_FALSE(hits[i].is_sky()) << i;
      EXPECT_NEAR(hits[i].t, t, 1e-11 * t);  // heights 1e3 and coordinates 4e3 m in double
      EXPECT_NEAR((hits[i].normal_world() - normal).norm(), 0.0, 1e-14);
      ++num_hits;
    } else {
      EXPECT_TRUE(hits[i].is_sky()) << i;
    }
  }
  EXPECT_GT(num_hits, 10'000U);
}

TEST(RayClosedForms, ParaboloidWithinItsSagitta) {
  const test::ScratchFolder folder;
  constexpr double kRadius_m = 6.4e6;  // falls away like the Earth
  const TileStore store = test::make_tiny_world(
      folder / "world",
      [](double x, double y) { return 200.0 - (x * x + y * y) / (2.0 * kRadius_m); },
      {.finest_level = 6, .coarsest_level = 6});
  const RayQuery query(store, finest_cut(store), {});
  for (int k = 1; k < 200; ++k) {
    // From 50 m above the top at a falling slope: 250 - s r = 200 - r^2 / 2R.
    const double slope = 0.0057 + 0.0005 * k;
    const double angle = 0.1 * k;
    const double r = kRadius_m * (slope - std::sqrt(slope * slope - 2.0 * 50.0 / kRadius_m));
    const WorldRay ray{.origin_world = {0.0, 0.0, 250.0},
                       .direction_world = {std::cos(angle), std::sin(angle), -slope}};
    const SurfaceHit hit = cast(query, ray);
    if (r > 16'000.0) continue;
    ASSERT_FALSE(hit.is_sky());
    // A cell of 64 m (diagonal 91 m) sags by 91^2 / 8R = 0.16 mm; heights are rounded by 0.49 mm.
    const double closing = slope - r / kRadius_m;
    EXPECT_NEAR(hit.t, r, 0.7e-3 / closing) << slope;
  }
}

TEST(RayStarts, UnderTheSurfaceIsAHitAtTMin) {
  const test::ScratchFolder folder;
  const TileStore store =
      test::make_tiny_world(folder / "world", [](double x, double) { return 0.5 * x; });
  const RayQuery query(store, finest_cut(store), {});
  for (const double t_min : {0.0, 3.0}) {
    for (const double depth_m : {1e-6, 1.0, 500.0, 9000.0}) {
      for (const Eigen::Vector3d& direction :
           {Eigen::Vector3d(0.1, 0.2, 1.0), Eigen::Vector3d(1.0, 0.3, -0.1),
            Eigen::Vector3d(0.0, 0.0, -1.0)}) {
        const Eigen::Vector3d start(100.0, 50.0, 50.0 - depth_m);
        const WorldRay ray{.origin_world = start - t_min * direction,
                           .direction_world = direction,
                           .t_min = t_min};
        EXPECT_EQ(cast(query, ray).t, t_min);
        EXPECT_TRUE(is_blocked(query, ray));
      }
    }
  }
}

TEST(RayStarts, ARayThatLeavesTheSurfaceDoesNotHitItsStart) {
  const test::ScratchFolder folder;
  const TileStore store =
      test::make_tiny_world(folder / "world", [](double x, double) { return 0.5 * x; });
  const RayQuery query(store, finest_cut(store), {});
  for (const double x : {100.0, 100.3, 0.0, 512.0}) {
    const WorldRay up{.origin_world = {x, 8.0, 0.5 * x}, .direction_world = {1.0, 0.0, 0.5001}};
    EXPECT_TRUE(cast(query, up).is_sky());
    EXPECT_FALSE(is_blocked(query, up));
    const WorldRay along{.origin_world = {x, 8.0, 0.5 * x}, .direction_world = {1.0, 0.25, 0.5}};
    EXPECT_TRUE(cast(query, along).is_sky());
    const WorldRay down{.origin_world = {x, 8.0, 0.5 * x}, .direction_world = {1.0, 0.0, 0.4999}};
    EXPECT_NEAR(cast(query, down).t, 0.0, 1e-4);
    EXPECT_TRUE(is_blocked(query, down));
  }
}

// A ray from a tile's border into the tile beside its own was stopped by its start when its own
// tile lay all below it.
TEST(RayStarts, ARayThatLeavesFromABorderDoesNotHitItsStart) {
  const test::ScratchFolder folder;
  const TileStore store =
      test::make_tiny_world(folder / "world", [](double, double) { return 8.1; });
  const RayQuery query(store, finest_cut(store), {});
  const double z = *query.surface_z_world(0.0, 0.0);
  for (const double x : {0.0, 1e-9, -1e-9})
    for (const double y : {0.0, 512.3})
      for (const double dx : {-1.0, 0.0, 1.0})
        for (const double dy : {-0.7, 0.0, 0.7})
          for (const double dz : {0.0, 1e-12, 1e-6, 1.0}) {
            if (dx == 0.0 && dy == 0.0 && dz == 0.0) continue;
            for (const double off_m : {0.0, 1e-13, -1e-13}) {
              const WorldRay ray{.origin_world = {x, y, z + off_m},
                                 .direction_world = {dx, dy, dz}};
              EXPECT_TRUE(cast(query, ray).is_sky()) << x << " " << y << " " << dx << " " << dy;
              EXPECT_FALSE(is_blocked(query, ray));
            }
          }
}

TEST(RayStarts, EveryHitSeesTheCameraThatSawIt) {
  const test::ScratchFolder folder;
  const TileStore store =
      test::make_tiny_world(folder / "world", test::mountain_height_m, test::mountain_options(3));
  const RayQuery query(store, finest_cut(store), {});
  const std::vector<WorldRay> rays = mixed_rays(query, 2048.0, 100'000);
  const std::vector<SurfaceHit> hits = cast_all(query, rays);
  std::vector<WorldRay> back;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    // Those aimed exactly at borders may touch a ridge on their way, which is undecided in both
    // directions.
    if (hits[i].is_sky() || i % 5 == 0) continue;
    const Eigen::Vector3d point = rays[i].origin_world + hits[i].t * rays[i].direction_world;
    back.push_back(
        {.origin_world = point, .direction_world = rays[i].origin_world - point, .t_max = 1.0});
  }
  ASSERT_GT(back.size(), 50'000U);
  std::vector<std::uint8_t> is_occluded(back.size());
  query.occluded(back, is_occluded);
  const std::vector<SurfaceHit> back_hits = cast_all(query, back);
  for (std::size_t i = 0; i < back.size(); ++i) {
    EXPECT_EQ(is_occluded[i], 0) << i;
    EXPECT_TRUE(back_hits[i].is_sky()) << i;
  }
}

/// Folds of slope 3: 2.4 to the east and 1.8 to the north.
double fold_height_m(double x, double y) {
  const auto fold = [](double at, double period_m) {
    return std::abs(at - period_m * std::round(at / period_m));
  };
  return 2.4 * fold(x, 200.0) + 1.8 * fold(y, 150.0);
}

// x and y are 300 km, where a double is spaced 6e-11 m.
TEST(RayStarts, EveryHitFarFromTheOriginSeesTheCameraThatSawIt) {
  const test::ScratchFolder folder;
  test::TinyWorldOptions options;
  options.coarsest_level = 1;
  options.center_x = 586;  // 512 m each
  options.center_y = -586;
  options.refine = [](const TileId& id) { return id == TileId{1, 586, -586}; };
  const TileStore store = test::make_tiny_world(folder / "world", fold_height_m, options);
  const RayQuery query(store, finest_cut(store), {});
  const test::BruteTerrain brute(store, query.cut());
  constexpr std::size_t kNumRays = 40'000;
  std::vector<WorldRay> rays;
  for (std::size_t i = 0; i < kNumRays; ++i) {
    std::uint64_t draw = 0;
    const auto between = [&](double low, double high) {
      return core::random_between(low, high, 29, i, draw++);
    };
    const double x = 300'032.0 + between(-480.0, 480.0);
    const double y = -300'032.0 + between(-480.0, 480.0);
    const double z = *query.surface_z_world(x, y);
    Eigen::Vector3d start(x, y, z + std::exp(between(0.0, 7.0)));
    Eigen::Vector3d direction(between(-1.0, 1.0), between(-1.0, 1.0), between(-0.9, 0.15));
    if (i % 8 == 0) {  // from 50 km above
      start.z() += 50e3;
      direction = {between(-0.003, 0.003), between(-0.003, 0.003), -1.0};
    }
    rays.push_back({.origin_world = start, .direction_world = direction.normalized()});
  }
  const std::vector<SurfaceHit> hits = cast_all(query, rays);
  std::size_t num_steep = 0;
  std::vector<WorldRay> back;
  for (std::size_t i = 0; i < kNumRays; ++i) {
    if (i % 15 == 0) {
      const double t =
          brute.first_crossing(rays[i].origin_world, rays[i].direction_world, 0.0, kInfinity);
      EXPECT_TRUE(test::is_crossing_at(t, brute, rays[i], hits[i]))
          << "t " << hits[i].t << " where the full traversal has " << t << "; "
          << test::text(rays[i]);
    }
    if (hits[i].is_sky()) continue;
    num_steep += std::hypot(hits[i].slope_x, hits[i].slope_y) > 2.9 ? 1 : 0;
    const Eigen::Vector3d point = rays[i].origin_world + hits[i].t * rays[i].direction_world;
    back.push_back(
        {.origin_world = point, .direction_world = rays[i].origin_world - point, .t_max = 1.0});
  }
  ASSERT_GT(back.size(), kNumRays / 2);
  EXPECT_GT(num_steep, kNumRays / 3);
  std::vector<std::uint8_t> is_occluded(back.size());
  query.occluded(back, is_occluded);
  const std::vector<SurfaceHit> back_hits = cast_all(query, back);
  for (std::size_t i = 0; i < back.size(); ++i) {
    EXPECT_EQ(is_occluded[i], 0) << test::text(back[i]);
    EXPECT_TRUE(back_hits[i].is_sky()) << test::text(back[i]) << ": t " << back_hits[i].t;
  }
}

TEST(RayRanges, EndsAreKept) {
  const test::ScratchFolder folder;
  const TileStore store =
      test::make_tiny_world(folder / "world", [](double, double) { return 8.0; });
  const RayQuery query(store, finest_cut(store), {});
  WorldRay ray{.origin_world = {300.0, -20.0, 108.0}, .direction_world = {0.0, 0.0, -50.0}};
  EXPECT_EQ(cast(query, ray).t, 2.0);
  ray.t_max = 1.999;
  EXPECT_TRUE(cast(query, ray).is_sky());
  EXPECT_FALSE(is_blocked(query, ray));
  ray.t_max = 2.0;
  EXPECT_EQ(cast(query, ray).t, 2.0);
  EXPECT_TRUE(is_blocked(query, ray));
  EXPECT_TRUE(
      cast(query, {.origin_world = {5000.0, 0.0, 50.0}, .direction_world = {0, 0, -1}}).is_sky());
  // A start far outside, and directions of any length.
  for (const double length : {1e-12, 1.0, 1e12}) {
    const WorldRay far{.origin_world = {-3e6, 0.0, 3e6 + 8.0},
                       .direction_world = length * Eigen::Vector3d(1.0, 0.0, -1.0)};
    EXPECT_NEAR(cast(query, far).t * length, 3e6, 1e-8);
  }
  EXPECT_THROW(cast(query, {.origin_world = {0, 0, 0}, .direction_world = {0, 0, 0}}), core::Error);
  EXPECT_THROW(cast(query, {.origin_world = {0, 0, std::nan("")}, .direction_world = {0, 0, 1}}),
               core::Error);
}

TEST(RayRanges, ARayThatCannotBeTracedIsNamed) {
  const test::ScratchFolder folder;
  const TileStore store =
      test::make_tiny_world(folder / "world", [](double, double) { return 8.0; });
  const RayQuery query(store, finest_cut(store), {});
  struct Damage {
    const char* what;
    std::function<void(WorldRay&)> apply;
  };
  const double nan = std::nan("");
  const std::vector<Damage> damages = {
      {"t_max is NaN", [&](WorldRay& ray) { ray.t_max = nan; }},
      {"t_min is NaN", [&](WorldRay& ray) { ray.t_min = nan; }},
      {"t_min is -inf", [](WorldRay& ray) { ray.t_min = -kInfinity; }},
      {"no direction", [](WorldRay& ray) { ray.direction_world.setZero(); }},
      {"direction is NaN", [&](WorldRay& ray) { ray.direction_world.y() = nan; }},
      {"direction is infinite", [](WorldRay& ray) { ray.direction_world.z() = -kInfinity; }},
      {"origin is NaN", [&](WorldRay& ray) { ray.origin_world.x() = nan; }},
      {"origin is infinite", [](WorldRay& ray) { ray.origin_world.z() = kInfinity; }}};
  // In the middle of a group; the last ray, which fills the lanes left; in a later batch.
  struct Place {
    std::size_t bad, count;
  };
  for (const Place& place : {Place{5, 20}, Place{19, 20}, Place{69, 84}}) {
    std::vector<WorldRay> rays(place.count);
    for (std::size_t i = 0; i < place.count; ++i)
      rays[i] = {.origin_world = {3.0, 100.25 + static_cast<double>(i), 300.0},
                 .direction_world = {0.0, 0.0, -1.0}};
    const std::string name = fmt::format(", {}, ", rays[place.bad].origin_world.y());
    for (const Damage& damage : damages) {
      std::vector<WorldRay> damaged = rays;
      damage.apply(damaged[place.bad]);
      const auto expect_refusal = [&](const std::function<void()>& query_rays) {
        try {
          query_rays();
          ADD_FAILURE() << "ray " << place.bad << " of " << place.count << ", " << damage.what
                        << ": no error";
        } catch (const core::Error& error) {
          EXPECT_EQ(error.kind(), core::ErrorKind::Internal);
          EXPECT_THAT(error.what(), testing::HasSubstr(name)) << damage.what;
        }
      };
      expect_refusal([&] { cast_all(query, damaged); });
      expect_refusal([&] {
        std::vector<std::uint8_t> is_occluded(place.count);
        query.occluded(damaged, is_occluded);
      });
    }
    // The query is as good as before.
    for (const SurfaceHit& hit : cast_all(query, rays)) EXPECT_EQ(hit.t, 292.0);
  }
}

TEST(TileSeams, RaysAlongBordersCornersAndTJunctionsAlwaysHit) {
  const test::ScratchFolder folder;
  const TileStore store =
      test::make_tiny_world(folder / "world", test::mountain_height_m, test::mountain_options(3));
  const RayQuery query(store, finest_cut(store), {});
  const test::BruteTerrain brute(store, query.cut());
  std::vector<WorldRay> rays;
  std::vector<double> ground_m;
  for (const CutTile& tile : query.cut()) {
    const Eigen::Vector2d corner = tile.id.corner_world();
    for (int k = 0; k <= kTileCells; k += 8) {
      for (const Eigen::Vector2d& place :
           {Eigen::Vector2d(corner.x(), corner.y() + (k + (k > 0 ? -1 : 0)) * tile.id.spacing_m()),
            Eigen::Vector2d(corner.x() + k * tile.id.spacing_m() * 0.999, corner.y())}) {
        if (place.cwiseAbs().maxCoeff() >= 2048.0) continue;
        rays.push_back(
            {.origin_world = {place.x(), place.y(), 4000.0}, .direction_world = {0, 0, -1}});
        ground_m.push_back(brute.ground_z(place.x(), place.y()));
        // Falling steeply within the plane of the border.
        rays.push_back({.origin_world = {place.x(), 0.99 * place.y(), 4000.0},
                        .direction_world = {0.0, place.y() < 0 ? 1e-3 : -1e-3, -1.0}});
        ground_m.push_back(std::nan(""));
      }
    }
  }
  ASSERT_GT(rays.size(), 2000U);
  for (const Coherence coherence : {Coherence::Coherent, Coherence::Incoherent}) {
    const std::vector<SurfaceHit> hits = cast_all(query, rays, coherence);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      ASSERT_FALSE(hits[i].is_sky()) << rays[i].origin_world.transpose();
      if (!std::isnan(ground_m[i])) {
        EXPECT_NEAR(4000.0 - hits[i].t, ground_m[i], 1e-9);
      }
    }
  }
}

TEST(TileSeams, RaysAimedAtBordersSeeWhatRaysBesideThemSee) {
  const test::ScratchFolder folder;
  const TileStore store =
      test::make_tiny_world(folder / "world", test::mountain_height_m, test::mountain_options(3));
  const RayQuery query(store, finest_cut(store), {});
  const test::BruteTerrain brute(store, query.cut());
  const std::vector<WorldRay> rays = mixed_rays(query, 2048.0, 20'000);
  const std::vector<SurfaceHit> hits = cast_all(query, rays);
  for (std::size_t i = 0; i < rays.size(); i += 5) {
    const double t =
        brute.first_crossing(rays[i].origin_world, rays[i].direction_world, 0.0, kInfinity);
    const auto agrees = [&](double truth) {
      return hits[i].is_sky() ? std::isinf(truth) : std::abs(hits[i].t - truth) < 1e-8 * truth;
    };
    if (agrees(t)) continue;
    // It touches a ridge on the border: then it must agree with a ray that passes a nanometre
    // beside.
    bool agrees_beside = false;
    for (const Eigen::Vector3d& step :
         {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, 1)})
      for (const double beside_m : {-1e-9, 1e-9})
        agrees_beside |= agrees(brute.first_crossing(rays[i].origin_world + beside_m * step,
                                                     rays[i].direction_world, 0.0, kInfinity));
    EXPECT_TRUE(agrees_beside) << i << ": " << hits[i].t << ", " << t;
  }
}

constexpr int kTilesInRow = 6;

/// Level ground with a hill in the middle of each tile of 256 m, so that a ray that passes low
/// beside the hills has to be cast in every tile.
double hills_height_m(double x, double y) {
  const auto from_middle_m = [](double at) { return at - 256.0 * std::floor(at / 256.0) - 128.0; };
  return std::max(0.0, 500.0 - 5.0 * std::hypot(from_middle_m(x), from_middle_m(y)));
}

/// A batch of 64 rays, low along the southern border of a row of tiles, and out of the world.
/// is_eastward   of each ray; else it goes the other way
template <class Predicate>
std::vector<WorldRay> rays_along_row(const Predicate& is_eastward) {
  std::vector<WorldRay> rays;
  for (std::uint64_t i = 0; i < 64; ++i) {
    const double ahead = is_eastward(i) ? 1.0 : -1.0;
    const auto lane = static_cast<double>(i);
    rays.push_back({.origin_world = {-760.0 * ahead, 4.0 + 0.25 * lane, 20.0 + 0.5 * lane},
                    .direction_world = {ahead, core::random_between(-1e-3, 1e-3, 37, 0, i),
                                        core::random_between(-3e-3, 3e-3, 37, 1, i)}});
  }
  return rays;
}

class RayMemory : public testing::Test {
 protected:
  RayMemory() : store_(test::make_tiny_world(folder_ / "world", hills_height_m, row_options())) {}

  static test::TinyWorldOptions row_options() {
    test::TinyWorldOptions options;
    options.coarsest_level = 0;
    options.num_roots = kTilesInRow;
    return options;
  }

  /// Casts the rays where one tile fits and where two do, and checks what is loaded and held.
  /// most_loaded   tiles, of which rays_along_row need kTilesInRow
  void expect_within(const std::vector<WorldRay>& rays, std::uint64_t most_loaded) const {
    const RayQuery all(store_, finest_cut(store_), {});
    const std::vector<SurfaceHit> hits = cast_all(all, rays);
    ASSERT_EQ(all.stats().num_tiles_loaded, std::uint64_t{kTilesInRow});
    const auto bytes_of_row = static_cast<double>(all.stats().bytes_resident);
    for (const int packet_width : {8, 16}) {
      for (const double num_fitting : {1.0, 2.0}) {
        const double memory_bytes = (num_fitting - 0.5) / kTilesInRow * bytes_of_row +
                                    static_cast<double>(TileScene::kMostBytesWhileLoading);
        const RayQuery query(store_, all.cut(),
                             {.memory_bytes = memory_bytes, .packet_width = packet_width});
        EXPECT_TRUE(same_bits(cast_all(query, rays), hits));
        const RayQueryStats stats = query.stats();
        const std::string where =
            fmt::format("packets of {}, {} tiles fit", packet_width, num_fitting);
        EXPECT_LE(stats.num_tiles_loaded, most_loaded) << where;
        EXPECT_GT(stats.num_tiles_evicted, 0U) << where;
        EXPECT_LE(static_cast<double>(stats.peak_bytes_resident), memory_bytes) << where;
      }
    }
  }

  test::ScratchFolder folder_;
  TileStore store_;
};

TEST_F(RayMemory, RaysThatTravelTogetherLoadATileOnce) {
  std::vector<WorldRay> rays = rays_along_row([](std::uint64_t) { return true; });
  expect_within(rays, kTilesInRow);
  for (int k = 0; k < 20; ++k) rays.insert(rays.end(), rays.begin(), rays.begin() + 64);
  expect_within(rays, kTilesInRow);
}

TEST_F(RayMemory, RaysOfLongCallsLoadATileOnceEveryFewThousand) {
  const std::vector<WorldRay> row = rays_along_row([](std::uint64_t) { return true; });
  std::vector<WorldRay> rays;
  for (int k = 0; k < 160; ++k) rays.insert(rays.end(), row.begin(), row.end());
  expect_within(rays, 3 * kTilesInRow);
}

TEST_F(RayMemory, RaysThatPassEachOtherHoldATileOnce) {
  // Those that go one way and those that go the other may each load the row.
  expect_within(rays_along_row([](std::uint64_t i) { return i < 32; }), 2 * kTilesInRow);
  expect_within(rays_along_row([](std::uint64_t i) { return i / 8 % 2 == 0; }), 2 * kTilesInRow);
  expect_within(rays_along_row([](std::uint64_t i) { return i % 2 == 0; }), 2 * kTilesInRow);
}

TEST_F(RayMemory, CountsRaysCastsAndLanes) {
  const std::vector<WorldRay> rays = rays_along_row([](std::uint64_t i) { return i % 3 != 0; });
  for (const int packet_width : {8, 16}) {
    const RayQuery query(store_, finest_cut(store_), {.packet_width = packet_width});
    const auto lanes = static_cast<std::uint64_t>(packet_width);
    test::cast(query, rays[0]);
    RayQueryStats stats = query.stats();
    EXPECT_EQ(stats.num_rays, 1U);
    EXPECT_EQ(stats.num_casts, std::uint64_t{kTilesInRow});
    EXPECT_EQ(stats.num_lanes, kTilesInRow * lanes);

    std::uint64_t num_rays = 1;
    for (const std::size_t count : {std::size_t{20}, std::size_t{64}}) {
      const std::span<const WorldRay> part = std::span(rays).first(count);
      cast_all(query, part);
      std::vector<std::uint8_t> is_occluded(count);
      query.occluded(part, is_occluded);
      num_rays += 2 * count;
      stats = query.stats();
      EXPECT_EQ(stats.num_rays, num_rays);
      EXPECT_EQ(stats.num_casts, kTilesInRow * num_rays);  // each ray in each tile of the row
      EXPECT_LE(stats.num_casts, stats.num_lanes);
      EXPECT_EQ(stats.num_lanes % lanes, 0U);
    }
  }
}

TEST(RaySurface, TellsWhatTheTileHolds) {
  const test::ScratchFolder folder;
  test::TinyWorldOptions options;
  options.cover = [](double x, double) { return x < 0 ? Cover::Sea : Cover::Land; };
  options.moisture = [](double x, double) { return (x + 1024.0) / 2048.0; };
  const TileStore store = test::make_tiny_world(
      folder / "world", [](double x, double y) { return 0.3 * x + y; }, options);
  const RayQuery query(store, finest_cut(store), {});
  for (const double x : {-700.3, -3.0, 5.0, 611.7}) {
    const WorldRay ray{.origin_world = {x, 33.3, 4000.0}, .direction_world = {0, 0, -1}};
    SurfaceHit hit;
    SurfaceSample sample;
    query.intersect({&ray, 1}, {&hit, 1}, Coherence::Incoherent, {&sample, 1});
    EXPECT_EQ(sample.cover, x < -2.0 ? Cover::Sea : Cover::Land);
    EXPECT_NEAR(sample.moisture, (x + 1024.0) / 2048.0, 0.6 / 255.0);  // stored in 8 bits
    EXPECT_EQ(sample.spacing_m, 4.0);
    EXPECT_EQ(sample.source, 0);
    EXPECT_NEAR(*query.surface_z_world(x, 33.3), 4000.0 - hit.t, 1e-12 * 4000.0);
  }
  EXPECT_TRUE(query.surface_z_world(1024.0, 1024.0).has_value());
  EXPECT_FALSE(query.surface_z_world(1024.1, 0.0).has_value());
}

}  // namespace
}  // namespace terracast::world
