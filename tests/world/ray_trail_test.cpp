#include "world/ray_trail.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/error.h"
#include "core/parallel.h"
#include "tests/support/brute_terrain.h"
#include "tests/support/test_data.h"
#include "tests/world/mountains.h"
#include "tests/world/rays.h"
#include "world/ray_query.h"

namespace terracast::world {
namespace {

using test::kInfinity;

class RayTrails : public testing::Test {
 protected:
  RayTrails()
      : store_(test::make_tiny_world(folder_ / "world", test::mountain_height_m,
                                     test::mountain_options(2))),
        query_(store_, finest_cut(store_), {}),
        rays_(test::mixed_rays(query_, 1024.0, 4'000)) {
    // Some end on their way, and some climb from the start.
    for (std::size_t i = 0; i < rays_.size(); i += 7) rays_[i].t_max = 200.0;
    for (std::size_t i = 0; i < rays_.size(); i += 11)
      rays_[i].direction_world.z() = std::abs(rays_[i].direction_world.z());
  }

  RayTrail trail_of(const RayQuery& query, std::span<const WorldRay> rays,
                    Coherence coherence = Coherence::Incoherent) const {
    RayTrail trail(query.cut().size());
    std::vector<SurfaceHit> hits(rays.size());
    query.intersect(rays, hits, coherence, {}, &trail);
    return trail;
  }
  /// Rays from a high corner of the world to its middle, which touch some tiles and pass over others.
  void look_at_one_place() {
    const Eigen::Vector3d origin(-950.0, -900.0, 1900.0);
    for (std::size_t i = 0; i < rays_.size(); ++i) {
      const Eigen::Vector3d place(200.0 + 0.5 * static_cast<double>(i % 100),
                                  100.0 + 5.0 * static_cast<double>(i / 100), 1550.0);
      rays_[i] = {.origin_world = origin, .direction_world = place - origin};
    }
  }
  void expect_same(const RayTrail& trail, const RayTrail& expected) const {
    for (std::size_t tile = 0; tile < query_.cut().size(); ++tile) {
      EXPECT_EQ(trail.is_touched(tile), expected.is_touched(tile)) << tile;
      EXPECT_EQ(trail.passed_z_world(tile), expected.passed_z_world(tile)) << tile;
    }
  }

  test::ScratchFolder folder_;
  TileStore store_;
  RayQuery query_;
  std::vector<WorldRay> rays_;
};

/// Where a ray is within a tile's square; empty: nowhere.
struct Passage {
  double t_in = 0.0;
  double t_out = 0.0;
};

Passage passage_of(const WorldRay& ray, const TileId& id) {
  Passage passage{ray.t_min, ray.t_max};
  const double side = 256.0 * std::pow(2.0, id.level);
  const double low[2] = {id.x * side, id.y * side};
  for (const int axis : {0, 1}) {
    const double origin = ray.origin_world[axis];
    const double direction = ray.direction_world[axis];
    if (direction == 0.0) {
      if (origin < low[axis] || origin > low[axis] + side) return {1.0, 0.0};
      continue;
    }
    const double a = (low[axis] - origin) / direction;
    const double b = (low[axis] + side - origin) / direction;
    passage.t_in = std::max(passage.t_in, std::min(a, b));
    passage.t_out = std::min(passage.t_out, std::max(a, b));
  }
  return passage;
}

TEST_F(RayTrails, HoldTheTilesWhoseColumnsRaysEnterAndHowLowOthersArePassed) {
  // Rounding of places along a ray decides nothing but these.
  constexpr double kTolerance_m = 1e-6;
  const test::BruteTerrain brute(store_, query_.cut());
  double highest_z = -kInfinity;
  for (const CutTile& tile : query_.cut())
    highest_z = std::max(highest_z, store_.find(tile.id)->highest_z_world);
  int num_touched = 0;
  int num_passed = 0;
  for (const WorldRay& ray : rays_) {
    const RayTrail trail = trail_of(query_, {&ray, 1});
    const double t_hit =
        brute.first_crossing(ray.origin_world, ray.direction_world, 0.0, ray.t_max);
    const double length = ray.direction_world.norm();
    for (std::size_t i = 0; i < query_.cut().size(); ++i) {
      const TileId& id = query_.cut()[i].id;
      const double top_z = store_.find(id)->highest_z_world;
      const Passage passage = passage_of(ray, id);
      const bool is_grazed = std::abs(passage.t_out - passage.t_in) * length < kTolerance_m ||
                             std::abs(passage.t_in - t_hit) * length < kTolerance_m;
      if (is_grazed) continue;
      if (passage.t_out < passage.t_in || passage.t_in > t_hit) {
        EXPECT_FALSE(trail.is_touched(i)) << test::text(ray) << " at " << id.name();
        EXPECT_EQ(trail.passed_z_world(i), RayTrail::kNever) << test::text(ray);
        continue;
      }
      const auto z_at = [&](double t) {
        return ray.direction_world.z() == 0.0 ? ray.origin_world.z()
                                              : ray.origin_world.z() + t * ray.direction_world.z();
      };
      const double lowest_z = std::min(z_at(passage.t_in), z_at(passage.t_out));
      if (std::abs(lowest_z - top_z) < kTolerance_m) continue;
      EXPECT_EQ(trail.is_touched(i), lowest_z < top_z) << test::text(ray) << " at " << id.name();
      num_touched += lowest_z < top_z ? 1 : 0;
      if (lowest_z < top_z || lowest_z > highest_z + RayTrail::kFollowed_m) continue;
      EXPECT_NEAR(trail.passed_z_world(i), lowest_z, kTolerance_m)
          << test::text(ray) << " at " << id.name();
      ++num_passed;
    }
  }
  EXPECT_GT(num_touched, 4000);
  EXPECT_GT(num_passed, 900);
}

TEST_F(RayTrails, DoNotDependOnPacketsBudgetThreadsOrOrder) {
  look_at_one_place();
  const RayTrail expected = trail_of(query_, rays_);
  int num_passed = 0;
  for (std::size_t tile = 0; tile < query_.cut().size(); ++tile)
    num_passed += expected.passed_z_world(tile) < RayTrail::kNever ? 1 : 0;
  EXPECT_GE(num_passed, 2);

  for (const int packet_width : {8, 16}) {
    const RayQuery other(store_, query_.cut(), {.packet_width = packet_width});
    expect_same(trail_of(other, rays_), expected);
  }
  const RayQuery small(store_, query_.cut(), {.memory_bytes = query_.least_memory_bytes()});
  expect_same(trail_of(small, rays_), expected);
  EXPECT_GT(small.stats().num_tiles_evicted, 0u);
  expect_same(trail_of(query_, rays_, Coherence::Coherent), expected);
  const std::vector<WorldRay> reversed(rays_.rbegin(), rays_.rend());
  expect_same(trail_of(query_, reversed), expected);

  RayTrail shared(query_.cut().size());
  RayTrail joined(query_.cut().size());
  const std::span<const WorldRay> all(rays_);
  core::parallel_for_blocks(
      static_cast<std::int64_t>(all.size()), 7, [&](std::int64_t begin, std::int64_t end) {
        std::vector<SurfaceHit> hits(static_cast<std::size_t>(end - begin));
        const auto some = all.subspan(static_cast<std::size_t>(begin), hits.size());
        query_.intersect(some, hits, Coherence::Incoherent, {}, &shared);
        joined.add(trail_of(query_, some));
      });
  expect_same(shared, expected);
  expect_same(joined, expected);
  shared.clear();
  expect_same(shared, RayTrail(query_.cut().size()));
}

TEST_F(RayTrails, AreTheSameOfAllQueries) {
  look_at_one_place();
  const RayTrail expected = trail_of(query_, rays_);
  RayTrail occluded(query_.cut().size());
  std::vector<std::uint8_t> is_occluded(rays_.size());
  query_.occluded(rays_, is_occluded, &occluded);
  expect_same(occluded, expected);

  // Rays of one point.
  const Eigen::Vector3d origin = rays_.front().origin_world;
  std::vector<WorldRay> from_one;
  std::vector<double> x, y, z;
  for (const WorldRay& ray : rays_) {
    from_one.push_back({.origin_world = origin, .direction_world = ray.direction_world});
    x.push_back(ray.direction_world.x());
    y.push_back(ray.direction_world.y());
    z.push_back(ray.direction_world.z());
  }
  const RayFan fan{.origin_world = origin, .x = x, .y = y, .z = z};
  const RayTrail expected_of_fan = trail_of(query_, from_one);
  std::vector<SurfaceHit> hits(fan.size());
  std::vector<double> t(fan.size());
  RayTrail of_hits(query_.cut().size());
  RayTrail of_t(query_.cut().size());
  query_.intersect(fan, hits, Coherence::Incoherent, {}, &of_hits);
  query_.intersect(fan, t, Coherence::Coherent, &of_t);
  expect_same(of_hits, expected_of_fan);
  expect_same(of_t, expected_of_fan);
}

TEST_F(RayTrails, ChangeNoBitOfWhatRaysMeet) {
  RayTrail trail(query_.cut().size());
  std::vector<SurfaceHit> hits(rays_.size());
  query_.intersect(rays_, hits, Coherence::Incoherent, {}, &trail);
  EXPECT_TRUE(test::same_bits(hits, test::cast_all(query_, rays_)));
  std::vector<std::uint8_t> with(rays_.size());
  std::vector<std::uint8_t> without(rays_.size());
  query_.occluded(rays_, with, &trail);
  query_.occluded(rays_, without);
  EXPECT_EQ(with, without);
}

TEST_F(RayTrails, OfAnotherCutAreRefused) {
  RayTrail trail(query_.cut().size() + 1);
  std::vector<SurfaceHit> hits(rays_.size());
  EXPECT_THROW(query_.intersect(rays_, hits, Coherence::Incoherent, {}, &trail), core::Error);
}

}  // namespace
}  // namespace terracast::world
