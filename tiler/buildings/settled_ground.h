#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "tiler/buildings/town.h"
#include "tiler/gradient_noise.h"
#include "tiler/grid.h"
#include "world/tile.h"

namespace terracast::tiler {

/// What covers the ground between buildings: the ground of towns where they stand close, grass of
/// gardens where they stand loosely, nothing that would be known where there are few. How close is
/// the share of the ground that they cover, in a square 224 m wide, linear between places 32 m
/// apart.
///
/// Where nobody plans what lies open in a town (buildings that were surveyed or mapped), ground
/// within 160 m of what is built up is the town's, too: half of it squares and terraces (built up),
/// half gardens (shrubs), by noise of 80 m's period. The sea's shore within 48 m of it, up to 480 m
/// from what is built up, is built up: quays and harbours' land. Distances are to the middles of
/// cells 32 m wide, linear between these.
///
/// threads   safe
class SettledGround {
 public:
  /// Covered share from which on ground is settled (a house of 100 m2 on each 3300), and built up.
  static constexpr double kSettled = 0.03;
  static constexpr double kBuiltUp = 0.24;
  static constexpr double kOpenInTown_m = 160.0;
  static constexpr double kQuay_m = 48.0;
  static constexpr double kHarbourOfTown_m = 480.0;

  SettledGround() = default;
  /// size_m   of the world's square
  /// is_sea   asked near towns; none where a plan says what lies open in them
  /// seed     of gardens
  SettledGround(std::span<const Building> buildings, double size_m,
                const std::function<bool(const Eigen::Vector2d& place_world)>& is_sea = {},
                std::uint64_t seed = 0);

  /// Share of the ground that buildings cover around a place, each where its middle is.
  double share(const Eigen::Vector2d& place_world) const;
  std::optional<world::Cover> cover(const Eigen::Vector2d& place_world) const;

 private:
  void measure_towns(const std::function<bool(const Eigen::Vector2d& place_world)>& is_sea);
  /// Of open ground that is a town's own.
  std::optional<world::Cover> open_cover(const Eigen::Vector2d& place_world) const;
  /// Grid coordinates among the cells' middles.
  Eigen::Vector2d cell_of(const Eigen::Vector2d& place_world) const;

  double half_size_m_ = 0.0;
  int side_ = 0;                        ///< cells along the square
  std::vector<std::uint32_t> area_m2_;  ///< around each cell's middle
  Grid<float> built_up_m_;  ///< distance to ground that is built up; empty where planned
  Grid<float> sea_m_;       ///< to the sea, near towns; empty without one
  GradientNoise gardens_{0, 0};
};

}  // namespace terracast::tiler
