#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "world/field_pattern.h"

namespace terracast::tiler {

using world::Crop;

/// A piece of a field, kCropPiece_m wide.
struct CropPiece {
  Eigen::Vector2d center_world;
  double heading_rad = 0.0;  ///< of its rows
  Crop crop = Crop::Fallow;
};

/// The pieces of the fields of a world::FieldPattern, each field with a margin round it.
///
/// threads   safe
class Fields {
 public:
  explicit Fields(const world::FieldPattern& pattern) : pattern_(pattern) {}

  /// Pieces are counted by square cells of this side: none holds the centres of two.
  static constexpr double kCell_m = 2.75;

  /// A region and a place in it; what is nearer to the place than its reach lies in the region, too.
  struct Found {
    Eigen::Vector2d place_world;
    world::FieldPattern::Region region;
    double reach_m = 0.0;
  };
  /// The piece whose centre is in a cell, wholly within its field.
  /// last   a region found before, or none; left as that of this cell: for the next, which is mostly the same
  std::optional<CropPiece> piece_in(std::int32_t cell_x, std::int32_t cell_y,
                                    std::optional<Found>& last) const;

 private:
  world::FieldPattern pattern_;
};

}  // namespace terracast::tiler
