#include "tiler/buildings/building_draft.h"

#include <algorithm>
#include <utility>

namespace terracast::tiler {

using Eigen::Vector2d;
using Eigen::Vector2i;

double share_in(const BuildingDraft& one, const BuildingDraft& other) {
  if (one.inside_world.empty()) return 0.0;
  std::size_t num_in = 0;
  for (const Vector2d& place : one.inside_world)
    num_in += contains_world(other.building, place) ? 1 : 0;
  return static_cast<double>(num_in) / static_cast<double>(one.inside_world.size());
}

bool goes_before(const BuildingDraft& one, const BuildingDraft& other) {
  if (one.area_m2 != other.area_m2) return one.area_m2 > other.area_m2;
  return one.building.key < other.building.key;
}

bool comes_before_copies(const BuildingDraft& one, const BuildingDraft& other) {
  const auto less_place = [](const Vector2i& a, const Vector2i& b) {
    return std::pair(a.x(), a.y()) < std::pair(b.x(), b.y());
  };
  const auto less_ring = [&](const std::vector<Vector2i>& a, const std::vector<Vector2i>& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end(), less_place);
  };
  const Building& a = one.building;
  const Building& b = other.building;
  if (a.is_part != b.is_part) return b.is_part;
  if (a.footprint.place_m != b.footprint.place_m)
    return less_place(a.footprint.place_m, b.footprint.place_m);
  if (a.footprint.rings != b.footprint.rings)
    return std::lexicographical_compare(a.footprint.rings.begin(), a.footprint.rings.end(),
                                        b.footprint.rings.begin(), b.footprint.rings.end(),
                                        less_ring);
  if (a.is_part && one.tags->all() != other.tags->all()) return one.tags->all() < other.tags->all();
  return a.key < b.key;
}

bool are_copies(const BuildingDraft& one, const BuildingDraft& other) {
  const Building& a = one.building;
  const Building& b = other.building;
  return a.is_part == b.is_part && a.footprint.place_m == b.footprint.place_m &&
         a.footprint.rings == b.footprint.rings && (!a.is_part || *one.tags == *other.tags);
}

}  // namespace terracast::tiler
