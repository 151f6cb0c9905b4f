#include "tiler/buildings/settled_ground.h"

#include <algorithm>
#include <cmath>

#include "tiler/void_filling.h"

namespace terracast::tiler {
namespace {

constexpr double kCell_m = 32.0;
/// Cells to each side of one whose buildings count.
constexpr int kAround = 3;
constexpr double kGardens_m = 80.0;  ///< the period of their noise
constexpr double kWindow_m2 = (2 * kAround + 1) * kCell_m * (2 * kAround + 1) * kCell_m;

/// Sums over 2 kAround + 1 entries in a row; beyond the ends lies nothing.
void add_neighbours(std::vector<std::uint32_t>& values, std::size_t first, std::size_t stride,
                    int count, std::vector<std::uint32_t>& row) {
  row.resize(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i)
    row[static_cast<std::size_t>(i)] = values[first + static_cast<std::size_t>(i) * stride];
  std::uint32_t sum = 0;
  for (int i = 0; i < std::min(kAround, count); ++i) sum += row[static_cast<std::size_t>(i)];
  for (int i = 0; i < count; ++i) {
    if (i + kAround < count) sum += row[static_cast<std::size_t>(i + kAround)];
    if (i > kAround) sum -= row[static_cast<std::size_t>(i - kAround - 1)];
    values[first + static_cast<std::size_t>(i) * stride] = sum;
  }
}

}  // namespace

SettledGround::SettledGround(std::span<const Building> buildings, double size_m,
                             const std::function<bool(const Eigen::Vector2d& place_world)>& is_sea,
                             std::uint64_t seed)
    : half_size_m_(0.5 * size_m),
      side_(static_cast<int>(std::ceil(size_m / kCell_m))),
      gardens_(seed, 0x67617264ULL) {
  if (buildings.empty()) return;
  const auto side = static_cast<std::size_t>(side_);
  area_m2_.assign(side * side, 0);
  for (const Building& building : buildings) {
    const Eigen::Vector2d cell =
        (building.footprint.place_m.cast<double>().array() + half_size_m_) / kCell_m;
    const auto at = [&](double value) {
      return static_cast<std::size_t>(
          std::clamp(static_cast<int>(std::floor(value)), 0, side_ - 1));
    };
    // Whole square metres, so that sums do not depend on the order.
    area_m2_[at(cell.y()) * side + at(cell.x())] +=
        static_cast<std::uint32_t>(std::lround(area_m2(building.footprint.rings)));
  }
  std::vector<std::uint32_t> row;
  for (std::size_t j = 0; j < side; ++j) add_neighbours(area_m2_, j * side, 1, side_, row);
  for (std::size_t i = 0; i < side; ++i) add_neighbours(area_m2_, i, side, side_, row);
  if (is_sea) measure_towns(is_sea);
}

void SettledGround::measure_towns(
    const std::function<bool(const Eigen::Vector2d& place_world)>& is_sea) {
  Grid<std::uint8_t> is_other(side_, side_, 1);
  for (std::size_t cell = 0; cell < area_m2_.size(); ++cell)
    is_other.values[cell] = area_m2_[cell] < kBuiltUp * kWindow_m2 ? 1 : 0;
  const auto has_others = [](const Grid<std::uint8_t>& members) {
    return std::find(members.values.begin(), members.values.end(), 0) != members.values.end();
  };
  if (!has_others(is_other)) return;
  built_up_m_ = distance_to_others(is_other, {kCell_m, kCell_m});
  // Farther out no place asks for the sea, nor do those that are linear between cells.
  constexpr double kAsked_m = kHarbourOfTown_m + kQuay_m + 3.0 * kCell_m;
  Grid<std::uint8_t> is_land(side_, side_, 1);
  for (int j = 0; j < side_; ++j)
    for (int i = 0; i < side_; ++i) {
      if (double{built_up_m_(i, j)} > kAsked_m) continue;
      const Eigen::Vector2d middle =
          kCell_m * Eigen::Vector2d(i + 0.5, j + 0.5).array() - half_size_m_;
      is_land(i, j) = is_sea(middle) ? 0 : 1;
    }
  if (has_others(is_land)) sea_m_ = distance_to_others(is_land, {kCell_m, kCell_m});
}

Eigen::Vector2d SettledGround::cell_of(const Eigen::Vector2d& place_world) const {
  return (place_world.array() + half_size_m_) / kCell_m - 0.5;
}

std::optional<world::Cover> SettledGround::open_cover(const Eigen::Vector2d& place_world) const {
  if (built_up_m_.values.empty()) return std::nullopt;
  const Eigen::Vector2d at = cell_of(place_world);
  const double built_up_m = bilinear(built_up_m_, at);
  const bool is_shore = !sea_m_.values.empty() && bilinear(sea_m_, at) <= kQuay_m;
  if (is_shore && built_up_m <= kHarbourOfTown_m) return world::Cover::BuiltUp;
  if (built_up_m > kOpenInTown_m) return std::nullopt;
  const Eigen::Vector2d in_period = place_world / kGardens_m;
  return fractal_noise(gardens_, in_period.x(), in_period.y(), 3) > 0.0 ? world::Cover::Shrubs
                                                                        : world::Cover::BuiltUp;
}

double SettledGround::share(const Eigen::Vector2d& place_world) const {
  if (area_m2_.empty()) return 0.0;
  const Eigen::Vector2d at = cell_of(place_world);
  const double i = std::floor(at.x());
  const double j = std::floor(at.y());
  const auto value = [&](double column, double line) {
    if (column < 0.0 || line < 0.0 || column >= side_ || line >= side_) return 0.0;
    return static_cast<double>(
        area_m2_[static_cast<std::size_t>(line) * static_cast<std::size_t>(side_) +
                 static_cast<std::size_t>(column)]);
  };
  const double tx = at.x() - i;
  const double ty = at.y() - j;
  const double south = value(i, j) + tx * (value(i + 1.0, j) - value(i, j));
  const double north = value(i, j + 1.0) + tx * (value(i + 1.0, j + 1.0) - value(i, j + 1.0));
  return (south + ty * (north - south)) / kWindow_m2;
}

std::optional<world::Cover> SettledGround::cover(const Eigen::Vector2d& place_world) const {
  const double covered = share(place_world);
  if (covered >= kBuiltUp) return world::Cover::BuiltUp;
  if (const auto open = open_cover(place_world)) return open;
  if (covered < kSettled) return std::nullopt;
  return world::Cover::Grass;
}

}  // namespace terracast::tiler
