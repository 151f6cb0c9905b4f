#pragma once

#include <array>
#include <span>

#include "world/cast_lanes.h"
#include "world/embree_scene.h"
#include "world/ray_lanes.h"

namespace terracast::world {

/// What is asked of a cast. Crossings are the same for all; Any only wants to know whether there is
/// one.
enum class CastKind { FirstCoherent, FirstIncoherent, Any };

/// Rays in one tile that are cast at it together.
struct CastGroup {
  RayLanes* rays = nullptr;
  LaneMask asked = 0;
  LaneMask found = 0;       ///< those that meet the ground or an object in this tile
  CrossingLanes crossings;  ///< of objects t alone
  LaneMask on_objects = 0;  ///< those of `found` that meet an object first
  std::array<ObjectMeeting, RayLanes::kLanes> meetings;  ///< of these
};

/// Casts groups of rays through the tile in which they are, as one packet of Embree's. Keeps
/// may_be_on_surface of the rays.
///
/// A ray that comes in near the surface is first walked until it is clear of it. Then Embree
/// proposes where the ray meets the surface raised by epsilon; the walk starts just before that
/// place and either finds the crossing or is clear again, and Embree is asked again from there.
/// Objects are met in [t_entry, t_exit), before the ground; at a ray's end its last point counts too.
/// groups     kWidth / RayLanes::kLanes of them; any rays, none of them asked, where there are fewer
/// returns    number of times that Embree was asked again
template <int kWidth>
int cast_through_tile(const TileScene& scene, CastKind kind,
                      std::span<CastGroup, kWidth / RayLanes::kLanes> groups);

}  // namespace terracast::world
