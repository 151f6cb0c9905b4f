#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "geo/geodesy.h"
#include "world/ray_query.h"
#include "world/tile.h"

/// What viewers in water see: its bed, and its surface from below.
namespace terracast::world {

/// Lowers the ground of a tile to the bed of its waters, and takes their depth from it.
/// tile   read with WaterDepth::Read
void drain(Tile& tile);

/// Ends rays that leave the water at its surface.
/// whole      of the world with its water
/// hits       in the world without water
/// surfaces   of the hits, or none
/// trail      of the tiles that it asks for, or null
void end_at_surface(const RayQuery& whole, const geo::WorldFrame& frame,
                    std::span<const WorldRay> rays, std::span<SurfaceHit> hits,
                    std::span<SurfaceSample> surfaces, RayTrail* trail);

}  // namespace terracast::world
