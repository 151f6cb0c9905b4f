#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "tiler/buildings/town.h"
#include "world/tile.h"

namespace terracast::tiler {

/// What covers the ground between buildings: the ground of towns where they stand close, grass of
/// gardens where they stand loosely, nothing that would be known where there are few. How close is
/// the share of the ground that they cover, in a square 224 m wide, linear between places 32 m
/// apart.
///
/// threads   safe
class SettledGround {
 public:
  /// Covered share from which on ground is settled (a house of 100 m2 on each 3300), and built up.
  static constexpr double kSettled = 0.03;
  static constexpr double kBuiltUp = 0.24;

  SettledGround() = default;
  /// size_m   of the world's square
  SettledGround(std::span<const Building> buildings, double size_m);

  /// Share of the ground that buildings cover around a place, each where its middle is.
  double share(const Eigen::Vector2d& place_world) const;
  std::optional<world::Cover> cover(const Eigen::Vector2d& place_world) const;

 private:
  double half_size_m_ = 0.0;
  int side_ = 0;                        ///< cells along the square
  std::vector<std::uint32_t> area_m2_;  ///< around each cell's middle
};

}  // namespace terracast::tiler
