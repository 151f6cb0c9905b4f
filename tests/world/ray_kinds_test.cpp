// Rays of every kind, among them those for which a decision hangs on the last bit: each alone and in packets of any size
// and order meets the same, to the last bit. No tolerance here.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <span>
#include <vector>

#include "core/random.h"
#include "tests/support/test_data.h"
#include "tests/world/mountains.h"
#include "tests/world/rays.h"
#include "world/ray_query.h"

namespace terracast::world {
namespace {

using test::cast;
using test::cast_all;
using test::kInfinity;
using test::mixed_rays;
using test::same_bits;

constexpr double kHalfSize_m = 1024.0;
constexpr double kLevel_m = 1200.0;

/// Mountains in the east. West of x = -512 m level ground and, north of y = 0, a ramp that rises by
/// a quarter: exactly, heights being whole steps there.
double patchwork_height_m(double x, double y) {
  const double base_m = kLevel_m + 0.25 * std::max(y, 0.0);
  const double share = std::clamp((x + 512.0) / 400.0, 0.0, 1.0);
  const double smooth_share = share * share * (3.0 - 2.0 * share);
  return base_m + smooth_share * (test::mountain_height_m(x, y) - kLevel_m);
}

/// Rays of every kind over the patchwork, in one list: easy ones in whole groups, and those for
/// which a decision hangs on the last bit.
class RaysOfAllKinds {
 public:
  explicit RaysOfAllKinds(const RayQuery& query) : query_(query) {
    add_image({200.0, 100.0, ground_z(200.0, 100.0) + 250.0}, {0.6, 0.7, -0.3});
    add_image({-800.0, -300.0, kLevel_m + 400.0}, {0.0, 0.0, -1.0});
    // Straight down on a corner of four tiles: its middle row and column run along the borders.
    add_image({0.0, 0.0, ground_z(0.0, 0.0) + 500.0}, {0.0, 0.0, -1.0});
    add_hits();
    add_planes();
    add_verticals();
    add_lines();
    add_starts_outside();
    add_starts_under_ground();
    add_ranges();
  }
  const std::vector<WorldRay>& rays() const { return rays_; }

 private:
  double between(double low, double high) {
    return core::random_between(low, high, 23, 0, num_draws_++);
  }
  double ground_z(double x, double y) const { return *query_.surface_z_world(x, y); }
  void add(const Eigen::Vector3d& origin_world, const Eigen::Vector3d& direction_world,
           double t_min = 0.0, double t_max = kInfinity) {
    rays_.push_back({.origin_world = origin_world,
                     .direction_world = direction_world,
                     .t_min = t_min,
                     .t_max = t_max});
  }

  /// 24 x 24 pixels, row by row: groups of eight neighbours.
  void add_image(const Eigen::Vector3d& eye_world, const Eigen::Vector3d& forward) {
    constexpr double kPixel_rad = 1.0 / 400.0;
    const Eigen::Vector3d right = forward.unitOrthogonal();
    const Eigen::Vector3d down = forward.cross(right);
    for (int j = -12; j < 12; ++j)
      for (int i = -12; i < 12; ++i) add(eye_world, forward + kPixel_rad * (i * right + j * down));
  }

  void add_hits() {
    const std::vector<WorldRay> seen = mixed_rays(query_, kHalfSize_m, 250);
    const std::vector<SurfaceHit> hits = cast_all(query_, seen);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const Eigen::Vector3d& o = seen[i].origin_world;
      const Eigen::Vector3d& d = seen[i].direction_world;
      const SurfaceHit& hit = hits[i];
      add(o, d);
      if (hit.is_sky()) continue;
      const Eigen::Vector3d point = o + hit.t * d;
      add(point, o - point, 0.0, 1.0);  // back to the camera that saw it
      add(point, o - point);
      for (const double t : {hit.t, std::nextafter(hit.t, 0.0), std::nextafter(hit.t, kInfinity)}) {
        add(o, d, 0.0, t);
        add(o, d, t);
      }
      add_ends_at_borders(o, d, query_.cut()[hit.tile_index].id);
      for (int k = 0; k < 3; ++k) {  // within the triangle's plane
        const double angle = between(0.0, 2.0 * M_PI);
        const double dx = std::cos(angle);
        const double dy = std::sin(angle);
        add(point, {dx, dy, hit.slope_x * dx + hit.slope_y * dy});
      }
    }
  }

