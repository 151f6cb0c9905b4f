#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/context.h"
#include "core/json.h"
#include "world/tile_store.h"

namespace terracast::world_check {

/// What one kind of faults was asked of, and how often it was found.
struct Result {
  std::string_view name;     ///< "open_mesh", "floating_building", …
  std::string_view meaning;  ///< in a few words
  std::int64_t num_asked = 0;
  std::int64_t num_faults = 0;
  std::vector<std::string> examples;  ///< the first faults by tile, in words
};

/// What is wrong in a world.
struct WorldFaults {
  std::vector<Result> results;  ///< of every kind, in a fixed order
  /// What is told and not wrong: users' models whose meshes, as their files have them, are not what
  /// is asked of all other shapes. In models, by their finest level.
  std::vector<Result> information;
  bool is_right() const;  ///< whether the results hold no fault
};

/// Looks at all prototypes and all tiles of a world: meshes; that what reaches over several tiles is whole in each
/// and there once; that what stands, stands on the ground, and nothing grows in water but seagrass, which grows there alone, on roads or in walls.
///
/// results   the same for any number of threads
/// memory    a tile for each thread, and 40 B for each object in each tile
/// throws    Input: a damaged tile or prototype; Io
WorldFaults check_world(const world::TileStore& store, const core::Context& context);

/// {"ok", "world", "results": [{"name", "asked", "faults", "examples", "meaning"}],
/// "information": [{"name", "asked", "found", "examples", "meaning"}],
/// "layers": [{"name", "kind", "counts"}]}
core::Json json_from(const WorldFaults& faults, const world::WorldManifest& manifest);

/// The same as a table for people.
std::string table_of(const WorldFaults& faults, const world::WorldManifest& manifest);

}  // namespace terracast::world_check
