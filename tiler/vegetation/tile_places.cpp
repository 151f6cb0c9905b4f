#include "tiler/vegetation/tile_places.h"

#include <algorithm>

#include "core/error.h"

namespace terracast::tiler {

std::vector<PlanBox> TilePlaces::boxes(int finest_level, int coarsest_level, double reach_m) const {
  const PlanBox outer = box_.grown(reach_m);
  if (id_.level >= finest_level && id_.level <= coarsest_level) return {outer};
  const int apart = std::max(finest_level - id_.level, id_.level - coarsest_level);
  if (apart > kLevelsAtCorner) return {};
  if (apart == kLevelsAtCorner) {
    std::vector<PlanBox> corners;
    for (const bool is_north : {false, true})
      for (const bool is_east : {false, true})
        corners.push_back({{is_east ? box_.highest.x() : outer.lowest.x(),
                            is_north ? box_.highest.y() : outer.lowest.y()},
                           {is_east ? outer.highest.x() : box_.lowest.x(),
                            is_north ? outer.highest.y() : box_.lowest.y()}});
    return corners;
  }
  return {{outer.lowest, {outer.highest.x(), box_.lowest.y()}},
          {{outer.lowest.x(), box_.highest.y()}, outer.highest},
          {{outer.lowest.x(), box_.lowest.y()}, {box_.lowest.x(), box_.highest.y()}},
          {{box_.highest.x(), box_.lowest.y()}, {outer.highest.x(), box_.highest.y()}}};
}

std::vector<BlueNoise::Place> TilePlaces::places_in(Stratum stratum, const PlanBox& box) {
  const double half_m = plan_.half_size_m;
  const auto in_square = [&](const PlanBox& all) {
    return PlanBox{all.lowest.cwiseMax(-half_m), all.highest.cwiseMin(half_m)};
  };
  std::vector<Strewn>& known = strewn_[stratum];
  auto found = std::find_if(known.begin(), known.end(),
                            [&](const Strewn& strewn) { return strewn.box.encloses(box); });
  if (found == known.end()) {
    const PlanBox most = most_asked_with(box);
    TERRACAST_CHECK(most.encloses(box), "tile {}", id_.name());
    const PlanBox part = in_square(most);
    found = known.insert(known.end(),
                         {most, plan_.strewn[stratum].places_in(part.lowest, part.highest)});
  }
  std::vector<BlueNoise::Place> places;
  for (const BlueNoise::Place& place : found->places)
    if (contains(box, place.at_world)) places.push_back(place);
  return places;
}

PlanBox TilePlaces::most_asked_with(const PlanBox& box) const {
  constexpr double kOutward_m = kStrata[kTallTrees].reach_m + 2.0 * kTreeDistance_m;
  constexpr double kInward_m = 2.0 * kTreeDistance_m;
  const auto goes_along = [&](int axis) {
    return box.lowest[axis] <= box_.lowest[axis] && box.highest[axis] >= box_.highest[axis];
  };
  PlanBox most = box_.grown(kOutward_m);
  if (!goes_along(0) && !goes_along(1)) return box;
  for (const int axis : {0, 1}) {
    if (goes_along(axis)) continue;
    if (box.lowest[axis] < box_.lowest[axis])
      most.highest[axis] = box_.lowest[axis] + kInward_m;
    else
      most.lowest[axis] = box_.highest[axis] - kInward_m;
  }
  return most;
}

}  // namespace terracast::tiler
