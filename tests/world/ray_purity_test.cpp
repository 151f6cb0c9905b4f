#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <immintrin.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <span>
#include <thread>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "tests/support/test_data.h"
#include "tests/world/mountains.h"
#include "tests/world/rays.h"
#include "world/embree_scene.h"
#include "world/ray_lanes.h"
#include "world/ray_query.h"

// What a ray meets depends on the ray and the cut alone, to the last bit: no tolerance here.
namespace terracast::world {
namespace {

using test::cast;
using test::cast_all;
using test::is_blocked;
using test::kInfinity;
using test::mixed_rays;
using test::same_bits;

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

TEST_F(RayPurity, FansAnswerAsTheirRaysDo) {
  for (const std::size_t count : {std::size_t{0}, std::size_t{1}, std::size_t{13}, rays_.size()}) {
    for (const double t_max : {700.0, kInfinity}) {
      std::vector<double> x, y, z;
      std::vector<WorldRay> rays(rays_.begin(), rays_.begin() + static_cast<std::ptrdiff_t>(count));
      for (WorldRay& ray : rays) {
        ray.origin_world = {100.25, -33.5, test::mountain_height_m(100.25, -33.5) + 200.0};
        ray.t_min = 0.125;
        ray.t_max = t_max;
        x.push_back(ray.direction_world.x());
        y.push_back(ray.direction_world.y());
        z.push_back(ray.direction_world.z());
      }
      const RayFan fan{
          .origin_world = {100.25, -33.5, test::mountain_height_m(100.25, -33.5) + 200.0},
          .x = x,
          .y = y,
          .z = z,
          .t_min = 0.125,
          .t_max = t_max};
      const std::vector<SurfaceHit> expected = cast_all(query_, rays);
      std::vector<SurfaceHit> hits(count);
      std::vector<SurfaceSample> surfaces(count);
      query_.intersect(fan, hits, Coherence::Incoherent, surfaces);
      EXPECT_TRUE(same_bits(hits, expected));
      std::vector<double> t(count, -1.0);
      query_.intersect(fan, t, Coherence::Coherent);
      std::vector<SurfaceSample> surfaces_of_rays(count);
      query_.intersect(rays, hits, Coherence::Incoherent, surfaces_of_rays);
      std::size_t num_hits = 0;
      for (std::size_t i = 0; i < count; ++i) {
        ASSERT_EQ(t[i], expected[i].t) << i;
        if (expected[i].is_sky()) continue;
        ++num_hits;
        ASSERT_EQ(surfaces[i].cover, surfaces_of_rays[i].cover) << i;
        ASSERT_EQ(surfaces[i].source, surfaces_of_rays[i].source) << i;
        ASSERT_EQ(surfaces[i].moisture, surfaces_of_rays[i].moisture) << i;
        ASSERT_EQ(surfaces[i].spacing_m, surfaces_of_rays[i].spacing_m) << i;
      }
      if (count == rays_.size()) {
        EXPECT_GT(num_hits, count / 10);
        EXPECT_LT(num_hits, count);
      }
    }
  }
}

TEST_F(RayPurity, AFansRaysEndWhereEachIsToldTo) {
  const Eigen::Vector3d origin(100.25, -33.5, test::mountain_height_m(100.25, -33.5) + 200.0);
  std::vector<double> x, y, z, t_ends;
  std::vector<WorldRay> rays(rays_.begin(), rays_.begin() + 100);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    rays[i].origin_world = origin;
    rays[i].t_min = 0.0;
    rays[i].t_max = kInfinity;
    x.push_back(rays[i].direction_world.x());
    y.push_back(rays[i].direction_world.y());
    z.push_back(rays[i].direction_world.z());
  }
  // Every third ends a little before what it meets, every third a little behind.
  const std::vector<SurfaceHit> whole = cast_all(query_, rays);
  for (std::size_t i = 0; i < rays.size(); ++i)
    t_ends.push_back(i % 3 == 0 ? kInfinity : (i % 3 == 1 ? 0.999 : 1.001) * whole[i].t);
  std::vector<SurfaceHit> hits(rays.size());
  query_.intersect(RayFan{.origin_world = origin, .x = x, .y = y, .z = z, .t_ends = t_ends}, hits,
                   Coherence::Coherent);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (i % 3 == 1)
      EXPECT_TRUE(hits[i].is_sky()) << i;
    else
      EXPECT_EQ(hits[i].t, whole[i].t) << i;
  }
}

