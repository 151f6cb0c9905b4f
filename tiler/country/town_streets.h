#pragma once

#include <vector>

#include "tiler/country/sites.h"
#include "tiler/country/ways.h"
#include "tiler/gradient_noise.h"

namespace terracast::tiler::country {

/// How built-up a place of a settlement is: 0 at its middle, 1 at its rim, which follows the ground.
class TownShape {
 public:
  TownShape(const Settlement& settlement, const PlanGround& ground, std::uint64_t seed);
  double at(const Point& place) const;
  const Settlement& settlement() const { return settlement_; }

 private:
  const Settlement& settlement_;
  const PlanGround& ground_;
  GradientNoise rim_;
};

/// Streets of all settlements: lines along and across a field of directions (after Chen et al. 2008) that
/// follows the roads that are there, the rings and rays of the old middle, and slopes.
class StreetGrowth {
 public:
  /// roads       that are there, which streets meet
  /// obstacles   what streets keep clear of
  StreetGrowth(const PlanGround& ground, const std::vector<Way>& roads, const Occupancy& obstacles);

  /// Streets of a settlement.
  std::vector<Way> grow(const TownShape& shape, std::uint64_t seed);

 private:
  struct Sample {
    Point at;
    Point along;
    std::int32_t family;  ///< 0, 1: along or across the field; 2: roads, of both
    std::int32_t line;
  };
  struct Trace {
    PointsWorld line;
    bool is_joined_start = false;
    bool is_joined_end = false;
  };
  Point direction(const TownShape& shape, const Point& at, int family) const;
  double separation_m(const TownShape& shape, const Point& at, int family) const;
  bool is_open(const TownShape& shape, const Point& at) const;
  /// Distance to the nearest street that runs along the same way; lines of own number do not count.
  double nearest_m(const Point& at, const Point& along, double reach_m, std::int32_t own) const;
  void trace(const TownShape& shape, Point at, int family, double sign, PointsWorld& line) const;
  void add_samples(const PointsWorld& line, int family);
  void add_piece(const Point& from, const Point& to, std::int32_t line);
  /// Extends a line's end to the next street, or cuts it back to its last crossing.
  void settle_end(PointsWorld& line, double reach_m, std::int32_t own);

  const PlanGround& ground_;
  const Occupancy& obstacles_;
  std::vector<Sample> samples_;
  PlaceIndex sample_index_;
  struct Piece {
    Point from, to;
    std::int32_t line;
  };
  std::vector<Piece> pieces_;
  PlaceIndex piece_index_;
  std::int32_t num_lines_ = 0;
  Point main_ = Point::UnitX();  ///< of the settlement that grows
  std::uint64_t seed_ = 0;
  const GradientNoise* bend_ = nullptr;
  mutable std::vector<std::int32_t> found_;
};

}  // namespace terracast::tiler::country
