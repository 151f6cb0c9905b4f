#include "tiler/vegetation/fields.h"

#include <cmath>

#include "tiler/vegetation/crop_rows.h"

namespace terracast::tiler {
namespace {

static_assert(kCropPiece_m == world::FieldPattern::kPiece_m);

/// Pieces left out along the border of a field.
constexpr std::int64_t kMargin = 1;

}  // namespace

std::optional<CropPiece> Fields::piece_in(std::int32_t cell_x, std::int32_t cell_y) const {
  const Eigen::Vector2d middle((cell_x + 0.5) * kCell_m, (cell_y + 0.5) * kCell_m);
  const world::FieldPattern::Region region = pattern_.region_at(middle);
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
    for (const double dv : {-0.5, 0.5})
      if (pattern_.region_at(piece.center_world + kCropPiece_m * (du * along + dv * across)).key !=
          region.key)
        return std::nullopt;
  return piece;
}

}  // namespace terracast::tiler
