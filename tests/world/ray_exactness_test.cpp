#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <mutex>
#include <string>
#include <vector>

#include "core/parallel.h"
#include "core/random.h"
#include "tests/support/brute_terrain.h"
#include "tests/support/record.h"
#include "tests/support/test_data.h"
#include "tests/world/mountains.h"
#include "tests/world/rays.h"
#include "world/ray_query.h"

namespace terracast::world {
namespace {

using test::cast_all;
using test::is_crossing_at;
using test::kInfinity;

constexpr double kPixel_rad = 1.0 / 720.0;
constexpr double kShift_rad = 0.01 * kPixel_rad;

std::int64_t num_rays() {
  const char* text = std::getenv("TERRACAST_EXACT_RAYS");
  return text == nullptr ? 1'000'000 : static_cast<std::int64_t>(std::atof(text));
}

/// A ray from a random place above ground. Every fourth is aimed at a tile border, every sixteenth
/// at a tile's corner.
WorldRay random_ray(const RayQuery& query, double half_size_m, std::uint64_t index) {
  std::uint64_t draw = 0;
  const auto unit = [&] { return core::random_unit(20, index, draw++); };
  const auto between = [&](double low, double high) { return low + (high - low) * unit(); };
  const double x = between(-0.97, 0.97) * half_size_m;
  const double y = between(-0.97, 0.97) * half_size_m;
  const double above_m = std::exp(between(std::log(0.5), std::log(2000.0)));
  WorldRay ray;
  ray.origin_world = {x, y, *query.surface_z_world(x, y) + above_m};
  if (index % 4 == 0) {
    // Not at the world's own edge, where a hit and a miss are both right.
    const CutTile& tile = [&]() -> const CutTile& {
      for (;;) {
        const CutTile& drawn =
            query.cut()[static_cast<std::size_t>(unit() * static_cast<double>(query.cut().size()))];
        if (drawn.id.corner_world().minCoeff() > -half_size_m) return drawn;
      }
    }();
    const Eigen::Vector2d corner = tile.id.corner_world();
    const double side_m = tile.id.side_m();
    Eigen::Vector2d place(corner.x(), corner.y() + side_m * unit());
    if (unit() < 0.5) place = {corner.x() + side_m * unit(), corner.y()};
    if (index % 16 == 0) place = corner;
    // Beside it by a micrometre to a centimetre: rays that touch a ridge exactly are undecided in
    // any arithmetic (the seam tests have them).
    const auto beside_m = [&] {
      return std::exp(between(std::log(1e-6), std::log(1e-2))) * (unit() < 0.5 ? -1.0 : 1.0);
    };
    place += Eigen::Vector2d(beside_m(), beside_m());
    ray.direction_world =
        Eigen::Vector3d(place.x(), place.y(), *query.surface_z_world(place.x(), place.y())) -
        ray.origin_world;
    if (index % 64 == 32) {
      ray.origin_world = {place.x(), place.y(), 3000.0};
      ray.direction_world = {0.0, 0.0, -1.0};
    }
  } else {
    const double azimuth = between(0.0, 2.0 * M_PI);
    const double elevation = -1.5 * std::pow(unit(), 2.5) + 0.1;
    ray.direction_world = {std::cos(elevation) * std::cos(azimuth),
                           std::cos(elevation) * std::sin(azimuth), std::sin(elevation)};
  }
  ray.direction_world.normalize();
  return ray;
}

/// The ray and its four neighbours at a hundredth of a pixel.
std::array<WorldRay, 5> with_neighbours(const WorldRay& ray) {
  const Eigen::Vector3d right = ray.direction_world.unitOrthogonal();
  const Eigen::Vector3d down = ray.direction_world.cross(right);
  std::array<WorldRay, 5> rays;
  rays.fill(ray);
  rays[1].direction_world += kShift_rad * right;
  rays[2].direction_world -= kShift_rad * right;
  rays[3].direction_world += kShift_rad * down;
  rays[4].direction_world -= kShift_rad * down;
  return rays;
}

/// Whether a neighbour meets another surface than the plane that the ray met: a silhouette passes
/// between them.
bool is_at_silhouette(const std::array<WorldRay, 5>& rays, std::span<const SurfaceHit> hits) {
  const SurfaceHit& hit = hits[0];
  for (std::size_t k = 1; k < 5; ++k) {
    if (hits[k].is_sky() != hit.is_sky()) return true;
    if (hit.is_sky()) continue;
    const double along = hit.normal_world().dot(rays[0].direction_world) * hit.t;
    const double t_plane = along / hit.normal_world().dot(rays[k].direction_world);
    // A ridge hides at least as much as a hundredth of a pixel is long there.
    if (std::abs(hits[k].t - t_plane) > 4.0 * kShift_rad * hit.t) return true;
  }
  return false;
}

bool is_at_border(const RayQuery& query, const WorldRay& ray, const SurfaceHit& hit) {
  if (hit.is_sky()) return false;
  const Eigen::Vector3d point = ray.origin_world + hit.t * ray.direction_world;
  const double shift_m =
      hit.t * kShift_rad / std::max(0.02, std::abs(hit.normal_world().dot(ray.direction_world)));
  const TileId& id = query.cut()[hit.tile_index].id;
  const Eigen::Vector2d low = point.head<2>() - id.corner_world();
  const Eigen::Vector2d high = (low.array() - id.side_m()).abs();
  return std::min(low.minCoeff(), high.minCoeff()) <= shift_m;
}

TEST(RayExactness, EqualsAFullTraversalWithoutEmbree) {
  const test::ScratchFolder folder;
  const TileStore store =
      test::make_tiny_world(folder / "world", test::mountain_height_m, test::mountain_options(4));
  const RayQuery query(store, finest_cut(store), {});
  const test::BruteTerrain brute(store, query.cut());
  const double half_size_m = store.manifest().size_m / 2.0;

  std::atomic<std::int64_t> num_at_silhouettes = 0;
  std::atomic<std::int64_t> num_at_borders = 0;
  std::atomic<std::int64_t> num_compared = 0;
  std::atomic<std::int64_t> num_hits = 0;
  std::atomic<std::int64_t> num_different = 0;
  std::mutex mutex;
  std::string first_difference;
  constexpr std::int64_t kBlock = 2048;
  core::parallel_for_blocks(num_rays(), kBlock, [&](std::int64_t begin, std::int64_t end) {
    std::vector<WorldRay> rays;
    for (std::int64_t i = begin; i < end; ++i) {
      const auto near =
          with_neighbours(random_ray(query, half_size_m, static_cast<std::uint64_t>(i)));
      rays.insert(rays.end(), near.begin(), near.end());
    }
    std::vector<SurfaceHit> hits(rays.size());
    query.intersect(rays, hits, Coherence::Incoherent);
    for (std::int64_t i = begin; i < end; ++i) {
      const auto at = static_cast<std::size_t>(5 * (i - begin));
      std::array<WorldRay, 5> near;
      std::copy_n(rays.begin() + static_cast<std::ptrdiff_t>(at), 5, near.begin());
      const SurfaceHit& hit = hits[at];
      num_hits += hit.is_sky() ? 0 : 1;
      const bool at_silhouette =
          is_at_silhouette(near, std::span<const SurfaceHit>(hits).subspan(at, 5));
      const bool at_border = is_at_border(query, near[0], hit);
      num_at_silhouettes += at_silhouette ? 1 : 0;
      num_at_borders += at_border ? 1 : 0;
      const bool at_random = core::random_bits(5, 5, static_cast<std::uint64_t>(i)) % 90 == 0;
      if (!at_silhouette && !at_border && !at_random) continue;
      ++num_compared;
      const double t =
          brute.first_crossing(near[0].origin_world, near[0].direction_world, 0.0, kInfinity);
      if (is_crossing_at(t, brute, near[0], hit)) continue;
      ++num_different;
      const std::lock_guard lock(mutex);
      if (first_difference.empty())
        first_difference = fmt::format("ray {}: t {} where the full traversal has {}; {}", i, hit.t,
                                       t, test::text(near[0]));
    }
  });
  const std::string figures = fmt::format(
      "{} rays, {} hit: {} at silhouettes, {} at tile borders, {} compared, {} differ; {} casts "
      "again",
      num_rays(), num_hits.load(), num_at_silhouettes.load(), num_at_borders.load(),
      num_compared.load(), num_different.load(), query.stats().num_recasts);
  fmt::print("{}\n", figures);
  test::record("rays", "exact_rays", "- Exact rays: " + figures + ".");
  EXPECT_EQ(num_different, 0) << first_difference;
  EXPECT_GT(num_at_silhouettes, num_rays() / 100'000);
  EXPECT_GT(num_at_borders, num_rays() / 50);
}

/// Blocks of 16 m, thin walls in some of them, 50 m high, on a plain at 200 m: their sides rise
/// within one cell of 1 m.
double cliff_height_m(double x, double y) {
  constexpr double kBlock_m = 16.0;
  const auto block = [](double at) {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(std::floor(at / kBlock_m)));
  };
  const auto within_m = [](double at) { return at - kBlock_m * std::floor(at / kBlock_m); };
  const std::uint64_t index = block(x) * 1000003U + block(y);
  const bool is_raised = core::random_unit(41, 0, index) < 0.5;
  const bool has_wall = core::random_unit(41, 1, index) < 0.4;
  const bool is_wall = has_wall && within_m(x) == 8.0 && std::abs(within_m(y) - 7.5) < 6.0;
  return 200.0 + (is_raised ? 50.0 : 0.0) + (is_wall ? 50.0 : 0.0) +
         0.25 * test::value_noise(x / 3.0, y / 3.0, 9);
}

/// Rays among the cliffs, all of length 1 and from above the ground: in all directions; past the
/// edges of steep triangles; along their planes; down their faces.
class CliffRays {
 public:
  CliffRays(const RayQuery& query, const test::BruteTerrain& brute)
      : query_(query), brute_(brute) {}

