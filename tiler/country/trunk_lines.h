#pragma once

#include <vector>

#include "tiler/country/lots.h"
#include "tiler/country/route_grid.h"

namespace terracast::tiler::country {

/// Right-hand carriageways and ramps; they meet roads at the ends of ramps alone.
struct Motorway {
  std::vector<Alignment> middles;                                 ///< between the carriageways
  std::vector<Way> carriageways;                                  ///< in the direction of traffic
  std::vector<std::vector<std::pair<double, double>>> tunnels_m;  ///< of each carriageway
  std::vector<Way> ramps;
};

/// A motorway across the square, past the city, where it is large enough for one.
Motorway plan_motorway(const PlanGround& ground, const Grid<std::uint8_t>& rivers,
                       const std::vector<Settlement>& settlements, const Occupancy& occupancy);
/// Ramps where main roads cross it, some kilometres apart.
void add_interchanges(Motorway& motorway, const std::vector<Way>& roads, const PlanGround& ground,
                      const Occupancy& occupancy);

struct Railway {
  std::vector<Alignment> lines;
  std::vector<Point> stations;
};
/// A line through the stations of the city and towns, of gentle grades.
Railway plan_railway(const PlanGround& ground, const Grid<std::uint8_t>& rivers,
                     const std::vector<Settlement>& settlements, const Occupancy& occupancy);
void build_stations(const Railway& railway, Builder& builder);

}  // namespace terracast::tiler::country
