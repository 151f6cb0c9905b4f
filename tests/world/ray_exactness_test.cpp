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
#include "tests/support/test_data.h"
#include "tests/world/mountains.h"
#include "world/ray_query.h"

namespace terracast::world {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPixel_rad = 1.0 / 720.0;
constexpr double kShift_rad = 0.01 * kPixel_rad;

std::int64_t num_rays() {
  const char* text = std::getenv("TERRACAST_EXACT_RAYS");
  return text == nullptr ? 1'000'000 : static_cast<std::int64_t>(std::atof(text));
}

/// What a crossing's height above its plane may err by, as a share of the largest coordinate that
/// it is computed from: a dozen roundings of 2^-53 in plane and position.
constexpr double kClearanceError = 12.0 * 0x1.0p-53;

/// By how much t may err for it: what the clearance errs by over how fast the ray closes in.
double t_error(const WorldRay& ray, const SurfaceHit& hit) {
  const Eigen::Vector3d normal = hit.normal_world();
  const double closing_rate = std::abs(normal.dot(ray.direction_world)) / normal.z();
  const double extent_m = std::max(ray.origin_world.cwiseAbs().maxCoeff(), hit.t);
  // Slopes turn what x and y err by into height.
  const double steepness = 1.0 + std::abs(hit.slope_x) + std::abs(hit.slope_y);
  return kClearanceError * extent_m * steepness / closing_rate;
}

/// Whether the triangle that a hit names holds the place that it names, and has its slopes.
bool is_of_its_triangle(const test::BruteTerrain& brute, const WorldRay& ray,
                        const SurfaceHit& hit) {
  const std::array<Eigen::Vector3d, 3> corners =
      brute.triangle(hit.tile_index, hit.cell_x, hit.cell_y, hit.upper != 0);
  const Eigen::Vector3d along_x = corners[1] - corners[0];
  const Eigen::Vector3d along_y = corners[2] - corners[0];
  // Heights are multiples of 2^-11 m and spacings powers of two: slopes are exact.
  if (hit.slope_x != along_x.z() / along_x.x() || hit.slope_y != along_y.z() / along_y.y())
    return false;
  const Eigen::Vector3d point = ray.origin_world + hit.t * ray.direction_world - corners[0];
  const double u = point.x() / along_x.x();
  const double v = point.y() / along_y.y();
  constexpr double kMarginCells = 1e-6;  // a micrometre of the finest cell: positions err by less
  return u >= -kMarginCells && v >= -kMarginCells && u + v <= 1.0 + kMarginCells;
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
      const bool at_random = core::random_bits(5, 5, static_cast<std::uint64_t>(i)) % 100 == 0;
      if (!at_silhouette && !at_border && !at_random) continue;
      ++num_compared;
      const double t =
          brute.first_crossing(near[0].origin_world, near[0].direction_world, 0.0, kInfinity);
      const bool is_equal = hit.is_sky() ? std::isinf(t)
                                         : std::abs(hit.t - t) <= t_error(near[0], hit) &&
                                               is_of_its_triangle(brute, near[0], hit);
      if (is_equal) continue;
      ++num_different;
      const std::lock_guard lock(mutex);
      if (first_difference.empty())
        first_difference = fmt::format(
            "ray {}: t {} where the full traversal has {}; from ({}, {}, {}) along ({}, {}, {})", i,
            hit.t, t, near[0].origin_world.x(), near[0].origin_world.y(), near[0].origin_world.z(),
            near[0].direction_world.x(), near[0].direction_world.y(), near[0].direction_world.z());
    }
  });
  fmt::print(
      "{} rays, {} hit: {} at silhouettes, {} at tile borders, {} compared, {} differ; {} casts "
      "again\n",
      num_rays(), num_hits.load(), num_at_silhouettes.load(), num_at_borders.load(),
      num_compared.load(), num_different.load(), query.stats().num_recasts);
  EXPECT_EQ(num_different, 0) << first_difference;
  EXPECT_GT(num_at_silhouettes, num_rays() / 100'000);
  EXPECT_GT(num_at_borders, num_rays() / 50);
}

}  // namespace
}  // namespace terracast::world
