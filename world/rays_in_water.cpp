#include "world/rays_in_water.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace terracast::world {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A ray in water, looked at from its far end: back along it, the surface is met from above.
struct WayBack {
  std::size_t ray;
  double t_end;   ///< what it meets otherwise, or its end
  double t_from;  ///< where the way back starts, of the ray
};
/// Above the surface the way back starts at this height, if nothing is met before.
constexpr double kAbove_m = 5.0;
constexpr double kEarthRadius_m = 6.371e6;
/// The way back is begun twice as far off so many times, where the surface rises ahead.
constexpr int kMaxWaysBack = 16;
/// Beyond something that floats, the way back goes on.
constexpr double kBeyondSolid_m = 1e-6;

}  // namespace

void drain(Tile& tile) {
  const std::vector<std::int32_t> depth_steps = std::exchange(tile.water_depth_steps, {});
  for (std::size_t i = 0; i < depth_steps.size(); ++i) {
    tile.height_steps[i] -= depth_steps[i];
    if (is_water(tile.cover[i])) tile.cover[i] = Cover::Seabed;
  }
}

void end_at_surface(const RayQuery& whole, const geo::WorldFrame& frame,
                    std::span<const WorldRay> rays, std::span<SurfaceHit> hits,
                    std::span<SurfaceSample> surfaces, RayTrail* trail) {
  std::vector<WayBack> ways;
  Eigen::Vector3d origin = Eigen::Vector3d::Constant(kInfinity);
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  double depth_m = 0.0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const WorldRay& ray = rays[i];
    const Eigen::Vector3d start = ray.origin_world + ray.t_min * ray.direction_world;
    if (start != origin) {
      origin = start;
      up = frame.up_world(start);
      depth_m = whole.surface_z_world(start.x(), start.y()).value_or(start.z()) - start.z();
    }
    if (depth_m <= 0.0) continue;
    const double length = ray.direction_world.norm();
    const double rise = ray.direction_world.dot(up) / length;
    // To where the ray is kAbove_m above a round Earth's water.
    const double way_m =
        kEarthRadius_m *
        (std::sqrt(rise * rise + 2.0 * (depth_m + kAbove_m) / kEarthRadius_m) - rise);
    const double t_end = std::min(hits[i].t, ray.t_max);
    ways.push_back({i, t_end, std::min(ray.t_min + way_m / length, t_end)});
  }
  std::vector<WorldRay> back;
  std::vector<SurfaceHit> met;
  std::vector<SurfaceSample> met_surfaces;
  for (int round = 0; round < kMaxWaysBack && !ways.empty(); ++round) {
    back.clear();
    for (const WayBack& way : ways) {
      const WorldRay& ray = rays[way.ray];
      back.push_back({.origin_world = ray.origin_world + way.t_from * ray.direction_world,
                      .direction_world = -ray.direction_world,
                      .t_max = std::max(way.t_from - ray.t_min, 0.0)});
    }
    met.resize(back.size());
    met_surfaces.resize(back.size());
    whole.intersect(back, met, Coherence::Incoherent, met_surfaces, trail);
    std::vector<WayBack> left;
    for (std::size_t k = 0; k < ways.size(); ++k) {
      WayBack way = ways[k];
      const WorldRay& ray = rays[way.ray];
      if (met[k].is_sky()) continue;
      if (!met[k].is_ground()) {
        way.t_from -= met[k].t + kBeyondSolid_m / ray.direction_world.norm();
        if (way.t_from > ray.t_min) left.push_back(way);
        continue;
      }
      if (met[k].t > 0.0) {
        if (!is_water(met_surfaces[k].cover)) continue;
        hits[way.ray] = met[k];
        hits[way.ray].t = way.t_from - met[k].t;
        if (!surfaces.empty()) surfaces[way.ray] = met_surfaces[k];
        continue;
      }
      // It starts in the water still.
      if (way.t_from >= way.t_end) continue;
      way.t_from = std::min(ray.t_min + 2.0 * (way.t_from - ray.t_min), way.t_end);
      left.push_back(way);
    }
    ways = std::move(left);
  }
}

}  // namespace terracast::world
