#include "scene/water/water_above.h"

#include <algorithm>
#include <array>

namespace terracast::scene {
namespace {

constexpr std::size_t kAtOnce = 16;
/// Rays that ask what covers the surface start so far above it, so that little can stand between.
constexpr double kFromAbove_m = 0.01;

}  // namespace

void find_water_above(const world::RayQuery& whole, std::span<const Eigen::Vector3d> places_world,
                      std::span<WaterAbove> above, world::RayTrail* trail) {
  std::array<world::WorldRay, kAtOnce> rays;
  std::array<world::SurfaceHit, kAtOnce> hits;
  std::array<world::SurfaceSample, kAtOnce> surfaces;
  std::array<std::size_t, kAtOnce> of_place{};
  std::size_t count = 0;
  const auto ask = [&] {
    whole.intersect(std::span(rays).first(count), std::span(hits).first(count),
                    world::Coherence::Incoherent, std::span(surfaces).first(count), trail);
    for (std::size_t r = 0; r < count; ++r) {
      if (hits[r].is_sky() || !hits[r].is_ground() || !world::is_water(surfaces[r].cover)) continue;
      WaterAbove& found = above[of_place[r]];
      found.cover = surfaces[r].cover;
      found.depth_m =
          std::max(rays[r].origin_world.z() - kFromAbove_m - places_world[of_place[r]].z(), 0.0);
    }
    count = 0;
  };
  for (std::size_t i = 0; i < places_world.size(); ++i) {
    above[i] = {};
    const Eigen::Vector3d& place = places_world[i];
    const std::optional<double> surface_z = whole.surface_z_world(place.x(), place.y());
    if (!surface_z) continue;
    rays[count] = {.origin_world = {place.x(), place.y(), *surface_z + kFromAbove_m},
                   .direction_world = -Eigen::Vector3d::UnitZ(),
                   .t_max = 2.0 * kFromAbove_m};
    of_place[count] = i;
    if (++count == kAtOnce) ask();
  }
  if (count > 0) ask();
}

}  // namespace terracast::scene
