#include "world/field_pattern.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>

#include "core/random.h"
#include "world/tile.h"

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

/// One of the spans into which pieces are parted: each begins up to a quarter of the mean before or after
/// where spans of equal length would.
struct Span {
  std::int64_t number;
  std::int64_t first;
  std::int64_t count;
};
Span span_of(std::int64_t piece, std::int64_t mean, std::uint64_t key) {
  const std::int64_t most = mean / 4;
  const auto begin = [&](std::int64_t number) {
    const std::uint64_t drawn = core::random_bits(key, 4, static_cast<std::uint64_t>(number));
    return number * mean - most +
           static_cast<std::int64_t>(drawn % static_cast<std::uint64_t>(2 * most + 1));
  };
  std::int64_t number = floor_divided(piece, mean);
  std::int64_t first = begin(number);
  std::int64_t next = begin(number + 1);
  if (piece < first) {
    next = first;
    first = begin(--number);
  } else if (piece >= next) {
    first = next;
    next = begin(++number + 1);
  }
  return {number, first, next - first};
}

/// Of the field that holds a piece of a region.
struct Bounds {
  std::uint64_t key;
  Span along;
  Span across;  ///< of its strip
};
Bounds bounds_of(const FieldPattern::Region& region, std::int64_t along, std::int64_t across) {
  const Span strip = span_of(across, region.pieces_across, region.key);
  // Strips of fields are shifted against each other.
  const std::uint64_t key =
      core::random_bits(region.key, 1, static_cast<std::uint64_t>(strip.number));
  const auto shift =
      static_cast<std::int64_t>(key % static_cast<std::uint64_t>(region.pieces_along));
  Span length = span_of(along + shift, region.pieces_along, key);
  length.first -= shift;
  return {core::random_bits(region.key, 2, key_of(strip.number, length.number)), length, strip};
}

/// Two random numbers at each whole place, -1 … 1, and smooth between: the slopes are 0 at whole places.
Vector2d smooth_draws(std::uint64_t key, const Vector2d& at) {
  const Vector2d first = at.array().floor();
  const auto x = static_cast<std::int64_t>(first.x());
  const auto y = static_cast<std::int64_t>(first.y());
  const auto drawn = [&](std::int64_t column, std::int64_t row) -> Vector2d {
    const std::uint64_t bits =
        core::random_bits(key, static_cast<std::uint64_t>(column), static_cast<std::uint64_t>(row));
    return 0x1.0p-31 * Vector2d(static_cast<std::int32_t>(static_cast<std::uint32_t>(bits)),
                                static_cast<std::int32_t>(static_cast<std::uint32_t>(bits >> 32)));
  };
  const auto fade = [](double t) { return t * t * (3.0 - 2.0 * t); };
  const double u = fade(at.x() - first.x());
  const double v = fade(at.y() - first.y());
  return (1.0 - v) * ((1.0 - u) * drawn(x, y) + u * drawn(x + 1, y)) +
         v * ((1.0 - u) * drawn(x, y + 1) + u * drawn(x + 1, y + 1));
}

/// How far the borders of meadows stray along either axis, and over what distance they do: most in long bends,
/// some in short ones.
struct Bend {
  double period_m;
  double most_m;
};
constexpr Bend kBends[] = {{170.0, 13.0}, {52.0, 3.5}};
static_assert(std::numbers::sqrt2 * (kBends[0].most_m + kBends[1].most_m) <
              FieldPattern::kMostBent_m);

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
  std::array<Vector2d, 9> centers;
  std::array<double, 9> distances2;
  Region nearest;
  std::size_t first = 0;
  std::size_t count = 0;
  for (std::int64_t y = cell_y - 1; y <= cell_y + 1; ++y)
    for (std::int64_t x = cell_x - 1; x <= cell_x + 1; ++x, ++count) {
      const std::uint64_t key = core::random_bits(seed_, 0x726567696f6eULL, key_of(x, y));
      centers[count] = {
          kRegion_m * (static_cast<double>(x) + core::random_between(0.2, 0.8, key, 0, 0)),
          kRegion_m * (static_cast<double>(y) + core::random_between(0.2, 0.8, key, 0, 1))};
      distances2[count] = (centers[count] - place_world).squaredNorm();
      if (count > 0 && distances2[count] >= distances2[first]) continue;
      first = count;
      nearest.key = key;
    }
  nearest.center_world = centers[first];
  // On the line half-way between two centres a place is as far from both. The nearest such line need not be
  // that of the second centre.
  double edge2 = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < count; ++k) {
    if (k == first) continue;
    const double more = distances2[k] - distances2[first];
    edge2 = std::min(edge2, more * more / (centers[k] - nearest.center_world).squaredNorm());
  }
  nearest.edge_m = 0.5 * std::sqrt(edge2);
  nearest.heading_rad = core::random_between(0.0, std::numbers::pi, nearest.key, 0, 2);
  nearest.along = {std::cos(nearest.heading_rad), std::sin(nearest.heading_rad)};
  nearest.pieces_along = 26 + static_cast<std::int64_t>((nearest.key >> 8) % 38);
  nearest.pieces_across = 9 + static_cast<std::int64_t>((nearest.key >> 16) % 15);
  return nearest;
}

FieldPattern::Field FieldPattern::field_of(const Region& region, std::int64_t along,
                                           std::int64_t across) const {
  const Bounds bounds = bounds_of(region, along, across);
  return {.key = bounds.key,
          .crop = crop_of(core::random_unit(bounds.key, 3, 0), grows_vines_),
          .piece_along = along - bounds.along.first,
          .piece_across = across - bounds.across.first};
}

Vector2d FieldPattern::bent(const Vector2d& place_world) const {
  Vector2d place = place_world;
  for (std::uint64_t k = 0; k < std::size(kBends); ++k)
    place += kBends[k].most_m *
             smooth_draws(core::stream_of(seed_, 5 + k), place_world / kBends[k].period_m);
  return place;
}

FieldPattern::Place FieldPattern::at(const Vector2d& place_world, Cover cover) const {
  return at(cover == Cover::Grass ? bent(place_world) : place_world);
}

FieldPattern::Place FieldPattern::at(const Vector2d& place_world) const {
  const Region region = region_at(place_world);
  const Vector2d from_center = place_world - region.center_world;
  const double along_m = from_center.dot(region.along);
  const double across_m = from_center.dot(Vector2d(-region.along.y(), region.along.x()));
  const Bounds bounds = bounds_of(region, static_cast<std::int64_t>(std::floor(along_m / kPiece_m)),
                                  static_cast<std::int64_t>(std::floor(across_m / kPiece_m)));
  Place place;
  place.key = bounds.key;
  place.crop = crop_of(core::random_unit(bounds.key, 3, 0), grows_vines_);
  place.along_m = along_m - kPiece_m * static_cast<double>(bounds.along.first);
  place.across_m = across_m - kPiece_m * static_cast<double>(bounds.across.first);
  const double length_m = kPiece_m * static_cast<double>(bounds.along.count);
  const double width_m = kPiece_m * static_cast<double>(bounds.across.count);
  place.edge_m = std::min({place.along_m, length_m - place.along_m, place.across_m,
                           width_m - place.across_m, region.edge_m});
  return place;
}

}  // namespace terracast::world
