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
  /// Where the ray is as high as the water that it starts in.
  double t_level;
  double t_flat;           ///< within so much of there it leaves a flat water
  bool is_halved = false;  ///< whether it was begun nearer to there since
};
/// Above the surface the way back starts at this height, if nothing is met before.
constexpr double kAbove_m = 5.0;
/// What is no higher over the water's level is flat: heights are in steps of a millimetre.
constexpr double kFlat_m = 2e-3;
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
    // To where the ray is so high above a round Earth's water.
    const auto t_above = [&](double height_m) {
      const double way_m =
          kEarthRadius_m *
          (std::sqrt(rise * rise + 2.0 * (depth_m + height_m) / kEarthRadius_m) - rise);
      return ray.t_min + way_m / length;
    };
    const double t_end = std::min(hits[i].t, ray.t_max);
    ways.push_back({i, t_end, std::min(t_above(kAbove_m), t_end), t_above(0.0),
                    t_above(kFlat_m) - t_above(0.0)});
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
        const double t_met = way.t_from - met[k].t;
        if (is_water(met_surfaces[k].cover)) {
          hits[way.ray] = met[k];
          hits[way.ray].t = t_met;
          if (!surfaces.empty()) surfaces[way.ray] = met_surfaces[k];
        }
        // At a shore a ray may come up more than once: the first time counts.
        if (t_met - way.t_level > way.t_flat) {
          way.is_halved = true;
          way.t_from = 0.5 * (way.t_level + t_met);
          left.push_back(way);
        }
        continue;
      }
      // It starts in the water still, or where the bed's triangles at the shore lie below the land's: between there and
      // the water's level it may have been in the air.
      if (way.t_from >= way.t_end || way.is_halved) {
        if (!(way.t_level < way.t_from)) continue;
        way.is_halved = true;
        way.t_from = 0.5 * (way.t_level + way.t_from);
        left.push_back(way);
        continue;
      }
      way.t_from = std::min(ray.t_min + 2.0 * (way.t_from - ray.t_min), way.t_end);
      left.push_back(way);
    }
    ways = std::move(left);
  }
}

}  // namespace terracast::world
