#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "world/embree_scene.h"
#include "world/terrain_walk.h"
#include "world/tile_map.h"

namespace terracast::world {

/// A ray on its way through the tiles.
struct RayState {
  WalkRay walk;
  std::array<float, 3> direction = {};  ///< unit
  double t_max = 0.0;
  TilePassage passage;  ///< through the tile where it is now
  double t_cast = 0.0;  ///< from where Embree looks
  /// Whether it may have lain on the surface where it came into the tile, and whether it still
  /// does.
  bool may_be_on_surface = false;
  bool is_on_surface = false;
  bool has_crossing = false;
  WalkResult walked;  ///< the crossing, when there is one
};

/// What is asked of a cast. Crossings are the same for all; Any only wants to know whether there is
/// one.
enum class CastKind { FirstCoherent, FirstIncoherent, Any };

/// Casts up to kWidth rays through the tile in which they are, packet-wise; sets has_crossing and
/// walked of those that meet the surface there.
///
/// A ray that comes in near the surface is first walked until it is clear of it. Then Embree
/// proposes where the ray meets the surface raised by epsilon; the walk starts just before that
/// place and either finds the crossing or is clear again, and Embree is asked again from there.
/// rays       1 to kWidth
/// returns    number of times that Embree was asked again
template <int kWidth>
int cast_through_tile(const TileScene& scene, std::span<RayState* const> rays, CastKind kind);

}  // namespace terracast::world
