#pragma once

#include <array>
#include <vector>

#include "tiler/vegetation/plan_box.h"
#include "tiler/vegetation/vegetation_plan.h"

namespace terracast::tiler {

/// Where plants of a tile, and those of its neighbours that reach into it, may stand.
class TilePlaces {
 public:
  /// plan   lives as long
  TilePlaces(const VegetationPlan& plan, const world::TileId& id)
      : plan_(plan), id_(id), box_(box_of(id)) {}

  const PlanBox& box() const { return box_; }  ///< the tile's

  /// Boxes in which places of something are to be looked at that is shown on tiles of some levels: the
  /// tile and what reaches into it, or only the latter where the tile's own level shows nothing of it.
  std::vector<PlanBox> boxes(int finest_level, int coarsest_level, double reach_m) const;

  /// Places of a box; those of the tile, or along a side of it, and some metres round them are strewn once.
  std::vector<BlueNoise::Place> places_in(Stratum stratum, const PlanBox& box);

 private:
  struct Strewn {
    PlanBox box;
    std::vector<BlueNoise::Place> places;
  };
  /// The box and what else is asked for in the tile or along the same side.
  PlanBox most_asked_with(const PlanBox& box) const;

  const VegetationPlan& plan_;
  world::TileId id_;
  PlanBox box_;
  std::array<std::vector<Strewn>, kNumStrata> strewn_;
};

}  // namespace terracast::tiler
