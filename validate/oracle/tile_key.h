#pragma once

#include <compare>
#include <string>

namespace terracast::oracle {

/// Address of a tile: level L has samples every 2^L m, 256 cells along a side; tile (L, x, y) covers
/// [x, x+1] x [y, y+1] times its side.
struct TileKey {
  int level = 0;
  int x = 0;
  int y = 0;

  auto operator<=>(const TileKey&) const = default;

  TileKey parent() const { return {level + 1, x >> 1, y >> 1}; }
  /// quadrant   bit 0: east, bit 1: north
  TileKey child(int quadrant) const {
    return {level - 1, 2 * x + (quadrant & 1), 2 * y + (quadrant >> 1)};
  }
  /// "3/0/-1": level, x, y.
  std::string name() const {
    return std::to_string(level) + "/" + std::to_string(x) + "/" + std::to_string(y);
  }
};

}  // namespace terracast::oracle
