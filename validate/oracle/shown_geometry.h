#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "validate/oracle/tile_key.h"

namespace terracast::oracle {

struct ShownTile {
  TileKey key;
  std::string content_hash;
};

/// What a dataset says of the ground that it shows: the tiles that stood for the whole sequence, and
/// the rule by which their levels were chosen.
struct ShownGeometry {
  double cell_px = 0.0;           ///< a cell may span this many pixels before it is split
  double finest_spacing_m = 0.0;  ///< tiles of this spacing are never split
  std::vector<ShownTile> tiles;
};

/// Reads a dataset's geometry.json.
/// name     of the file, for messages
/// throws   Input: another format or version, values that cannot be, no tile or more than 2^15 - 1;
///          Io
ShownGeometry read_shown_geometry(const std::filesystem::path& file, const std::string& name);

}  // namespace terracast::oracle
