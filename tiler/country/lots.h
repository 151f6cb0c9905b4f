#pragma once

#include <memory>
#include <vector>

#include "tiler/country/blocks.h"
#include "tiler/country/building_styles.h"
#include "tiler/country/town_streets.h"

namespace terracast::tiler::country {

/// Puts buildings on free, dry, gentle ground.
class Builder {
 public:
  Builder(const PlanGround& ground, Occupancy& occupancy, Survey& survey, BuildingManner manner,
          std::uint64_t seed)
      : ground_(ground), occupancy_(occupancy), survey_(survey), manner_(manner), seed_(seed) {}

  /// margin_m   to all that is there
  /// returns    whether it could be built
  bool build(const PointsWorld& footprint, HouseKind kind, int palette, double width_m,
             double margin_m, Tags more = {});
  /// An area that is kept free of buildings, where nothing is yet.
  bool reserve(const PointsWorld& ring, double margin_m, Theme theme, Tags tags,
               double steepest = 0.12);
  /// The nearest free rectangle to a place, along a direction or across it.
  std::optional<Rectangle> find_spot(const Point& near, const Point& along, double length_m,
                                     double depth_m, double farthest_m, double margin_m) const;

  const PlanGround& ground() const { return ground_; }
  Occupancy& occupancy() { return occupancy_; }
  Survey& survey() { return survey_; }
  BuildingManner manner() const { return manner_; }
  std::uint64_t draw() { return core_draw(++draws_); }
  std::int64_t num_buildings() const { return num_buildings_; }

 private:
  std::uint64_t core_draw(std::uint64_t count) const;
  const PlanGround& ground_;
  Occupancy& occupancy_;
  Survey& survey_;
  BuildingManner manner_;
  std::uint64_t seed_;
  std::uint64_t draws_ = 0;
  std::int64_t num_buildings_ = 0;
};

/// Fills the blocks and the road sides of settlements: churches, schools, parks and the like first, then
/// perimeter blocks with courtyards in the middle, slabs and halls, houses with gardens along the rest.
void build_settlements(Builder& builder, const std::vector<TownShape>& shapes,
                       const std::vector<Block>& blocks, std::uint64_t seed);

}  // namespace terracast::tiler::country
