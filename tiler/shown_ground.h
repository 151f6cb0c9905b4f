#pragma once

#include <Eigen/Core>

namespace terracast::tiler {

class LayerSite;

/// Tiles hold every 2^level-th sample of the ground: what stands on the top of a wall beside a way, or on a rock in
/// the sea, may have nothing below it on a coarse tile. It is not shown there.

/// The last of some levels of which all have ground below a place: their triangles lie less than 0.2 m and 0.3
/// samples' spacing below it. The one before the first, where that has none. All have where no layer has walls near:
/// tiles show natural ground well enough.
/// cost      three samples of the ground for each level with walls near
/// threads   safe
int last_level_with_ground(const LayerSite& site, const Eigen::Vector2d& place_world,
                           double ground_z_world, int first_level, int last_level);

/// Whether tiles of a level show water at all four samples round a place.
bool is_amid_water(const LayerSite& site, const Eigen::Vector2d& place_world, int level);

}  // namespace terracast::tiler
