#include "tiler/buildings/settled_ground.h"

#include <algorithm>
#include <cmath>

namespace terracast::tiler {
namespace {

constexpr double kCell_m = 32.0;
/// Cells to each side of one whose buildings count.
constexpr int kAround = 3;
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

SettledGround::SettledGround(std::span<const Building> buildings, double size_m)
    : half_size_m_(0.5 * size_m), side_(static_cast<int>(std::ceil(size_m / kCell_m))) {
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
}

double SettledGround::share(const Eigen::Vector2d& place_world) const {
  if (area_m2_.empty()) return 0.0;
  const Eigen::Vector2d at = (place_world.array() + half_size_m_) / kCell_m - 0.5;
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
  if (covered < kSettled) return std::nullopt;
  return covered < kBuiltUp ? world::Cover::Grass : world::Cover::BuiltUp;
}

}  // namespace terracast::tiler
