#include "world/tile_id.h"

#include <fmt/format.h>

#include <cmath>

#include "core/error.h"
#include "geo/rounding.h"

namespace terracast::world {

double TileId::spacing_m() const { return geo::power_of_two(level); }

bool TileId::contains(const TileId& other) const {
  const int levels_up = level - other.level;
  if (levels_up < 0 || levels_up > 31) return false;
  return (other.x >> levels_up) == x && (other.y >> levels_up) == y;
}

std::string TileId::name() const { return fmt::format("{}/{}/{}", level, x, y); }

TileId tile_at(int level, double x_world, double y_world) {
  const double side_m = std::ldexp(static_cast<double>(kTileCells), level);
  const double x = std::floor(x_world / side_m);
  const double y = std::floor(y_world / side_m);
  TERRACAST_CHECK(std::abs(x) < 0x1.0p30 && std::abs(y) < 0x1.0p30,
                  "place ({}, {}) m has no tile of level {}", x_world, y_world, level);
  return {level, static_cast<std::int32_t>(x), static_cast<std::int32_t>(y)};
}

}  // namespace terracast::world
