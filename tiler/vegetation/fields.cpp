#include "tiler/vegetation/fields.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "core/random.h"
#include "tiler/vegetation/crop_rows.h"

namespace terracast::tiler {
namespace {

constexpr double kRegion_m = 640.0;
/// Fields along and across their rows, in pieces.
constexpr std::int64_t kPiecesAlong = 44;
constexpr std::int64_t kPiecesAcross = 17;
/// Pieces left out along the border of a field.
constexpr std::int64_t kMargin = 1;

std::uint64_t key_of(std::int64_t x, std::int64_t y) {
  return static_cast<std::uint64_t>(x) * 0x9e3779b97f4a7c15ULL ^
         core::mix_bits(static_cast<std::uint64_t>(y));
}

std::int64_t floor_divided(std::int64_t value, std::int64_t by) {
  return value >= 0 ? value / by : -((by - 1 - value) / by);
}

}  // namespace

Fields::Region Fields::region_at(const Eigen::Vector2d& place_world) const {
  const auto cell_x = static_cast<std::int64_t>(std::floor(place_world.x() / kRegion_m));
  const auto cell_y = static_cast<std::int64_t>(std::floor(place_world.y() / kRegion_m));
  Region nearest{};
  double least2 = std::numeric_limits<double>::infinity();
  for (std::int64_t y = cell_y - 1; y <= cell_y + 1; ++y)
    for (std::int64_t x = cell_x - 1; x <= cell_x + 1; ++x) {
      const std::uint64_t key = core::random_bits(seed_, 0x726567696f6eULL, key_of(x, y));
      const Eigen::Vector2d center(
          kRegion_m * (static_cast<double>(x) + core::random_between(0.2, 0.8, key, 0, 0)),
          kRegion_m * (static_cast<double>(y) + core::random_between(0.2, 0.8, key, 0, 1)));
      const double distance2 = (center - place_world).squaredNorm();
      if (distance2 >= least2) continue;
      least2 = distance2;
      nearest = {center, key, core::random_between(0.0, std::numbers::pi, key, 0, 2)};
    }
  return nearest;
}

std::optional<CropPiece> Fields::piece_in(std::int32_t cell_x, std::int32_t cell_y) const {
  const Eigen::Vector2d middle((cell_x + 0.5) * kCell_m, (cell_y + 0.5) * kCell_m);
  const Region region = region_at(middle);
  const Eigen::Vector2d along(std::cos(region.heading_rad), std::sin(region.heading_rad));
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
  // Strips of fields are shifted against each other.
  const std::int64_t strip = floor_divided(v, kPiecesAcross);
  const auto shift = static_cast<std::int64_t>(
      core::random_bits(region.key, 1, static_cast<std::uint64_t>(strip)) % kPiecesAlong);
  const std::int64_t field = floor_divided(u + shift, kPiecesAlong);
  const std::int64_t in_strip = v - strip * kPiecesAcross;
  const std::int64_t in_field = u + shift - field * kPiecesAlong;
  if (in_strip < kMargin || in_field < kMargin) return std::nullopt;
  const double drawn = core::random_unit(region.key, 2, key_of(strip, field));
  piece.crop = drawn < 0.34                   ? Crop::Wheat
               : drawn < 0.62                 ? Crop::Corn
               : drawn < 0.82 && grows_vines_ ? Crop::Vine
               : drawn < 0.9                  ? Crop::Corn
                                              : Crop::Fallow;
  for (const double du : {-0.5, 0.5})
    for (const double dv : {-0.5, 0.5})
      if (region_at(piece.center_world + kCropPiece_m * (du * along + dv * across)).key !=
          region.key)
        return std::nullopt;
  return piece;
}

}  // namespace terracast::tiler
