#include "tiler/shown_ground.h"

#include <cmath>
#include <numbers>

#include "tiler/layer.h"
#include "world/tile.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

constexpr double kAbove_m = 0.2;
constexpr double kAbovePerSpacing = 0.3;

/// Whether the triangles of a level's tiles are near below the ground of a place.
bool has_ground(const LayerSite& site, const Vector2d& place_world, double ground_z_world,
                int level) {
  const double shown_z = shown_z_world(
      [&](const Vector2d& sample) { return site.ground_z_world(sample); }, place_world, level);
  return ground_z_world - shown_z <= kAbove_m + kAbovePerSpacing * std::exp2(level);
}

}  // namespace

int last_level_with_ground(const LayerSite& site, const Vector2d& place_world,
                           double ground_z_world, int first_level, int last_level) {
  for (int level = first_level; level <= last_level; ++level) {
    // No sample of the triangle is farther.
    const double farthest_m = std::numbers::sqrt2 * std::exp2(level);
    if (site.has_walls_near(place_world, farthest_m) &&
        !has_ground(site, place_world, ground_z_world, level))
      return level - 1;
  }
  return last_level;
}

bool is_amid_water(const LayerSite& site, const Vector2d& place_world, int level) {
  const double spacing_m = std::exp2(level);
  const Vector2d corner = (place_world / spacing_m).array().floor();
  for (const double north : {0.0, 1.0})
    for (const double east : {0.0, 1.0})
      if (!world::is_water(site.cover(spacing_m * (corner + Vector2d(east, north))))) return false;
  return true;
}

}  // namespace terracast::tiler
