#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "world/tile.h"

namespace terracast::world {

inline constexpr int kTileFileVersion = 3;

/// A tile as bytes: a header (magic "TCTILE", version, address, centre, bounds, sizes, XXH3
/// checksum of all the rest), then each layer predicted from its neighbours and deflated. Same
/// tile, same bytes.
std::vector<std::byte> encode_tile(const Tile& tile);

/// throws Input: not a tile, another version, another address than `expected`, a wrong checksum,
/// sizes that do not
///        fit, depths that are none; names `file` and what to do (tile again)
Tile decode_tile(std::span<const std::byte> bytes, const TileId& expected, const std::string& file,
                 WaterDepth depth = WaterDepth::LeftOut);

/// Tile::cover alone, for a fraction of decode_tile()'s time.
/// throws   as decode_tile(), for what it reads
std::vector<Cover> decode_cover(std::span<const std::byte> bytes, const TileId& expected,
                                const std::string& file);

/// How many bytes a tile's objects are when they are inflated, as the header of a whole tile has it.
std::size_t objects_bytes_of(std::span<const std::byte> bytes);

}  // namespace terracast::world
