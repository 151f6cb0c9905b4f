#include "tiler/objects/footprints.h"

#include <algorithm>
#include <cmath>

namespace terracast::tiler {
namespace {

using Eigen::Vector2d;

constexpr double kCell_m = 32.0;

std::int32_t cell(double at_m) { return static_cast<std::int32_t>(std::floor(at_m / kCell_m)); }
std::uint64_t key(std::int32_t x, std::int32_t y) {
  return static_cast<std::uint64_t>(static_cast<std::uint32_t>(y)) << 32U |
         static_cast<std::uint32_t>(x);
}

Vector2d left_of(const Vector2d& along) { return {-along.y(), along.x()}; }

/// Whether an axis of one lies between both.
bool is_apart(const GroundRectangle& a, const GroundRectangle& b) {
  const Vector2d between = b.middle - a.middle;
  for (const Vector2d& axis : {a.along, left_of(a.along)}) {
    const double reach_a = axis == a.along ? a.half_length_m : a.half_width_m;
    const double reach_b = std::abs(axis.dot(b.along)) * b.half_length_m +
                           std::abs(axis.dot(left_of(b.along))) * b.half_width_m;
    if (std::abs(between.dot(axis)) >= reach_a + reach_b) return true;
  }
  return false;
}

}  // namespace

double GroundRectangle::distance_m(const Vector2d& place) const {
  const Vector2d offset = place - middle;
  const double x = std::max(std::abs(offset.dot(along)) - half_length_m, 0.0);
  const double y = std::max(std::abs(offset.dot(left_of(along))) - half_width_m, 0.0);
  return std::hypot(x, y);
}

bool GroundRectangle::overlaps(const GroundRectangle& other) const {
  return !is_apart(*this, other) && !is_apart(other, *this);
}

double GroundRectangle::reach_m() const { return std::hypot(half_length_m, half_width_m); }

void FootprintIndex::add(const GroundRectangle& footprint) {
  const auto number = static_cast<std::uint32_t>(footprints_.size());
  footprints_.push_back(footprint);
  const double reach_m = footprint.reach_m();
  for (std::int32_t y = cell(footprint.middle.y() - reach_m);
       y <= cell(footprint.middle.y() + reach_m); ++y)
    for (std::int32_t x = cell(footprint.middle.x() - reach_m);
         x <= cell(footprint.middle.x() + reach_m); ++x)
      cells_[key(x, y)].push_back(number);
}

template <class Visit>
bool FootprintIndex::any_near(const Vector2d& middle, double reach_m, const Visit& visit) const {
  for (std::int32_t y = cell(middle.y() - reach_m); y <= cell(middle.y() + reach_m); ++y)
    for (std::int32_t x = cell(middle.x() - reach_m); x <= cell(middle.x() + reach_m); ++x) {
      const auto found = cells_.find(key(x, y));
      if (found == cells_.end()) continue;
      for (const std::uint32_t number : found->second)
        if (visit(footprints_[number])) return true;
    }
  return false;
}

bool FootprintIndex::overlaps(const GroundRectangle& footprint) const {
  return any_near(footprint.middle, footprint.reach_m(),
                  [&](const GroundRectangle& other) { return footprint.overlaps(other); });
}

bool FootprintIndex::holds(const Vector2d& place, double radius_m) const {
  return any_near(place, radius_m, [&](const GroundRectangle& other) {
    return other.distance_m(place) <= radius_m;
  });
}

}  // namespace terracast::tiler
