#pragma once

#include <optional>
#include <vector>

#include "tiler/country/lots.h"

namespace terracast::tiler::country {

/// A stretch of shore: `along` has the land on its left, the sea on its right.
struct Shore {
  Point at = Point::Zero();
  Point along = Point::UnitX();
  Point seaward() const { return -left_of(along); }
  Point place(double along_m, double seaward_m) const {
    return at + along_m * along + seaward_m * seaward();
  }
  PointsWorld box(double along_from, double along_to, double sea_from, double sea_to) const {
    return {place(along_from, sea_to), place(along_to, sea_to), place(along_to, sea_from),
            place(along_from, sea_from)};
  }
};

struct Port {
  Shore shore;
  double half_length_m = 0.0;
  Point gate = Point::Zero();
};

/// Straight shore with level land behind it for a container terminal, near the largest town at the sea.
std::optional<Port> choose_port(const PlanGround& ground,
                                const std::vector<Settlement>& settlements,
                                const Occupancy& occupancy);
/// Quay, terminal and sheds; cranes, containers and ships follow from its tags.
void build_port(const Port& port, Builder& builder);
/// From a place outside to the lane between its sheds.
std::vector<PointsWorld> port_roads(const Port& port, const Point& outside);

/// Before streets are there: moles, piers and a marina at the shores of settlements.
void build_harbours(const std::vector<Settlement>& settlements, Builder& builder);
/// When all else is there: beaches, lighthouses on headlands, ships at sea.
void add_shore_features(const std::vector<Settlement>& settlements, Builder& builder);

}  // namespace terracast::tiler::country
