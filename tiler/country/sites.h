#pragma once

#include <vector>

#include "tiler/country/occupancy.h"
#include "tiler/country/plan_ground.h"

namespace terracast::tiler::country {

enum class Rank : std::uint8_t { City, Town, Village, Hamlet };

/// A place where people live.
struct Settlement {
  Rank rank = Rank::Hamlet;
  Point center = Point::Zero();
  double population = 0.0;
  double radius_m = 0.0;
  bool is_coastal = false;
  int palette = 0;  ///< of its houses' colours and roofs
};

/// How a country builds, after its land and its seed.
enum class BuildingManner : std::uint8_t { Southern, Alpine, Northern };

/// Where people live: one city, towns, villages and hamlets on ground that can be built on, at coasts
/// and rivers before elsewhere, apart from each other, their sizes after rank (Zipf's rule).
/// occupancy   has the lakes, in which nobody lives
/// returns     by rank and size
std::vector<Settlement> choose_sites(const PlanGround& ground, const Occupancy& occupancy,
                                     std::uint64_t seed);

/// Share of a square about a place that is dry and flat enough to build on.
class BuildableShare {
 public:
  explicit BuildableShare(const PlanGround& ground, double steepest = 0.14);
  double at(const Point& center, double half_side_m) const;
  /// Of the whole square, km2.
  double total_km2() const { return total_km2_; }

 private:
  const PlanGround& ground_;
  Grid<std::int32_t> sums_;
  double total_km2_ = 0.0;
};

}  // namespace terracast::tiler::country