  WorldRay ray(std::uint64_t index) {
    index_ = index;
    num_draws_ = 0;
    for (int tries = 0; tries < 50; ++tries) {
      const WorldRay drawn = candidate(index % 4);
      const Eigen::Vector3d& o = drawn.origin_world;
      if (o.head<2>().cwiseAbs().maxCoeff() > kHalfSize_m) continue;
      // Higher than what counts as on the surface.
      if (o.z() > *query_.surface_z_world(o.x(), o.y()) + 1e-3) return drawn;
    }
    return candidate(0);
  }

 private:
  static constexpr double kHalfSize_m = 255.0;

  double between(double low, double high) {
    return core::random_between(low, high, 43, index_, num_draws_++);
  }
  double log_between(double low, double high) {
    return std::exp(between(std::log(low), std::log(high)));
  }
  Eigen::Vector3d random_direction() {
    const double z = between(-1.0, 1.0);
    const double azimuth = between(0.0, 2.0 * M_PI);
    const double level = std::sqrt(1.0 - z * z);
    return {level * std::cos(azimuth), level * std::sin(azimuth), z};
  }
  Eigen::Vector3d place_above(double x, double y, double above_m) const {
    return {x, y, *query_.surface_z_world(x, y) + above_m};
  }

  std::array<Eigen::Vector3d, 3> steep_triangle() {
    for (;;) {
      const auto tile =
          static_cast<std::size_t>(between(0.0, 1.0) * static_cast<double>(query_.cut().size()));
      const std::array<Eigen::Vector3d, 3> corners =
          brute_.triangle(tile, static_cast<int>(between(0.0, kTileCells)),
                          static_cast<int>(between(0.0, kTileCells)), between(0.0, 1.0) < 0.5);
      const double rise_m = std::max(std::abs(corners[1].z() - corners[0].z()),
                                     std::abs(corners[2].z() - corners[0].z()));
      if (rise_m > 40.0) return corners;
    }
  }

