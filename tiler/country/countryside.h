#pragma once

#include <vector>

#include "tiler/country/lots.h"

namespace terracast::tiler::country {

/// A farm's yard, or a hut in the woods, at the end of its track.
struct FarmSite {
  Point at = Point::Zero();
  Point along = Point::UnitX();
  Point track_end = Point::Zero();  ///< snapped
  bool is_hut = false;
};

/// Yards off rural roads, with a track to each, and tracks into the woods.
std::vector<FarmSite> plan_farms(const PlanGround& ground, const std::vector<TownShape>& shapes,
                                 const Occupancy& occupancy, std::vector<Way>& ways,
                                 std::uint64_t seed);
/// Leaves out those whose track was cut or left out.
void drop_without_track(const std::vector<Way>& ways, std::vector<FarmSite>& farms);
void build_farms(const std::vector<FarmSite>& farms, Builder& builder);

/// Fields, meadows, orchards and vineyards on what gentle land is left near settlements; each
/// lot is cut in two until it lies clear of all that is there.
void lay_fields(const std::vector<Settlement>& settlements, Builder& builder, std::uint64_t seed);

}  // namespace terracast::tiler::country
