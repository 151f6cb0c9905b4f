#include "tiler/vegetation/near_places.h"

#include <algorithm>
#include <cmath>

namespace terracast::tiler {

using Eigen::Vector2d;

NearPlaces::NearPlaces(double cell_m, const PlanBox& box)
    : cell_m_(cell_m),
      lowest_(box.lowest),
      last_(cell(box.highest.x() - lowest_.x()) + 1, cell(box.highest.y() - lowest_.y()) + 1,
            kNone) {}

void NearPlaces::add(const Vector2d& at_world) {
  std::int32_t& last = last_(cell(at_world.x() - lowest_.x()), cell(at_world.y() - lowest_.y()));
  places_.push_back({at_world, last});
  last = static_cast<std::int32_t>(places_.size() - 1);
}

bool NearPlaces::has_within(const Vector2d& at_world, double distance_m) const {
  const int x = cell(at_world.x() - lowest_.x());
  const int y = cell(at_world.y() - lowest_.y());
  for (int j = std::max(y - 1, 0); j <= std::min(y + 1, last_.height - 1); ++j)
    for (int i = std::max(x - 1, 0); i <= std::min(x + 1, last_.width - 1); ++i)
      for (std::int32_t k = last_(i, j); k != kNone;
           k = places_[static_cast<std::size_t>(k)].before)
        if ((places_[static_cast<std::size_t>(k)].at_world - at_world).squaredNorm() <
            distance_m * distance_m)
          return true;
  return false;
}

int NearPlaces::cell(double from_lowest_m) const {
  return static_cast<int>(std::floor(from_lowest_m / cell_m_));
}

}  // namespace terracast::tiler
