#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/context.h"
#include "tiler/grid.h"

namespace terracast::tiler {

/// Procedural land as its field interpolates it.
struct KeptLand {
  std::string input_hash;  ///< HeightField::input_hash
  Grid<float> heights_m;
};

/// The part of a world's ground that takes long to make and that heights along paths need, in the
/// file `ground.bin` of the world's folder.
///
/// What was read is used by its hashes: that of other inputs is not taken, so that heights are the
/// same bit for bit with the file and without it.
struct KeptGround {
  std::string input_hash;  ///< WorldSurface::input_hash of the ground without layers
  // WorldSurface::lowest_m and highest_m.
  double lowest_m = 0.0;
  double highest_m = 0.0;
  // Of GeodesyCells.
  double node_spacing_m = 0.0;
  double largest_probe_error_m = 0.0;
  std::vector<KeptLand> lands;
};

/// Writes the file atomically.
/// cost   0.5 s of CPU for a land of 1900 samples a side
void write_kept_ground(const std::filesystem::path& store, const KeptGround& ground);

/// Reads the file. nullopt: there is none, or it is damaged or of another version, which the log says.
/// throws   Io
std::optional<KeptGround> read_kept_ground(const std::filesystem::path& store,
                                           const core::Log& log);

}  // namespace terracast::tiler