  void add_ends_at_borders(const Eigen::Vector3d& o, const Eigen::Vector3d& d, const TileId& id) {
    for (const int axis : {0, 1}) {
      const double low = id.corner_world()[axis];
      for (const double border : {low, low + id.side_m()}) {
        const double t = (border - o[axis]) * (1.0 / d[axis]);
        if (!(t > 0.0 && t < kInfinity)) continue;
        add(o, d, 0.0, t);
        add(o, d, t);
      }
    }
  }

  /// On level ground and on the ramp, within what counts as on the surface, and beside it.
  void add_planes() {
    const std::array<Eigen::Vector2d, 6> directions = {
        {{1.0, 0.0}, {-1.0, 0.0}, {0.0, 1.0}, {0.0, -1.0}, {1.0, -1.0}, {0.6, 0.7}}};
    const std::array<Eigen::Vector2d, 5> places = {
        {{-700.3, -300.7}, {-768.0, -512.0}, {-512.0, -100.5}, {-700.3, 300.25}, {-768.0, 512.0}}};
    for (const Eigen::Vector2d& place : places) {
      const double ramp = place.y() > 0.0 ? 0.25 : 0.0;
      for (const double off_m : {0.0, 0x1.0p-27, -0x1.0p-27, 0x1.0p-25, -0x1.0p-25, 1e-6, -1e-6}) {
        const Eigen::Vector3d start(place.x(), place.y(), kLevel_m + ramp * place.y() + off_m);
        for (const Eigen::Vector2d& along : directions)
          for (const double rise : {0.0, 1e-12, -1e-12})
            add(start, {along.x(), along.y(), ramp * along.y() + rise});
      }
    }
  }

  void add_verticals() {
    for (int k = 0; k < 40; ++k) {
      const bool is_on_border = k % 2 == 0;
      const double line_m = k % 4 == 0 ? 256.0 : 1.0;
      double x = between(-1.0, 1.0) * kHalfSize_m;
      const double y = between(-1.0, 1.0) * kHalfSize_m;
      if (is_on_border) x = line_m * std::round(x / line_m);
      const double z = ground_z(x, y);
      for (const double from_z : {4000.0, z, -300.0})
        for (const double up : {1.0, -1.0}) add({x, y, from_z}, {0.0, 0.0, up});
    }
    for (const double x : {-kHalfSize_m, kHalfSize_m})
      for (const double y : {-kHalfSize_m, 0.0, kHalfSize_m}) add({x, y, 4000.0}, {0.0, 0.0, -1.0});
  }

  /// Parallel to an axis, along the borders of tiles, along lines between cells and along their
  /// diagonals.
  void add_lines() {
    for (const double line : {-1024.0, -600.0, -512.0, -3.0, 0.0, 17.0, 256.0, 400.5, 1024.0}) {
      for (const double fall : {0.0, 0.05, 0.6}) {
        for (const double ahead : {1.0, -1.0}) {
          const double start = between(-0.9, 0.9) * kHalfSize_m;
          const double above_m = std::exp(between(-1.0, 6.0));
          const double z_north = ground_z(line, start) + above_m;
          const double z_east = ground_z(start, line) + above_m;
          add({line, start, z_north}, {0.0, ahead, -fall});
          add({start, line, z_east}, {ahead, 0.0, -fall});
          add({line, -3000.0 * ahead, z_north}, {0.0, ahead, -0.1 * fall});
          add({-3000.0 * ahead, line, z_east}, {ahead, 0.0, -0.1 * fall});
          const double corner = std::round(start);
          add({corner, 3.0, ground_z(corner, 3.0) + above_m}, {ahead, -ahead, -fall});
          add({corner, 3.0, ground_z(corner, 3.0) + above_m}, {ahead, ahead, -fall});
        }
      }
    }
  }

