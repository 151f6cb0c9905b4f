#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "world/tile_id.h"
#include "world/tile_objects.h"

namespace terracast::world {

/// What covers the ground at a sample; the semantic class of a hit comes from it (and, on Land,
/// from the ground material that slope, height and moisture give).
enum class Cover : std::uint8_t {
  Land = 0,     ///< nothing is known of it
  Sea = 1,      ///< the sea's surface, at the geoid's height
  Outside = 2,  ///< land of the apron, beyond the world's square
  // Land of which a source of land cover knows more.
  Forest = 3,
  Shrubs = 4,
  Grass = 5,
  Crops = 6,
  BuiltUp = 7,
  Bare = 8,
  Snow = 9,
  Wetland = 10,
  // Water on land, at its own level.
  Lake = 11,
  River = 12,
  /// The bed below water, where the water is left out (RayQuery::WithoutWater); not in tiles' files.
  Seabed = 13,
};
inline constexpr int kNumCovers = 14;

/// Whether a cover is the surface of water.
constexpr bool is_water(Cover cover) {
  return cover == Cover::Sea || cover == Cover::Lake || cover == Cover::River;
}

/// Whether tiles are read with Tile::water_depth_steps. Most rays do not need them: the surface of
/// water is opaque for them.
enum class WaterDepth : std::uint8_t { LeftOut, Read };

/// How far a tile's centre may be from the middle between its lowest and highest sample.
constexpr double kCenterReach_m = 1.0;

/// What stands on one tile. Arrays have kTileSamples^2 entries, row by row from south to north,
/// each row from west to east: entry (i, j) at j * kTileSamples + i.
struct Tile {
  TileId id;
  /// World z of the tile's centre: a whole number of metres, so that floats about it are exact, within
  /// kCenterReach_m of the middle between lowest and highest.
  double center_z_m = 0.0;
  /// Height above center_z_m in steps of kHeightStep_m.
  std::vector<std::int32_t> height_steps;
  std::vector<Cover> cover;
  std::vector<std::uint8_t> moisture;  ///< 0 dry ridge … 255 wet valley floor
  /// Row of WorldManifest::sources that gave the height; at sea, its floor's.
  std::vector<std::uint8_t> source;
  /// Of the bed of the sea, of a lake or of a river below the sample, downward in the world's frame, in
  /// steps of kHeightStep_m; 0 on land, empty where the tile has no water. Written with a tile, but
  /// read with it only where that is asked for (WaterDepth::Read).
  std::vector<std::int32_t> water_depth_steps;
  TileObjects objects;
  /// Nothing of the objects reaches higher above center_z_m, in steps of kHeightStep_m.
  std::int32_t objects_top_steps = kNoObjects;
  static constexpr std::int32_t kNoObjects = std::numeric_limits<std::int32_t>::min();

  bool operator==(const Tile&) const = default;

  static std::size_t sample(int i, int j) {
    return static_cast<std::size_t>(j) * kTileSamples + static_cast<std::size_t>(i);
  }
  /// World z of a sample, exact.
  double z_world(int i, int j) const {
    return center_z_m + height_steps[sample(i, j)] * kHeightStep_m;
  }
  double lowest_z_world() const;   ///< of the ground
  double highest_z_world() const;  ///< of the ground and the objects
};

}  // namespace terracast::world
