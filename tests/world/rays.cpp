#include "tests/world/rays.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "core/random.h"

namespace terracast::test {

std::vector<world::SurfaceHit> cast_all(const world::RayQuery& query,
                                        std::span<const world::WorldRay> rays,
                                        world::Coherence coherence) {
  std::vector<world::SurfaceHit> hits(rays.size());
  query.intersect(rays, hits, coherence);
  return hits;
}

world::SurfaceHit cast(const world::RayQuery& query, const world::WorldRay& ray) {
  return cast_all(query, {&ray, 1}).front();
}

bool is_blocked(const world::RayQuery& query, const world::WorldRay& ray) {
  std::uint8_t answer = 2;
  query.occluded({&ray, 1}, {&answer, 1});
  return answer == 1;
}

std::string text(const world::WorldRay& ray) {
  const Eigen::Vector3d& o = ray.origin_world;
  const Eigen::Vector3d& d = ray.direction_world;
  return fmt::format("from ({}, {}, {}) along ({}, {}, {}), t from {} to {}", o.x(), o.y(), o.z(),
                     d.x(), d.y(), d.z(), ray.t_min, ray.t_max);
}

bool has_same_bits(const world::SurfaceHit& a, const world::SurfaceHit& b) {
  const auto are_same = [](double x, double y) {
    return std::bit_cast<std::uint64_t>(x) == std::bit_cast<std::uint64_t>(y);
  };
  return are_same(a.t, b.t) && a.tile_index == b.tile_index && a.cell_x == b.cell_x &&
         a.cell_y == b.cell_y && a.upper == b.upper && are_same(a.slope_x, b.slope_x) &&
         are_same(a.slope_y, b.slope_y);
}

testing::AssertionResult same_bits(std::span<const world::SurfaceHit> hits,
                                   std::span<const world::SurfaceHit> expected) {
  const auto [hit, other] =
      std::mismatch(hits.begin(), hits.end(), expected.begin(), expected.end(), has_same_bits);
  if (hit == hits.end() && other == expected.end()) return testing::AssertionSuccess();
  if (hit == hits.end() || other == expected.end())
    return testing::AssertionFailure()
           << hits.size() << " hits where " << expected.size() << " are expected";
  const auto name = [](const world::SurfaceHit& h) {
    return fmt::format("t {} in tile {}, cell ({}, {}), upper {}, slopes {}, {}", h.t, h.tile_index,
                       h.cell_x, h.cell_y, h.upper, h.slope_x, h.slope_y);
  };
  return testing::AssertionFailure()
         << "ray " << hit - hits.begin() << " of " << hits.size() << ": " << name(*hit) << " where "
         << name(*other) << " is expected";
}

std::vector<world::WorldRay> mixed_rays(const world::RayQuery& query, double half_size_m,
                                        std::size_t count) {
  std::vector<world::WorldRay> rays(count);
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

double t_error(const world::WorldRay& ray, const world::SurfaceHit& hit) {
  const Eigen::Vector3d normal = hit.normal_world();
  const double closing_rate = std::abs(normal.dot(ray.direction_world)) / normal.z();
  const double extent_m = std::max(ray.origin_world.cwiseAbs().maxCoeff(), hit.t);
  // Slopes turn what x and y err by into height.
  const double steepness = 1.0 + std::abs(hit.slope_x) + std::abs(hit.slope_y);
  return kClearanceError * extent_m * steepness / closing_rate;
}

bool is_of_its_triangle(const BruteTerrain& brute, const world::WorldRay& ray,
                        const world::SurfaceHit& hit) {
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

bool is_crossing_at(double t, const BruteTerrain& brute, const world::WorldRay& ray,
                    const world::SurfaceHit& hit) {
  if (hit.is_sky()) return std::isinf(t);
  return std::abs(hit.t - t) <= t_error(ray, hit) && is_of_its_triangle(brute, ray, hit);
}

}  // namespace terracast::test