TEST_F(RayPurity, FansThatCannotBeTracedAreRefused) {
  const std::vector<double> one = {1.0};
  const std::vector<double> two = {1.0, 2.0};
  const std::vector<double> none = {0.0, 0.0};
  const auto expect_refused = [&](const RayFan& fan, std::size_t num_answers) {
    std::vector<double> t(num_answers);
    std::vector<SurfaceHit> hits(num_answers);
    EXPECT_THROW(query_.intersect(fan, t, Coherence::Coherent), core::Error);
    EXPECT_THROW(query_.intersect(fan, hits, Coherence::Coherent), core::Error);
  };
  const Eigen::Vector3d origin(0, 0, 3000);
  expect_refused({.origin_world = origin, .x = two, .y = one, .z = two}, 2);
  expect_refused({.origin_world = origin, .x = two, .y = two, .z = one}, 2);
  expect_refused({.origin_world = origin, .x = none, .y = none, .z = none}, 2);
  expect_refused({.origin_world = origin, .x = two, .y = two, .z = two}, 1);
  expect_refused({.origin_world = origin, .x = two, .y = two, .z = two, .t_ends = one}, 2);
}

TEST(RayLanes, AreCounted) {
  for (LaneMask lanes = 0; lanes < lane_bit(RayLanes::kLanes); ++lanes) {
    int count = 0;
    for_each_lane(lanes, [&](int) { ++count; });
    EXPECT_EQ(count_lanes(lanes), count);
  }
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
    for (const double memory_bytes : {query_.least_memory_bytes(), 5e6, 8e9}) {
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
      EXPECT_TRUE(same_bits(hits, std::span(hits_).first(static_cast<std::size_t>(count))));
      const RayQueryStats stats = other.stats();
      if (memory_bytes < 8e9) {
        EXPECT_GT(stats.num_tiles_evicted, 0U);
        EXPECT_LE(stats.peak_bytes_resident, query_.stats().peak_bytes_resident * 2);
      } else {
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
  const double memory_bytes = static_cast<double>(query_.stats().bytes_resident) / 2.0;
  const RayQuery other(store_, query_.cut(), {.memory_bytes = memory_bytes});
  std::atomic<int> num_wrong = 0;
  const auto check = [&](std::size_t packet) {
    const std::size_t at = 16 * packet;
    std::vector<SurfaceHit> hits(16);
    other.intersect(std::span(rays_).subspan(at, 16), hits, Coherence::Incoherent);
    if (!same_bits(hits, std::span(hits_).subspan(at, 16))) ++num_wrong;
    const std::vector<Viewpoint> viewpoints = {
        {.position_world = rays_[at].origin_world, .pixels_per_radian = 700.0}};
    other.expect({&viewpoints, 1});
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
  EXPECT_GT(other.stats().num_tiles_evicted, 0U);
  EXPECT_LE(static_cast<double>(other.stats().peak_bytes_resident), memory_bytes);
}

TEST_F(RayPurity, ThreadsShareABudgetOfOneTile) {
  const RayQuery other(store_, query_.cut(), {.memory_bytes = query_.least_memory_bytes()});
  std::atomic<int> num_wrong = 0;
  {
    std::vector<std::jthread> threads;
    for (std::size_t thread = 0; thread < 3; ++thread)
      threads.emplace_back([&, thread] {
        std::vector<SurfaceHit> hits(64);
        other.intersect(std::span(rays_).subspan(64 * thread, 64), hits, Coherence::Incoherent);
        if (!same_bits(hits, std::span(hits_).subspan(64 * thread, 64))) ++num_wrong;
      });
  }
  EXPECT_EQ(num_wrong, 0);
  EXPECT_LE(other.stats().peak_bytes_resident, TileScene::kMostBytesWhileLoading);
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

TEST_F(RayPurity, ExpectedTilesAreNotWaitedFor) {
  const RayQuery other(store_, query_.cut(), {});
  const std::vector<Viewpoint> viewpoints = {
      {.position_world = {200.0, 100.0, 1500.0}, .pixels_per_radian = 700.0}};
  other.expect({&viewpoints, 1});
  for (int k = 0; k < 2000 && other.stats().num_tiles_loaded < query_.cut().size(); ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  ASSERT_EQ(other.stats().num_tiles_loaded, query_.cut().size());
  EXPECT_TRUE(same_bits(cast_all(other, rays_), hits_));
  EXPECT_EQ(other.stats().num_tiles_waited, 0U);
  const RayQuery small(store_, query_.cut(), {.memory_bytes = query_.least_memory_bytes()});
  small.expect({&viewpoints, 1});
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(small.stats().num_tiles_evicted, 0U);
}

}  // namespace
}  // namespace terracast::world