  void add_starts_outside() {
    for (const int side_x : {-1, 0, 1}) {
      for (const int side_y : {-1, 0, 1}) {
        if (side_x == 0 && side_y == 0) continue;
        for (const double beyond_m : {0.0, 0x1.0p-42, 1e-7, 3.0, 700.0, 1e5}) {
          const double far = kHalfSize_m + beyond_m;
          const double x = side_x == 0 ? between(-0.9, 0.9) * kHalfSize_m : side_x * far;
          const double y = side_y == 0 ? between(-0.9, 0.9) * kHalfSize_m : side_y * far;
          for (const double z : {-500.0, 900.0, kLevel_m, 1500.0, 5000.0}) {
            const Eigen::Vector3d start(x, y, z);
            const double to_x = between(-0.9, 0.9) * kHalfSize_m;
            const double to_y = between(-0.9, 0.9) * kHalfSize_m;
            add(start, Eigen::Vector3d(to_x, to_y, ground_z(to_x, to_y)) - start);
            add(start, Eigen::Vector3d(to_x, to_y, z) - start);
            add(start, start - Eigen::Vector3d(to_x, to_y, 1000.0));  // away
            add(start, {0.0, -1.0, -0.01});
          }
        }
      }
    }
  }

  void add_starts_under_ground() {
    for (int k = 0; k < 50; ++k) {
      const double x = between(-0.95, 0.95) * kHalfSize_m;
      const double y = between(-0.95, 0.95) * kHalfSize_m;
      for (const double depth_m : {1e-6, 1.0, 300.0, 5000.0}) {
        const Eigen::Vector3d direction(between(-1.0, 1.0), between(-1.0, 1.0), between(-1.0, 1.0));
        const Eigen::Vector3d start(x, y, ground_z(x, y) - depth_m);
        for (const double t_min : {0.0, 2.0, -1.0})
          add(start - t_min * direction, direction, t_min);
      }
    }
  }

  /// Finite ranges, empty ones, and directions of any length, some with a negligible component.
  void add_ranges() {
    for (WorldRay ray : mixed_rays(query_, kHalfSize_m, 400)) {
      ray.t_min = between(-500.0, 500.0);
      ray.t_max = ray.t_min + between(-100.0, 2000.0);
      if (num_draws_ % 7 == 0) ray.t_max = ray.t_min;
      rays_.push_back(ray);
      const double length = std::exp(between(-20.0, 20.0));
      ray.direction_world *= length;
      ray.t_min /= length;
      ray.t_max = kInfinity;
      rays_.push_back(ray);
      ray.direction_world[static_cast<int>(num_draws_ % 2)] *= 1e-150;
      rays_.push_back(ray);
    }
  }

