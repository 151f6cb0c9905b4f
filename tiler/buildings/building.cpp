#include "tiler/buildings/building.h"

#include "world/tile.h"

namespace terracast::tiler {

using Eigen::Vector2d;
using world::kHeightStep_m;

bool contains_world(const Building& building, const Vector2d& place_world) {
  if ((place_world.array() < building.lowest_world.array()).any() ||
      (place_world.array() > building.highest_world.array()).any())
    return false;
  return contains(building.footprint.rings,
                  (place_world - building.footprint.place_m.cast<double>()) / kHeightStep_m);
}

std::vector<Vector2d> places_within(const Building& building) {
  constexpr int kAcross = 9;
  std::vector<Vector2d> places;
  const Vector2d size = building.highest_world - building.lowest_world;
  for (int fine = 1; fine <= 4 && places.size() < 12; fine *= 2) {
    places.clear();
    for (int j = 0; j < kAcross * fine; ++j)
      for (int i = 0; i < kAcross * fine; ++i) {
        const Vector2d share = Vector2d(i + 0.5, j + 0.5) / (kAcross * fine);
        const Vector2d at = building.lowest_world + share.cwiseProduct(size);
        if (contains_world(building, at)) places.push_back(at);
      }
  }
  return places;
}

}  // namespace terracast::tiler