  WorldRay candidate(std::uint64_t kind) {
    const double x = between(-kHalfSize_m, kHalfSize_m);
    const double y = between(-kHalfSize_m, kHalfSize_m);
    WorldRay ray{.origin_world = place_above(x, y, log_between(0.01, 200.0)),
                 .direction_world = random_direction()};
    if (kind == 1) {
      // Beside an edge by 0.1 um to 1 mm: nearer than floats can tell, but decided in double.
      const std::array<Eigen::Vector3d, 3> corners = steep_triangle();
      const auto from = static_cast<std::size_t>(between(0.0, 3.0));
      const Eigen::Vector3d along = corners[(from + 1) % 3] - corners[from];
      const Eigen::Vector3d place = corners[from] + between(0.0, 1.0) * along;
      const double near_x = std::clamp(place.x() + between(-80.0, 80.0), -kHalfSize_m, kHalfSize_m);
      const double near_y = std::clamp(place.y() + between(-80.0, 80.0), -kHalfSize_m, kHalfSize_m);
      ray.origin_world = place_above(near_x, near_y, log_between(0.01, 100.0));
      ray.direction_world = place + log_between(1e-7, 1e-3) * random_direction() - ray.origin_world;
    } else if (kind == 2) {
      // Nearly within the plane of a steep triangle, which it crosses there.
      const std::array<Eigen::Vector3d, 3> corners = steep_triangle();
      const Eigen::Vector3d along_x = corners[1] - corners[0];
      const Eigen::Vector3d along_y = corners[2] - corners[0];
      const double u = between(0.0, 1.0);
      const Eigen::Vector3d place =
          corners[0] + u * along_x + between(0.0, 1.0) * (1.0 - u) * along_y;
      ray.direction_world =
          (between(-1.0, 1.0) * along_x + between(-1.0, 1.0) * along_y).normalized() +
          log_between(1e-6, 1e-2) * random_direction();
      ray.origin_world = place - log_between(0.1, 60.0) * ray.direction_world;
    } else if (kind == 3) {
      ray.direction_world = {between(-0.03, 0.03), between(-0.03, 0.03), -1.0};
    }
    ray.direction_world.normalize();
    return ray;
  }

