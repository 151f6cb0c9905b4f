#include "tiler/vegetation/groves.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "tiler/vegetation/patch_noise.h"

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

/// Groups have their middles in squares of this side, at most one in each, and reach less than 1.15 sides from it:
/// what matters to a place lies in the nine squares round it.
constexpr double kCell_m = 260.0;
/// Shares of the squares with a copse: in open country, what full country has more, and slopes.
constexpr double kCopses = 0.02;
constexpr double kMoreCopses = 0.40;
constexpr double kSlopeCopses = 0.35;
/// The same of loose groups.
constexpr double kLoose = 0.02;
constexpr double kMoreLoose = 0.14;

/// Rows are so wide to either side.
constexpr double kHalfRow_m = 2.2;

}  // namespace

Groves::Groves(std::uint64_t seed, const world::FieldPattern& fields)
    : seed_(core::stream_of(seed, 0x67726f766573ULL)), fields_(fields), noise_(seed, 9) {}

double Groves::fullness(const Vector2d& place_world) const {
  return step_up(patches(noise_, place_world, 1100.0, 0), 0.40, 0.62);
}

Grove Groves::groups(const Vector2d& place_world, double slope) const {
  const double full = fullness(place_world);
  const double steep = step_up(slope, 0.2, 0.6);
  const double copses = kCopses + kMoreCopses * full + kSlopeCopses * steep;
  const double loose = kLoose + kMoreLoose * full;
  const auto cell_x = static_cast<std::int64_t>(std::floor(place_world.x() / kCell_m));
  const auto cell_y = static_cast<std::int64_t>(std::floor(place_world.y() / kCell_m));
  Grove grove;
  for (std::int64_t y = cell_y - 1; y <= cell_y + 1; ++y)
    for (std::int64_t x = cell_x - 1; x <= cell_x + 1; ++x) {
      const std::uint64_t key =
          core::random_bits(seed_, static_cast<std::uint64_t>(x), static_cast<std::uint64_t>(y));
      const auto drawn = [&](std::uint64_t what) { return core::random_unit(key, 0, what); };
      const double kind = drawn(0);
      if (kind >= copses + loose) continue;
      const bool is_copse = kind < copses;
      const Vector2d center(kCell_m * (static_cast<double>(x) + 0.15 + 0.7 * drawn(1)),
                            kCell_m * (static_cast<double>(y) + 0.15 + 0.7 * drawn(2)));
      // Small ones are the more frequent; long ones lie any way.
      const double size = drawn(3) * drawn(4);
      const double radius_m = is_copse ? 11.0 + 44.0 * size : 40.0 + 70.0 * size;
      const double turn_rad = 3.2 * drawn(5);
      const Vector2d along(std::cos(turn_rad), std::sin(turn_rad));
      const double stretch = 1.0 + (is_copse ? 1.2 : 0.3) * drawn(6);
      const Vector2d from = place_world - center;
      const double out_m = std::hypot(from.dot(along) / stretch,
                                      from.dot(Vector2d(-along.y(), along.x())) * stretch);
      // Its border is wavy.
      const double wave = fractal_noise(noise_, place_world.x() / 26.0, place_world.y() / 26.0, 2);
      const double out = out_m / (radius_m * (1.0 + 0.55 * wave));
      if (is_copse) {
        grove.trees = std::max(grove.trees, 0.75 * (1.0 - step_up(out, 0.85, 1.0)));
        const double rim = step_up(out, 0.6, 0.9) * (1.0 - step_up(out, 1.0, 1.25));
        grove.bushes = std::max(grove.bushes, 0.12 * (1.0 - step_up(out, 0.9, 1.0)) + 0.5 * rim);
      } else {
        const double within = 1.0 - step_up(out, 0.6, 1.0);
        grove.trees = std::max(grove.trees, 0.07 * within);
        grove.bushes = std::max(grove.bushes, 0.04 * within);
      }
    }
  return grove;
}

Grove Groves::along_fields(const Vector2d& place_world, world::Cover cover) const {
  if (fields_.at(place_world, cover).edge_m > kHalfRow_m) return {};
  const double share =
      fullness(place_world) * step_up(patches(noise_, place_world, 240.0, 1), 0.60, 0.63);
  // In other regions, too, there are hedges, which hardly have gaps.
  const double hedge = step_up(patches(noise_, place_world, 1300.0, 6), 0.50, 0.56) *
                       step_up(patches(noise_, place_world, 280.0, 7), 0.58, 0.60);
  if (share + hedge <= 0.0) return {};
  // Some rows are of trees, others hedges.
  const double tall = patches(noise_, place_world, 180.0, 2);
  return {share * (0.06 + 0.6 * step_up(tall, 0.45, 0.6)),
          std::max(share * (0.75 - 0.4 * step_up(tall, 0.5, 0.7)), hedge)};
}

Grove Groves::along_ways(const Vector2d& place_world) const {
  const double stretch = step_up(patches(noise_, place_world, 300.0, 3), 0.60, 0.62);
  const double bushy = step_up(patches(noise_, place_world, 120.0, 4), 0.58, 0.62);
  return {0.45 * stretch, 0.4 * bushy};
}

Grove Groves::along_waters(const Vector2d& place_world) const {
  const double stretch = step_up(patches(noise_, place_world, 200.0, 5), 0.47, 0.55);
  return {0.4 * stretch, 0.55 * stretch};
}

double Groves::lone_trees(const Vector2d& place_world) const {
  return 0.0012 * fullness(place_world);
}

}  // namespace terracast::tiler
