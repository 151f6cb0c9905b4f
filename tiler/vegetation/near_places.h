#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "tiler/grid.h"
#include "tiler/vegetation/plan_box.h"

namespace terracast::tiler {

/// Places of a box by square cells, for asking what is near.
class NearPlaces {
 public:
  /// box   holds all places that are added
  NearPlaces(double cell_m, const PlanBox& box);

  void add(const Eigen::Vector2d& at_world);
  /// distance_m   at most cell_m
  bool has_within(const Eigen::Vector2d& at_world, double distance_m) const;

 private:
  static constexpr std::int32_t kNone = -1;
  struct Place {
    Eigen::Vector2d at_world;
    std::int32_t before;  ///< another of the same cell
  };
  int cell(double from_lowest_m) const;

  double cell_m_;
  Eigen::Vector2d lowest_;
  Grid<std::int32_t> last_;  ///< of each cell, in places_
  std::vector<Place> places_;
};

}  // namespace terracast::tiler