  const RayQuery& query_;
  const test::BruteTerrain& brute_;
  std::uint64_t index_ = 0;
  std::uint64_t num_draws_ = 0;
};

TEST(RayExactness, CliffsOfOneCellEqualAFullTraversalWithoutEmbree) {
  const test::ScratchFolder folder;
  test::TinyWorldOptions options;
  options.coarsest_level = 0;
  const TileStore store = test::make_tiny_world(folder / "world", cliff_height_m, options);
  const RayQuery query(store, finest_cut(store), {});
  const test::BruteTerrain brute(store, query.cut());
  constexpr std::uint64_t kNumRays = 60'000;
  CliffRays cliff_rays(query, brute);
  std::vector<WorldRay> rays;
  for (std::uint64_t i = 0; i < kNumRays; ++i) rays.push_back(cliff_rays.ray(i));
  const std::vector<SurfaceHit> hits = cast_all(query, rays);
  std::array<std::uint64_t, 4> num_at_cliffs = {};  // of each kind of ray
  std::array<std::uint64_t, 4> num_different = {};
  std::string first_difference;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const double t =
        brute.first_crossing(rays[i].origin_world, rays[i].direction_world, 0.0, kInfinity);
    const bool is_at_cliff = std::max(std::abs(hits[i].slope_x), std::abs(hits[i].slope_y)) > 40.0;
    num_at_cliffs[i % 4] += !hits[i].is_sky() && is_at_cliff ? 1 : 0;
    if (is_crossing_at(t, brute, rays[i], hits[i])) continue;
    ++num_different[i % 4];
    if (first_difference.empty())
      first_difference = fmt::format("ray {}: t {} where the full traversal has {}; {}", i,
                                     hits[i].t, t, test::text(rays[i]));
  }
  for (std::size_t kind = 0; kind < 4; ++kind) {
    EXPECT_EQ(num_different[kind], 0U) << "kind " << kind << "; " << first_difference;
    EXPECT_GT(num_at_cliffs[kind], kNumRays / 4 / 20) << "kind " << kind;
  }
}

}  // namespace
}  // namespace terracast::world
