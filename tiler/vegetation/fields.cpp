#include "tiler/vegetation/fields.h"

#include <algorithm>
#include <cmath>

#include "tiler/vegetation/crop_rows.h"

namespace terracast::tiler {
namespace {

static_assert(kCropPiece_m == world::FieldPattern::kPiece_m);

/// Pieces left out along the border of a field.
constexpr std::int64_t kMargin = 1;

/// Places nearer than this to one of a region lie in it, too. Centres of regions are 256 m apart and more, and
/// those that were not looked at 768 m from the place.
double reach_m(const world::FieldPattern::Region& region, const Eigen::Vector2d& place_world) {
  constexpr double kLeastApart_m = 256.0;
  constexpr double kOthers_m = 768.0;
  constexpr double kRounding_m = 1e-6;
  const double center_m = (region.center_world - place_world).norm();
  // By the distance to the line half-way to the second nearest centre.
  const double second_m = std::sqrt(center_m * center_m + 2.0 * kLeastApart_m * region.edge_m);
  // A step brings the centre nearer, and takes others away, by no more than its length.
  return 0.5 * (std::min(second_m, kOthers_m) - center_m) - kRounding_m;
}

}  // namespace

std::optional<CropPiece> Fields::piece_in(std::int32_t cell_x, std::int32_t cell_y,
                                          std::optional<Found>& last) const {
  const Eigen::Vector2d middle((cell_x + 0.5) * kCell_m, (cell_y + 0.5) * kCell_m);
  const auto is_in_last = [&](const Eigen::Vector2d& place) {
    return (place - last->place_world).norm() < last->reach_m;
  };
  if (!last || !is_in_last(middle)) {
    last = Found{middle, pattern_.region_at(middle)};
    last->reach_m = reach_m(last->region, middle);
  }
  const world::FieldPattern::Region& region = last->region;
  const Eigen::Vector2d& along = region.along;
  const Eigen::Vector2d across(-along.y(), along.x());
  const Eigen::Vector2d from_center = middle - region.center_world;
  // The lattice of pieces is wider than a cell's diagonal: at most one centre is in it, that nearest
  // to its middle.
  const auto u = static_cast<std::int64_t>(std::floor(from_center.dot(along) / kCropPiece_m));
  const auto v = static_cast<std::int64_t>(std::floor(from_center.dot(across) / kCropPiece_m));
  CropPiece piece;
  piece.heading_rad = region.heading_rad;
  piece.center_world = region.center_world + (static_cast<double>(u) + 0.5) * kCropPiece_m * along +
                       (static_cast<double>(v) + 0.5) * kCropPiece_m * across;
  if (std::floor(piece.center_world.x() / kCell_m) != cell_x ||
      std::floor(piece.center_world.y() / kCell_m) != cell_y)
    return std::nullopt;
  const world::FieldPattern::Field field = pattern_.field_of(region, u, v);
  if (field.piece_across < kMargin || field.piece_along < kMargin) return std::nullopt;
  piece.crop = field.crop;
  for (const double du : {-0.5, 0.5})
    for (const double dv : {-0.5, 0.5}) {
      const Eigen::Vector2d corner = piece.center_world + kCropPiece_m * (du * along + dv * across);
      if (!is_in_last(corner) && pattern_.region_at(corner).key != region.key) return std::nullopt;
    }
  return piece;
}

}  // namespace terracast::tiler
