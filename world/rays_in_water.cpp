#include "world/rays_in_water.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

namespace terracast::world {
namespace {

/// A ray that is in water from t on, and what it meets at t_end if it stays there.
struct WayInWater {
  std::size_t ray;
  double t;
  double t_end;
};

/// Those that start below the surface.
std::vector<WayInWater> ways_in_water(const RayQuery& whole, std::span<const WorldRay> rays,
                                      std::span<const SurfaceHit> hits) {
  std::vector<WayInWater> ways;
  Eigen::Vector3d start_before =
      Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  bool is_in_water = false;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const WorldRay& ray = rays[i];
    const Eigen::Vector3d start = ray.origin_world + ray.t_min * ray.direction_world;
    if (start != start_before) {
      start_before = start;
      is_in_water = whole.surface_z_world(start.x(), start.y()).value_or(start.z()) > start.z();
    }
    const double t_end = std::min(hits[i].t, ray.t_max);
    if (is_in_water && ray.t_min < t_end) ways.push_back({i, ray.t_min, t_end});
  }
  return ways;
}

Eigen::Vector3d turned_over(const Eigen::Vector3d& vector) {
  return {vector.x(), vector.y(), -vector.z()};
}

/// Where rays come up through the surface for the first time, in the world that is upside down.
struct ComingUp {
  std::vector<WorldRay> rays;
  std::vector<SurfaceHit> hits;
  std::vector<SurfaceSample> surfaces;

  void find(const RayQuery& turned, std::span<const WorldRay> of, std::span<const WayInWater> ways,
            RayTrail* trail) {
    rays.clear();
    for (const WayInWater& way : ways)
      rays.push_back({.origin_world = turned_over(of[way.ray].origin_world),
                      .direction_world = turned_over(of[way.ray].direction_world),
                      .t_min = way.t,
                      .t_max = way.t_end});
    hits.resize(rays.size());
    surfaces.resize(rays.size());
    turned.intersect(rays, hits, Coherence::Incoherent, surfaces, trail);
  }
};

/// The ways that go on, in the air over land, until they have come down to the ground again.
std::vector<WayInWater> down_again(const RayQuery& whole, std::span<const WorldRay> of,
                                   std::span<const WayInWater> ways, RayTrail* trail) {
  std::vector<WorldRay> rays;
  for (const WayInWater& way : ways)
    rays.push_back({.origin_world = of[way.ray].origin_world,
                    .direction_world = of[way.ray].direction_world,
                    .t_min = way.t,
                    .t_max = way.t_end});
  std::vector<SurfaceHit> hits(rays.size());
  whole.intersect(rays, hits, Coherence::Incoherent, {}, trail);
  std::vector<WayInWater> down;
  for (std::size_t k = 0; k < ways.size(); ++k)
    if (hits[k].is_ground() && hits[k].t > ways[k].t && hits[k].t < ways[k].t_end)
      down.push_back({ways[k].ray, hits[k].t, ways[k].t_end});
  return down;
}

/// A tile over which a ray passed upside down is one that it passed below: told as if it had come to it.
void add_turned(const RayTrail& turned, RayTrail& trail) {
  for (std::size_t tile = 0; tile < turned.num_tiles(); ++tile)
    if (turned.is_touched(tile) || turned.passed_z_world(tile) != RayTrail::kNever)
      trail.touch(tile);
}

}  // namespace

void drain(Tile& tile) {
  const std::vector<std::int32_t> depth_steps = std::exchange(tile.water_depth_steps, {});
  for (std::size_t i = 0; i < depth_steps.size(); ++i) {
    tile.height_steps[i] -= depth_steps[i];
    if (is_water(tile.cover[i])) tile.cover[i] = Cover::Seabed;
  }
}

void turn_over(Tile& tile) {
  tile.center_z_m = -tile.center_z_m;
  for (std::int32_t& steps : tile.height_steps) steps = -steps;
  tile.objects.solids.clear();
  tile.objects.instances.clear();
  tile.objects_top_steps = Tile::kNoObjects;
}

void end_at_surface(const RayQuery& whole, const RayQuery& turned, std::span<const WorldRay> rays,
                    std::span<SurfaceHit> hits, std::span<SurfaceSample> surfaces,
                    RayTrail* trail) {
  std::vector<WayInWater> ways = ways_in_water(whole, rays, hits);
  std::optional<RayTrail> turned_trail;
  if (trail != nullptr) turned_trail.emplace(trail->num_tiles());
  ComingUp up;
  while (!ways.empty()) {
    up.find(turned, rays, ways, turned_trail ? &*turned_trail : nullptr);
    std::vector<WayInWater> over_land;
    for (std::size_t k = 0; k < ways.size(); ++k) {
      SurfaceHit& met = up.hits[k];
      if (met.is_sky()) continue;
      if (!is_water(up.surfaces[k].cover)) {
        over_land.push_back({ways[k].ray, met.t, ways[k].t_end});
        continue;
      }
      met.slope_x = -met.slope_x;
      met.slope_y = -met.slope_y;
      hits[ways[k].ray] = met;
      if (!surfaces.empty()) surfaces[ways[k].ray] = up.surfaces[k];
    }
    ways = down_again(whole, rays, over_land, trail);
  }
  if (turned_trail) add_turned(*turned_trail, *trail);
}

}  // namespace terracast::world
