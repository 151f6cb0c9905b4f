#pragma once

#include <Eigen/Core>
#include <compare>
#include <cstdint>
#include <functional>
#include <string>

namespace terracast::world {

/// Cells along a tile's side, at every level; a tile has (kTileCells + 1)^2 height samples, its
/// borders included.
inline constexpr int kTileCells = 256;
inline constexpr int kTileSamples = kTileCells + 1;

/// Heights lie on one lattice over the whole world: a height is an integer count of this step.
inline constexpr double kHeightStep_m = 0x1.0p-10;

/// Address of a tile in the sparse quadtree over the world's x-y plane.
///
/// Level L has samples every 2^L m; tile (L, x, y) covers [x, x+1] x [y, y+1] times its side of 256
/// * 2^L m. Sample (i, j) of it stands at world x = (256 x + i) 2^L, y = (256 y + j) 2^L, all exact
/// in binary. Every second sample of a level is a sample of the next coarser one.
struct TileId {
  std::int32_t level = 0;
  std::int32_t x = 0;
  std::int32_t y = 0;

  auto operator<=>(const TileId&) const = default;

  double spacing_m() const;
  double side_m() const { return spacing_m() * kTileCells; }
  /// South-west corner and centre, world x and y.
  Eigen::Vector2d corner_world() const { return {x * side_m(), y * side_m()}; }
  Eigen::Vector2d center_world() const { return {(x + 0.5) * side_m(), (y + 0.5) * side_m()}; }

  TileId parent() const { return {level + 1, x >> 1, y >> 1}; }
  /// quadrant   bit 0: east, bit 1: north
  TileId child(int quadrant) const {
    return {level - 1, 2 * x + (quadrant & 1), 2 * y + (quadrant >> 1)};
  }
  TileId neighbour(int dx, int dy) const { return {level, x + dx, y + dy}; }
  bool contains(const TileId& other) const;

  /// "3/0/-1": level, x, y.
  std::string name() const;
};

/// The tile of a level that holds a place; places on a border belong to the tile east or north of
/// it.
TileId tile_at(int level, double x_world, double y_world);

/// Sides of a tile, as bits.
enum TileSide : std::uint8_t { kWest = 1, kEast = 2, kSouth = 4, kNorth = 8 };

}  // namespace terracast::world

template <>
struct std::hash<terracast::world::TileId> {
  std::size_t operator()(const terracast::world::TileId& id) const noexcept {
    std::uint64_t h = static_cast<std::uint32_t>(id.x) * 0x9e3779b97f4a7c15ULL;
    h = (h ^ static_cast<std::uint32_t>(id.y)) * 0xbf58476d1ce4e5b9ULL;
    return (h ^ static_cast<std::uint32_t>(id.level)) * 0x94d049bb133111ebULL >> 7;
  }
};
