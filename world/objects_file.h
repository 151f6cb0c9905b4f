#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "world/tile_objects.h"

namespace terracast::world {

inline constexpr int kPrototypeFileVersion = 1;

/// A tile's objects as bytes, not deflated (docs/world.md has the layout). Same objects, same bytes.
std::vector<std::uint8_t> bytes_of_objects(const TileObjects& objects);

/// throws Input: bytes that are no objects: too few or too many, corners, finishes or codes that are
///        not there, numbers that are none; names `file`
TileObjects objects_from_bytes(std::span<const std::uint8_t> bytes, const std::string& file);

/// A prototype as a file of its own: magic "TCPROT", version, XXH3 checksum, sizes, then its shapes,
/// deflated. Same prototype, same bytes.
std::vector<std::byte> encode_prototype(const Prototype& prototype);

/// throws Input: not a prototype, another version, a wrong checksum, or as objects_from_bytes()
Prototype decode_prototype(std::span<const std::byte> bytes, const std::string& file);

}  // namespace terracast::world
