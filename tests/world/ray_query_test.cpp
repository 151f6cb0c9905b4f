#include "world/ray_query.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <immintrin.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <thread>

#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "tests/support/brute_terrain.h"
#include "tests/support/test_data.h"
#include "tests/world/mountains.h"

namespace terracast::world {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

SurfaceHit cast(const RayQuery& query, const WorldRay& ray) {
  SurfaceHit hit;
  query.intersect({&ray, 1}, {&hit, 1}, Coherence::Incoherent);
  return hit;
}

bool is_blocked(const RayQuery& query, const WorldRay& ray) {
  std::uint8_t answer = 2;
  query.occluded({&ray, 1}, {&answer, 1});
  return answer == 1;
}

bool same_bits(const std::vector<SurfaceHit>& a, const std::vector<SurfaceHit>& b) {
  return std::equal(
      a.begin(), a.end(), b.begin(), b.end(), [](const SurfaceHit& p, const SurfaceHit& q) {
        return std::memcmp(&p.t, &q.t, sizeof p.t) == 0 && p.tile_index == q.tile_index &&
               p.cell_x == q.cell_x && p.cell_y == q.cell_y && p.upper == q.upper &&
               p.slope_x == q.slope_x && p.slope_y == q.slope_y;
      });
}

/// Rays of every kind over a world of a size: downward, level, along and across borders.
std::vector<WorldRay> mixed_rays(const RayQuery& query, double half_size_m, std::size_t count) {
  std::vector<WorldRay> rays(count);
  for (std::size_t i = 0; i < count; ++i) {
    std::uint64_t draw = 0;
    const auto between = [&](double low, double high) {
      return core::random_between(low, high, 3, i, draw++);
    };
    const double x = between(-0.95, 0.95) * half_size_m;
    const double y = between(-0.95, 0.95) * half_size_m;
    rays[i].origin_world = {x, y, *query.surface_z_world(x, y) + std::exp(between(0.0, 7.0))};
    rays[i].direction_world = {between(-1.0, 1.0), between(-1.0, 1.0), between(-0.6, 0.15)};
    if (i % 5 == 0) {  // aimed exactly at a place on a grid of tile borders
      const Eigen::Vector2d place(256.0 * std::round(between(-0.9, 0.9) * half_size_m / 256.0),
                                  between(-0.9, 0.9) * half_size_m);
      const double z = *query.surface_z_world(place.x(), place.y());
      rays[i].direction_world = Eigen::Vector3d(place.x(), place.y(), z) - rays[i].origin_world;
    }
  }
  return rays;
}

std::vector<SurfaceHit> cast_all(const RayQuery& query, const std::vector<WorldRay>& rays,
                                 Coherence coherence = Coherence::Incoherent) {
  std::vector<SurfaceHit> hits(rays.size());
  query.intersect(rays, hits, coherence);
  return hits;
}

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

class RayPurity : public testing::Test {
 protected:
  RayPurity()
      : store_(test::make_tiny_world(folder_ / "world", test::mountain_height_m,
                                     test::mountain_options(2))),
        query_(store_, finest_cut(store_), {}),
        rays_(mixed_rays(query_, 1024.0, 20'000)),
        hits_(cast_all(query_, rays_)) {}

  void expect_same(const RayQueryOptions& options) const {
    const RayQuery other(store_, query_.cut(), options);
    EXPECT_TRUE(same_bits(cast_all(other, rays_), hits_));
  }

  test::ScratchFolder folder_;
  TileStore store_;
  RayQuery query_;
  std::vector<WorldRay> rays_;
  std::vector<SurfaceHit> hits_;
};

TEST_F(RayPurity, ResultsDoNotDependOnPackets) {
  std::vector<SurfaceHit> singly;
  for (const WorldRay& ray : rays_) singly.push_back(cast(query_, ray));
  EXPECT_TRUE(same_bits(singly, hits_));
  EXPECT_TRUE(same_bits(cast_all(query_, rays_, Coherence::Coherent), hits_));
  std::vector<WorldRay> reversed(rays_.rbegin(), rays_.rend());
  std::vector<SurfaceHit> hits = cast_all(query_, reversed);
  std::reverse(hits.begin(), hits.end());
  EXPECT_TRUE(same_bits(hits, hits_));
}

TEST_F(RayPurity, OccludedAnswersAsIntersect) {
  std::vector<std::uint8_t> is_occluded(rays_.size());
  query_.occluded(rays_, is_occluded);
  for (std::size_t i = 0; i < rays_.size(); ++i)
    EXPECT_EQ(is_occluded[i] == 1, !hits_[i].is_sky()) << i;
}

TEST_F(RayPurity, ResultsDoNotDependOnTheLocalOrigin) {
  for (const Eigen::Vector3d& origin :
       {Eigen::Vector3d(0.3, 0.7, 0.1), Eigen::Vector3d(20'000.0, -20'000.0, 500.0)})
    expect_same({.local_origin_world = origin});
}

TEST_F(RayPurity, ResultsDoNotDependOnEmbreesProfile) {
  expect_same({.embree_profile = "isa=sse4.2,frequency_level=simd128"});
  EXPECT_THROW(RayQuery(store_, query_.cut(), {.embree_profile = "isa=sse9"}), core::Error);
}

TEST_F(RayPurity, ResultsDoNotDependOnThreadsOrTheBudget) {
  for (const int num_threads : {1, 2}) {
    const core::ThreadLimit limit(num_threads);
    for (const double memory_bytes : {1.0, 5e6, 8e9}) {
      const RayQuery other(store_, query_.cut(), {.memory_bytes = memory_bytes});
      // One tile at a time makes every packet load anew: fewer rays.
      const std::int64_t count = memory_bytes < 8e9 ? 48 : static_cast<std::int64_t>(rays_.size());
      std::vector<SurfaceHit> hits(static_cast<std::size_t>(count));
      core::parallel_for_blocks(count, 24, [&](std::int64_t begin, std::int64_t end) {
        const auto at = static_cast<std::size_t>(begin);
        const auto size = static_cast<std::size_t>(end - begin);
        other.intersect(std::span(rays_).subspan(at, size), std::span(hits).subspan(at, size),
                        Coherence::Incoherent);
      });
      EXPECT_TRUE(same_bits(hits, {hits_.begin(), hits_.begin() + count}));
      const RayQueryStats stats = other.stats();
      if (memory_bytes == 1.0) {
        EXPECT_GT(stats.num_tiles_evicted, 0U);
        EXPECT_LE(stats.peak_bytes_resident, query_.stats().peak_bytes_resident * 2);
      } else if (memory_bytes == 8e9) {
        EXPECT_LE(stats.num_tiles_loaded, query_.cut().size());
        EXPECT_EQ(stats.num_tiles_evicted, 0U);
      }
    }
  }
}

TEST_F(RayPurity, TheFlagsOfTheFloatingPointUnitAreLeftAlone) {
  const unsigned before = _mm_getcsr();
  cast_all(query_, rays_);
  EXPECT_EQ(_mm_getcsr(), before);
  _mm_setcsr(before | 0x8040U);
  EXPECT_TRUE(same_bits(cast_all(query_, rays_), hits_));
  EXPECT_EQ(_mm_getcsr() & 0x8040U, 0x8040U);
  _mm_setcsr(before);
}

TEST_F(RayPurity, ManyThreadsLoadAndEvictAtOnce) {
  // Half of the tiles fit.
  const RayQuery other(store_, query_.cut(),
                       {.memory_bytes = static_cast<double>(query_.stats().bytes_resident) / 2.0});
  std::atomic<int> num_wrong = 0;
  const auto check = [&](std::size_t packet) {
    const std::size_t at = 16 * packet;
    std::vector<SurfaceHit> hits(16);
    other.intersect(std::span(rays_).subspan(at, 16), hits, Coherence::Incoherent);
    const std::vector<SurfaceHit> expected(hits_.begin() + static_cast<std::ptrdiff_t>(at),
                                           hits_.begin() + static_cast<std::ptrdiff_t>(at + 16));
    if (!same_bits(hits, expected)) ++num_wrong;
    const Viewpoint viewpoint{.position_world = rays_[at].origin_world, .pixels_per_radian = 700.0};
    other.prefetch({&viewpoint, 1});
  };
  std::vector<std::jthread> threads;
  for (std::size_t thread = 0; thread < 6; ++thread)
    threads.emplace_back([&, thread] {
      for (std::size_t round = 0; round < 2; ++round) check(2 * thread + round);
    });
  // The same from inside tasks, where a waiting thread could pick up other tasks.
  core::parallel_for(12, [&](std::int64_t i) { check(static_cast<std::size_t>(i)); });
  threads.clear();
  EXPECT_EQ(num_wrong, 0);
}

TEST_F(RayPurity, DamagedTilesAreErrorsOfTheRayThatNeedsThem) {
  std::filesystem::resize_file(tile_path(store_.folder(), {0, 0, 0}), 200);
  const RayQuery other(store_, query_.cut(), {});
  const WorldRay ray{.origin_world = {10.0, 10.0, 5000.0}, .direction_world = {0, 0, -1}};
  for (int k = 0; k < 2; ++k) {
    try {
      cast(other, ray);
      ADD_FAILURE() << "no error";
    } catch (const core::Error& error) {
      EXPECT_EQ(error.kind(), core::ErrorKind::Input);
      EXPECT_THAT(error.what(), testing::HasSubstr("0_0.tile"));
    }
    EXPECT_THROW(is_blocked(other, ray), core::Error);
  }
  EXPECT_FALSE(
      cast(other, {.origin_world = {-500.0, -500.0, 5000.0}, .direction_world = {0, 0, -1}})
          .is_sky());
}

TEST_F(RayPurity, PrefetchedTilesAreNotWaitedFor) {
  const RayQuery other(store_, query_.cut(), {});
  const Viewpoint viewpoint{.position_world = {200.0, 100.0, 1500.0}, .pixels_per_radian = 700.0};
  other.prefetch({&viewpoint, 1});
  for (int k = 0; k < 2000 && other.stats().num_tiles_loaded < query_.cut().size(); ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  ASSERT_EQ(other.stats().num_tiles_loaded, query_.cut().size());
  EXPECT_TRUE(same_bits(cast_all(other, rays_), hits_));
  EXPECT_EQ(other.stats().num_tiles_waited, 0U);
  const RayQuery small(store_, query_.cut(), {.memory_bytes = 1.0});
  small.prefetch({&viewpoint, 1});
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(small.stats().num_tiles_evicted, 0U);
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
    const SurfaceHit hit = cast(query, ray);
    const SurfaceSample sample = query.surface(hit, ray.origin_world + hit.t * ray.direction_world);
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
