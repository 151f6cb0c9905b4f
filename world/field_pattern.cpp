#include "world/field_pattern.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/random.h"

namespace terracast::world {
namespace {

using Eigen::Vector2d;

constexpr double kRegion_m = 640.0;

std::uint64_t key_of(std::int64_t x, std::int64_t y) {
  return static_cast<std::uint64_t>(x) * 0x9e3779b97f4a7c15ULL ^
         core::mix_bits(static_cast<std::uint64_t>(y));
}

std::int64_t floor_divided(std::int64_t value, std::int64_t by) {
  return value >= 0 ? value / by : -((by - 1 - value) / by);
}

Crop crop_of(double drawn, bool grows_vines) {
  struct Share {
    Crop crop;
    double upto;
  };
  static constexpr Share kShares[] = {
      {Crop::Wheat, 0.22}, {Crop::Corn, 0.40},   {Crop::Clover, 0.52}, {Crop::Stubble, 0.62},
      {Crop::Beets, 0.71}, {Crop::Fallow, 0.80}, {Crop::Rape, 0.86},   {Crop::Vine, 1.0}};
  for (const Share& share : kShares)
    if (drawn < share.upto)
      return share.crop == Crop::Vine && !grows_vines ? Crop::Wheat : share.crop;
  return Crop::Wheat;
}

}  // namespace

FieldPattern::FieldPattern(std::uint64_t seed, bool grows_vines)
    : seed_(core::stream_of(seed, 0x6669656c6473ULL)), grows_vines_(grows_vines) {}

bool FieldPattern::grows_vines(double lat_deg) {
  return std::abs(lat_deg) > 28.0 && std::abs(lat_deg) < 50.0;
}

FieldPattern::Region FieldPattern::region_at(const Vector2d& place_world) const {
  const auto cell_x = static_cast<std::int64_t>(std::floor(place_world.x() / kRegion_m));
  const auto cell_y = static_cast<std::int64_t>(std::floor(place_world.y() / kRegion_m));
  Region nearest;
  double least2 = std::numeric_limits<double>::infinity();
  double second2 = least2;
  Vector2d second = Vector2d::Zero();
  for (std::int64_t y = cell_y - 1; y <= cell_y + 1; ++y)
    for (std::int64_t x = cell_x - 1; x <= cell_x + 1; ++x) {
      const std::uint64_t key = core::random_bits(seed_, 0x726567696f6eULL, key_of(x, y));
      const Vector2d center(
          kRegion_m * (static_cast<double>(x) + core::random_between(0.2, 0.8, key, 0, 0)),
          kRegion_m * (static_cast<double>(y) + core::random_between(0.2, 0.8, key, 0, 1)));
      const double distance2 = (center - place_world).squaredNorm();
      if (distance2 < least2) {
        second2 = least2;
        second = nearest.center_world;
        least2 = distance2;
        nearest.center_world = center;
        nearest.key = key;
      } else if (distance2 < second2) {
        second2 = distance2;
        second = center;
      }
    }
  // On the line half-way between two centres a place is as far from both.
  nearest.edge_m = 0.5 * (second2 - least2) / (second - nearest.center_world).norm();
  nearest.heading_rad = core::random_between(0.0, std::numbers::pi, nearest.key, 0, 2);
  nearest.along = {std::cos(nearest.heading_rad), std::sin(nearest.heading_rad)};
  nearest.pieces_along = 26 + static_cast<std::int64_t>((nearest.key >> 8) % 38);
  nearest.pieces_across = 9 + static_cast<std::int64_t>((nearest.key >> 16) % 15);
  return nearest;
}

FieldPattern::Field FieldPattern::field_of(const Region& region, std::int64_t along,
                                           std::int64_t across) const {
  // Strips of fields are shifted against each other.
  const std::int64_t strip = floor_divided(across, region.pieces_across);
  const auto shift = static_cast<std::int64_t>(
      core::random_bits(region.key, 1, static_cast<std::uint64_t>(strip)) %
      static_cast<std::uint64_t>(region.pieces_along));
  const std::int64_t number = floor_divided(along + shift, region.pieces_along);
  Field field;
  field.key = core::random_bits(region.key, 2, key_of(strip, number));
  field.crop = crop_of(core::random_unit(field.key, 3, 0), grows_vines_);
  field.piece_along = along + shift - number * region.pieces_along;
  field.piece_across = across - strip * region.pieces_across;
  return field;
}

FieldPattern::Place FieldPattern::at(const Vector2d& place_world) const {
  const Region region = region_at(place_world);
  const Vector2d from_center = place_world - region.center_world;
  const double along_m = from_center.dot(region.along);
  const double across_m = from_center.dot(Vector2d(-region.along.y(), region.along.x()));
  const double along = std::floor(along_m / kPiece_m);
  const double across = std::floor(across_m / kPiece_m);
  const Field field =
      field_of(region, static_cast<std::int64_t>(along), static_cast<std::int64_t>(across));
  Place place;
  place.key = field.key;
  place.crop = field.crop;
  place.along_m = along_m - kPiece_m * along + kPiece_m * static_cast<double>(field.piece_along);
  place.across_m =
      across_m - kPiece_m * across + kPiece_m * static_cast<double>(field.piece_across);
  const double length_m = kPiece_m * static_cast<double>(region.pieces_along);
  const double width_m = kPiece_m * static_cast<double>(region.pieces_across);
  place.edge_m = std::min({place.along_m, length_m - place.along_m, place.across_m,
                           width_m - place.across_m, region.edge_m});
  return place;
}

}  // namespace terracast::world
