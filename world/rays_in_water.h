#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "world/ray_query.h"
#include "world/tile.h"

/// What viewers in water see: its bed, and its surface from below.
namespace terracast::world {

/// Lowers the ground of a tile to the bed of its waters, and takes their depth from it.
/// tile   read with WaterDepth::Read
void drain(Tile& tile);

/// Turns a tile upside down, z to -z, and takes away what stands on it.
void turn_over(Tile& tile);

/// Ends rays that leave the water at its surface: at the first facet through which they come up and of whose corners the
/// one that counts most is water. At a shore a ray may come up through land before, out of the water's edge, and go down
/// again.
/// whole        of the world with its water
/// turned       of the same upside down: where a ray comes up through the surface, there it falls through
/// hits         in the world without water
/// surfaces     of the hits, or none
/// trail        of the tiles that it asks for, or null
/// accuracy     as RayQuery
void end_at_surface(const RayQuery& whole, const RayQuery& turned, std::span<const WorldRay> rays,
                    std::span<SurfaceHit> hits, std::span<SurfaceSample> surfaces, RayTrail* trail);

}  // namespace terracast::world
