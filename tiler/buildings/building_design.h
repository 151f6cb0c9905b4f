#pragma once

#include <cstdint>
#include <optional>

#include "tiler/buildings/roof.h"
#include "tiler/vector_source.h"
#include "world/shape.h"

namespace terracast::tiler {

enum class BuildingKind : std::uint8_t {
  House = 0,
  Apartments,
  Commercial,
  Offices,
  Hall,
  Church,
  Garage,
  Barn,
  Greenhouse,
  Canopy,  ///< a roof on posts
  Tower,
};

/// Where the height of a building comes from.
enum class HeightSource : std::uint8_t { Height = 0, Levels, Raster, Guess };
inline constexpr int kNumHeightSources = 4;

/// What the neighbourhood tells of a building that says nothing of itself.
struct Surroundings {
  double area_m2 = 100.0;
  double width_m = 10.0;  ///< the shorter side of the rectangle round it
  double length_m = 10.0;
  std::size_t num_corners = 4;
  double share_built = 0.1;  ///< of the ground round it that buildings cover
  bool is_attached = false;
  double share_at_sea = 0.0;  ///< of places 30 m outside its walls; where it is just a building
  double latitude_deg = 45.0;
  double height_m = 100.0;  ///< of the ground, ellipsoidal
};

/// What stands on a footprint. Heights along up, above the lowest ground under it.
struct BuildingDesign {
  BuildingKind kind = BuildingKind::House;
  HeightSource height_source = HeightSource::Guess;
  bool was_clamped = false;  ///< it said an absurd height
  double top_m = 6.0;        ///< of all, with its roof
  double bottom_m = 0.0;     ///< above 0: parts that begin above the ground
  double footing_m =
      0.0;  ///< by which a bottom above the ground is deeper: to a roof that carries it
  double storey_m = 3.0;
  RoofShape roof = RoofShape::Flat;
  bool states_roof = false;    ///< its tags say which shape it has
  double roof_height_m = 0.0;  ///< 0: as steep as the slope says
  double roof_slope = 0.6;
  std::optional<double> roof_direction_deg;  ///< clockwise from north: where a roof falls to
  bool ridge_across = false;
  world::Finish wall;
  world::Finish roofing;
  world::Finish trim;  ///< eaves, chimneys, plant
};

/// Designs a building by its tags, and by its surroundings and numbers drawn where they say
/// nothing.
/// raster_m   height above the ground that a raster knows
/// town       drawn for the neighbourhood, so that its houses go together
/// own        drawn for the building
BuildingDesign design_building(const FeatureTags& tags, bool is_part, const Surroundings& around,
                               std::optional<double> raster_m, std::uint64_t town,
                               std::uint64_t own);

}  // namespace terracast::tiler
