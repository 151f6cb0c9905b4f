#pragma once

#include <optional>
#include <vector>

#include "tiler/country/lots.h"

namespace terracast::tiler::country {

struct Airport {
  Point center = Point::Zero();  ///< of the runway
  Point along = Point::UnitX();  ///< the runway's, east or north
  int runway_number = 9;         ///< of the end from which `along` leads
  double length_m = 0.0;
  double side = 1.0;  ///< the terminal lies to the left of `along`: 1; to the right: -1
  bool is_large = false;

  /// A place along the runway and off it, towards the terminal.
  Point at(double along_m, double off_m) const {
    return center + along_m * along + side * off_m * left_of(along);
  }
  PointsWorld box(double along_from, double along_to, double off_from, double off_to) const;
  /// All that belongs to it.
  PointsWorld boundary() const;
  Point gate() const { return at(0.0, 640.0); }
};

/// The flattest place for a runway some kilometres from the city; in mountains a short one, or none.
std::optional<Airport> choose_airport(const PlanGround& ground,
                                      const std::vector<Settlement>& settlements,
                                      const Occupancy& occupancy);

/// Runway, taxiways, apron, terminal, tower, hangars, car parks and the roads to them.
void build_airport(const Airport& airport, Builder& builder, std::vector<Way>& ways);

}  // namespace terracast::tiler::country
