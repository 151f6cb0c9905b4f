#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace terracast::world {

enum class Cover : std::uint8_t;  // world/tile.h

enum class Crop : std::uint8_t { Fallow, Corn, Wheat, Vine, Beets, Rape, Clover, Stubble };
inline constexpr int kNumCrops = 8;

/// How a world's cropland is parted: regions (cells about random centres) in which fields lie along one
/// direction, each a rectangle with its own crop, in strips. Strips and fields are from half to one and a half
/// times as wide and long as their region's mean, in whole squares of kPiece_m. What is sown there, what
/// stands along borders and what the ground shows all follow it.
///
/// On meadows borders follow the ground: they are those of the pattern, bent by up to kMostBent_m.
///
/// threads   safe; all is a function of the seed and the place
class FieldPattern {
 public:
  static constexpr double kPiece_m = 4.0;
  static constexpr double kMostBent_m = 24.0;

  /// seed          the world's
  /// grows_vines   whether the climate is one for them
  FieldPattern(std::uint64_t seed, bool grows_vines);
  /// By the latitude of a world's origin.
  static bool grows_vines(double lat_deg);

  /// Directions are unit vectors; rows of crops run along.
  struct Region {
    Eigen::Vector2d center_world = Eigen::Vector2d::Zero();
    Eigen::Vector2d along = Eigen::Vector2d::UnitX();
    double heading_rad = 0.0;
    std::uint64_t key = 0;
    std::int64_t pieces_along = 1;  ///< of its fields, on average
    std::int64_t pieces_across = 1;
    double edge_m = 0.0;  ///< from the place to the next region
  };
  Region region_at(const Eigen::Vector2d& place_world) const;

  /// The field that holds a piece of a region, counted from its centre along and across.
  struct Field {
    std::uint64_t key = 0;
    Crop crop = Crop::Fallow;
    std::int64_t piece_along = 0;  ///< of the field's own, from 0
    std::int64_t piece_across = 0;
  };
  Field field_of(const Region& region, std::int64_t along, std::int64_t across) const;

  struct Place {
    std::uint64_t key = 0;  ///< the field's
    Crop crop = Crop::Fallow;
    double along_m = 0.0;  ///< from its corner
    double across_m = 0.0;
    double edge_m = 0.0;  ///< to its border
  };
  /// Where borders are straight.
  Place at(const Eigen::Vector2d& place_world) const;
  /// As land under a cover is parted: bent on Cover::Grass. Lengths are then those of the pattern, a tenth or two from
  /// the ground's.
  Place at(const Eigen::Vector2d& place_world, Cover cover) const;

 private:
  Eigen::Vector2d bent(const Eigen::Vector2d& place_world) const;

  std::uint64_t seed_;
  bool grows_vines_;
};

}  // namespace terracast::world
