#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

namespace terracast::tiler {

enum class Crop : std::uint8_t { Fallow, Corn, Wheat, Vine };

/// A piece of a field, kCropPiece_m wide.
struct CropPiece {
  Eigen::Vector2d center_world;
  double heading_rad = 0.0;  ///< of its rows
  Crop crop = Crop::Fallow;
};

/// Fields over the plane: regions (cells about random centres) in which fields lie along one direction, each
/// a rectangle with its own crop and a margin round it.
///
/// threads   safe
class Fields {
 public:
  /// grows_vines   whether the climate is one for them
  Fields(std::uint64_t seed, bool grows_vines) : seed_(seed), grows_vines_(grows_vines) {}

  /// Pieces are counted by square cells of this side: none holds the centres of two.
  static constexpr double kCell_m = 2.75;

  /// The piece whose centre is in a cell, wholly within its field.
  std::optional<CropPiece> piece_in(std::int32_t cell_x, std::int32_t cell_y) const;

 private:
  struct Region {
    Eigen::Vector2d center_world;
    std::uint64_t key;
    double heading_rad;
  };
  Region region_at(const Eigen::Vector2d& place_world) const;

  std::uint64_t seed_;
  bool grows_vines_;
};

}  // namespace terracast::tiler
