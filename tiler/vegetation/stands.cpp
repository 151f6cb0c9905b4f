#include "tiler/vegetation/stands.h"

#include <cmath>
#include <limits>

#include "core/random.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

/// Mean sides of stands, and of the parts of those that are parted.
constexpr double kStand_m = 170.0;
constexpr double kPart_m = 58.0;
constexpr double kParted = 0.5;

constexpr double kMixed = 0.2;
constexpr double kClearings = 0.035;
constexpr double kDying = 0.05;

/// Of the cell about a random centre that holds a place: the nearest of those of nine squares.
std::uint64_t cell_key(const Vector2d& place, double side_m, std::uint64_t seed) {
  const auto cell_x = static_cast<std::int64_t>(std::floor(place.x() / side_m));
  const auto cell_y = static_cast<std::int64_t>(std::floor(place.y() / side_m));
  double least2 = std::numeric_limits<double>::infinity();
  std::uint64_t nearest = 0;
  for (std::int64_t y = cell_y - 1; y <= cell_y + 1; ++y)
    for (std::int64_t x = cell_x - 1; x <= cell_x + 1; ++x) {
      const std::uint64_t key =
          core::random_bits(seed, static_cast<std::uint64_t>(x), static_cast<std::uint64_t>(y));
      constexpr double kHalfBits = 4294967296.0;
      const Vector2d jitter(static_cast<double>(key & 0xffffffffU) / kHalfBits,
                            static_cast<double>(key >> 32U) / kHalfBits);
      const Vector2d center(side_m * (static_cast<double>(x) + 0.1 + 0.8 * jitter.x()),
                            side_m * (static_cast<double>(y) + 0.1 + 0.8 * jitter.y()));
      const double distance2 = (center - place).squaredNorm();
      if (distance2 >= least2) continue;
      least2 = distance2;
      nearest = key;
    }
  return nearest;
}

}  // namespace

Stands::Stands(std::uint64_t seed)
    : seed_(core::stream_of(seed, 0x7374616e6473ULL)), noise_(seed, 8) {}

Stand Stands::at(const Vector2d& place_world) const {
  const Vector2d at = place_world / 48.0;
  const Vector2d place =
      place_world + 12.0 * Vector2d(fractal_noise(noise_, at.x(), at.y() + 13.7, 2),
                                    fractal_noise(noise_, at.x() + 41.3, at.y(), 2));
  Stand stand;
  stand.key = cell_key(place, kStand_m, core::stream_of(seed_, 1));
  if (core::random_unit(stand.key, 0, 0) < kParted)
    stand.key = core::stream_of(stand.key, cell_key(place, kPart_m, core::stream_of(seed_, 2)));
  const auto drawn = [&](std::uint64_t what) { return core::random_unit(stand.key, 1, what); };
  stand.height = 0.62 + 0.66 * drawn(0);
  stand.density = 0.88 + 0.12 * drawn(1);
  stand.kind = drawn(2);
  stand.variety = drawn(3);
  stand.light = 2.0 * drawn(4) - 1.0;
  stand.warm = 2.0 * drawn(5) - 1.0;
  stand.is_mixed = drawn(6) < kMixed;
  stand.is_clearing = drawn(7) < kClearings;
  stand.is_dying = drawn(8) < kDying;
  return stand;
}

}  // namespace terracast::tiler
