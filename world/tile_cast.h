#pragma once

#include <array>
#include <cstdint>
#include <limits>

#include "world/embree_scene.h"
#include "world/terrain_walk.h"

namespace terracast::world {

inline constexpr int kMaxPacket = 16;

/// A ray on its way through the tiles.
struct RayState {
  WalkRay walk;
  double inverse_length = 1.0;          ///< of the direction
  std::array<float, 3> direction = {};  ///< unit
  double t_min = 0.0;
  double t_max = 0.0;
  double t_world = 0.0;  ///< where the top scene's float ray starts
  /// The first crossing so far, and the tile (index into the cut) that holds it.
  double best_t = std::numeric_limits<double>::infinity();
  std::uint32_t best_tile = 0;
  WalkResult best;
};

/// What is known of a tile without loading it.
struct TileBounds {
  double x0_world = 0.0;
  double x1_world = 0.0;
  double y0_world = 0.0;
  double y1_world = 0.0;
  double highest_z_world = 0.0;
};

/// A ray's way through one tile.
struct TilePassage {
  RayState* ray = nullptr;
  double t_entry = 0.0;  ///< where the ray starts in the tile or comes in through a side
  double t_exit = 0.0;   ///< where it ends or goes out through a side
  double t_top = 0.0;  ///< where it sinks below (or, rising, passes) the tile's highest point; ±inf
                       ///< when it does not
  int side =
      -1;  ///< through which it comes in: 0 west, 1 east, 2 south, 3 north; -1: it starts inside
  bool is_falling = false;
};

/// The part of a ray within a tile's closed footprint. Sides are crossed at (side - origin) /
/// direction, from world coordinates alone, so that the exit from a tile is the entry into the next
/// one to the last bit. returns   false when the ray does not enter it below its highest point, or
/// only after its first crossing so far
bool find_passage(const TileBounds& bounds, RayState& ray, TilePassage& passage);

/// Casts up to kMaxPacket rays through a tile, packet-wise, and gives each its crossing when that
/// is the first so far (at equal t the lower tile index).
///
/// A ray that comes in near the surface is first walked until it is clear of it. Then Embree
/// proposes where the ray meets the surface raised by epsilon; the walk starts just before that
/// place and either finds the crossing or is clear again, and Embree is asked again from there.
/// width            1, 4, 8 or 16: passages[i].ray is null for lanes without a ray
/// is_coherent      a hint to Embree
/// returns          number of times that Embree was asked again
int cast_through_tile(const TileScene& scene, std::uint32_t tile_index,
                      std::array<TilePassage, kMaxPacket>& passages, int width, bool is_coherent);

}  // namespace terracast::world