  const RayQuery& query_;
  std::vector<WorldRay> rays_;
  std::uint64_t num_draws_ = 0;
};

/// Casts a list as a whole, one ray at a time, and in parts of every size up to two batches of 64
/// and two more, the first rays and some from its middle; as light too.
void expect_same_in_all_parts(const RayQuery& query, std::span<const WorldRay> rays,
                              std::span<const SurfaceHit> expected) {
  const auto expect_same = [&](std::size_t first, std::size_t size, Coherence coherence) {
    const testing::AssertionResult is_same = same_bits(
        cast_all(query, rays.subspan(first, size), coherence), expected.subspan(first, size));
    EXPECT_TRUE(is_same) << "of those from " << first << " on, "
                         << (coherence == Coherence::Coherent ? "coherent" : "incoherent");
    return static_cast<bool>(is_same);
  };
  const auto expect_same_light = [&](std::size_t first, std::size_t size) {
    std::vector<std::uint8_t> is_occluded(size, 2);
    query.occluded(rays.subspan(first, size), is_occluded);
    for (std::size_t i = 0; i < size; ++i) {
      const bool is_hit = !expected[first + i].is_sky();
      EXPECT_EQ(is_occluded[i], is_hit ? 1 : 0) << "ray " << i << " of " << size << " from "
                                                << first << " on, " << test::text(rays[first + i]);
      if (is_occluded[i] != (is_hit ? 1 : 0)) return false;
    }
    return true;
  };
  // Once it differs it differs in hundreds of parts: the first is enough.
  bool is_same = true;
  for (const Coherence coherence : {Coherence::Coherent, Coherence::Incoherent}) {
    is_same = is_same && expect_same(0, rays.size(), coherence);
    for (std::size_t size = 1; is_same && size <= 130; ++size)
      is_same = expect_same(0, size, coherence) &&
                expect_same(size * 61 % (rays.size() - size), size, coherence);
  }
  for (std::size_t i = 0; is_same && i < rays.size(); ++i)
    is_same = expect_same(i, 1, Coherence::Incoherent);
  is_same = is_same && expect_same_light(0, rays.size());
  for (std::size_t size = 1; is_same && size <= 130; ++size)
    is_same = expect_same_light(size * 61 % (rays.size() - size), size);
}

class RayKinds : public testing::Test {
 protected:
  RayKinds()
      : store_(test::make_tiny_world(folder_ / "world", patchwork_height_m,
                                     test::mountain_options(2))),
        query_(store_, finest_cut(store_), {}),
        rays_(RaysOfAllKinds(query_).rays()) {
    // The truth of these tests: each ray alone.
    for (const WorldRay& ray : rays_) hits_.push_back(cast(query_, ray));
  }

  test::ScratchFolder folder_;
  TileStore store_;
  RayQuery query_;
  std::vector<WorldRay> rays_;
  std::vector<SurfaceHit> hits_;
};

TEST_F(RayKinds, ResultsDoNotDependOnPacketsTheirWidthOrTheOrderOfRays) {
  const auto num_hits = std::count_if(hits_.begin(), hits_.end(),
                                      [](const SurfaceHit& hit) { return !hit.is_sky(); });
  // Both answers are common.
  EXPECT_GT(num_hits, static_cast<std::ptrdiff_t>(rays_.size() / 4));
  EXPECT_LT(num_hits, static_cast<std::ptrdiff_t>(rays_.size() - rays_.size() / 20));

  constexpr unsigned kSeed = 17;
  std::vector<std::size_t> order(rays_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::shuffle(order.begin(), order.end(), std::mt19937(kSeed));
  std::vector<WorldRay> shuffled_rays;
  std::vector<SurfaceHit> shuffled_hits;
  for (const std::size_t i : order) {
    shuffled_rays.push_back(rays_[i]);
    shuffled_hits.push_back(hits_[i]);
  }
  for (const int packet_width : {0, 8, 16}) {
    const RayQuery query(store_, query_.cut(), {.packet_width = packet_width});
    SCOPED_TRACE(fmt::format("packets of {}", packet_width));
    {
      SCOPED_TRACE("kind by kind");
      expect_same_in_all_parts(query, rays_, hits_);
    }
    SCOPED_TRACE(fmt::format("shuffled with seed {}", kSeed));
    expect_same_in_all_parts(query, shuffled_rays, shuffled_hits);
  }
}

TEST_F(RayKinds, ResultsDoNotDependOnTheLocalOriginOrEmbreesProfile) {
  for (const RayQueryOptions& options :
       {RayQueryOptions{.local_origin_world = {0.3, 0.7, 0.1}},
        RayQueryOptions{.embree_profile = "isa=sse4.2,frequency_level=simd128"},
        RayQueryOptions{.embree_profile = "isa=sse4.2,frequency_level=simd128",
        .packet_width = 16}}) {
    const RayQuery query(store_, query_.cut(), options);
    EXPECT_TRUE(same_bits(cast_all(query, rays_), hits_)) << query.profile();
  }
}

}  // namespace
}  // namespace terracast::world
