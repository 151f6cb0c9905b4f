#pragma once

#include <vector>

#include "tiler/country/plan_geometry.h"

namespace terracast::tiler::country {

/// What takes up ground; sets of them are sums.
enum Use : unsigned {
  kRoad = 1,
  kRail = 2,
  kWater = 4,
  kBuilding = 8,
  kReserved = 16,  ///< airports, harbours, parks: kept for themselves
  kPower = 32,
  kField = 64,
  kLake = 128,      ///< beside kWater
  kSurveyed = 256,  ///< ground whose buildings are known: none are made up
  kAnyUse = ~0U,
  /// What streets, fields and pylons keep off.
  kInTheWay = kAnyUse & ~256U
};

/// What the plan has put where. Not for several threads.
class Occupancy {
 public:
  struct Bounds {
    Point lowest = Point::Constant(1e30);
    Point highest = Point::Constant(-1e30);
  };

  explicit Occupancy(double half_size_m) : index_(half_size_m) {}

  void add_ring(const PointsWorld& ring, unsigned use);
  /// Each piece of a line, with all within half its width.
  void add_line(const PointsWorld& line, double half_width_m, unsigned use);
  /// Whether nothing of the uses lies within the margin of a ring or in it.
  bool is_free(const PointsWorld& ring, double margin_m, unsigned uses = kAnyUse) const;
  bool is_free(const Point& from, const Point& to, double margin_m, unsigned uses = kAnyUse) const;
  bool is_free(const Point& at, double margin_m, unsigned uses = kAnyUse) const {
    return is_free(at, at, margin_m, uses);
  }

 private:
  struct Item {
    PointsWorld points;  ///< two: a piece of a line; more: a ring
    double half_width_m;
    unsigned use;
    Bounds bounds;  ///< with half its width
  };
  std::vector<Item> items_;
  PlaceIndex index_;
  mutable std::vector<std::int32_t> found_;
};

}  // namespace terracast::tiler::country
