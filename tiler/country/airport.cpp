#include "tiler/country/airport.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace terracast::tiler::country {
namespace {

struct Heading {
  int number;  ///< of the runway, tens of degrees from north
  Point along;
};
/// By the sines of whole tens of degrees, written out so that they are the same everywhere.
constexpr double kSin[] = {0.0,
                           0.17364817766693033,
                           0.3420201433256687,
                           0.5,
                           0.6427876096865393,
                           0.766044443118978,
                           0.8660254037844386,
                           0.9396926207859083,
                           0.984807753012208,
                           1.0};

Heading heading(int number) {
  const double east = number <= 9 ? kSin[number] : kSin[18 - number];
  const double north = number <= 9 ? kSin[9 - number] : -kSin[number - 9];
  return {number, {east, north}};
}

struct RunwayRule {
  double length_m;
  double most_rise;   ///< of its line, rise over run
  double most_off_m;  ///< of the ground from that line
  bool is_large;
};
constexpr RunwayRule kRunways[] = {{3200.0, 0.012, 9.0, true},
                                   {2500.0, 0.015, 12.0, true},
                                   {1500.0, 0.02, 12.0, false},
                                   {900.0, 0.03, 12.0, false}};

constexpr double kTaxiway_m = 185.0;  ///< off the runway

}  // namespace

PointsWorld Airport::box(double along_from, double along_to, double off_from, double off_to) const {
  PointsWorld ring{at(along_from, off_from), at(along_to, off_from), at(along_to, off_to),
                   at(along_from, off_to)};
  if (side < 0.0) std::reverse(ring.begin(), ring.end());
  return ring;
}

PointsWorld Airport::boundary() const {
  return box(-0.5 * length_m - 180.0, 0.5 * length_m + 180.0, -130.0, is_large ? 660.0 : 300.0);
}

std::optional<Airport> choose_airport(const PlanGround& ground,
                                      const std::vector<Settlement>& settlements,
                                      const Occupancy& occupancy) {
  if (settlements.empty()) return std::nullopt;
  const Settlement& city = settlements.front();
  for (const RunwayRule& rule : kRunways) {
    std::optional<Airport> best;
    double best_cost = 1e9;
    const double step_m = ground.half_size_m() > 8000.0 ? 512.0 : 192.0;
    const int reach = static_cast<int>(std::min(13000.0, 1.8 * ground.half_size_m()) / step_m);
    for (int j = -reach; j <= reach; ++j)
      for (int i = -reach; i <= reach; ++i) {
        const Point center = city.center + step_m * Point(i, j);
        const double city_m = (center - city.center).norm();
        if (city_m < city.radius_m + 900.0 || !ground.is_in_square(center, 400.0)) continue;
        if (!ground.is_land_near(center) || ground.slope(center) > 0.04) continue;
        for (int number = 1; number <= 18; ++number) {
          Airport airport;
          airport.center = snapped(center);
          airport.along = heading(number).along;
          airport.runway_number = number;
          airport.length_m = rule.length_m;
          airport.is_large = rule.is_large;
          airport.side = (city.center - center).dot(left_of(airport.along)) > 0.0 ? 1.0 : -1.0;
          const PointsWorld boundary = airport.boundary();
          if (std::any_of(boundary.begin(), boundary.end(),
                          [&](const Point& corner) { return !ground.is_in_square(corner, 150.0); }))
            continue;
          const double half_m = 0.5 * rule.length_m;
          const double from_m = ground.height_m(airport.at(-half_m, 0)),
                       to_m = ground.height_m(airport.at(half_m, 0));
          if (std::abs(to_m - from_m) > rule.most_rise * rule.length_m) continue;
          double off_m = 0.0, area_off_m = 0.0;
          bool is_land = true;
          for (double u = -1.05; u <= 1.051 && is_land; u += 0.07)
            for (const double v : {-100.0, 0.0, 200.0, 420.0, 640.0}) {
              if (!rule.is_large && v > 250.0) break;
              const Point at = airport.at(u * half_m, v);
              is_land = is_land && ground.sea_distance_m(at) > 60.0;
              const double line_m = from_m + 0.5 * (u + 1.0) * (to_m - from_m);
              const double here_m = std::abs(ground.height_m(at) - line_m);
              (v <= 0.0 ? off_m : area_off_m) = std::max(v <= 0.0 ? off_m : area_off_m, here_m);
            }
          if (!is_land || off_m > rule.most_off_m || area_off_m > 2.0 * rule.most_off_m) continue;
          double cost = off_m + 0.4 * area_off_m + 300.0 * std::abs(to_m - from_m) / rule.length_m +
                        0.0012 * city_m;
          for (const Settlement& other : settlements) {
            const double apart_m = (other.center - center).norm() - other.radius_m;
            if (other.rank != Rank::Hamlet && apart_m < 0.5 * rule.length_m + 300.0) cost += 30.0;
            // Not over roofs on the approach.
            const double off_line = std::abs(cross(other.center - center, airport.along));
            if (off_line < other.radius_m && other.rank <= Rank::Town) cost += 6.0;
          }
          if (cost < best_cost && occupancy.is_free(boundary, 20.0)) {
            best_cost = cost;
            best = airport;
          }
        }
      }
    if (best) return best;
  }
  return std::nullopt;
}

void build_airport(const Airport& airport, Builder& builder, std::vector<Way>& ways) {
  Survey& survey = builder.survey();
  const double half_m = 0.5 * airport.length_m;
  const auto taxiway = [&](PointsWorld line, double width_m) {
    survey.add_line(Theme::Aerodrome, line,
                    {{"aeroway", "taxiway"}, {"width", text_of(width_m)}, {"surface", "asphalt"}});
    builder.occupancy().add_line(line, 0.5 * width_m + 8.0, kReserved);
  };
  survey.add_area(Theme::Aerodrome, airport.boundary(),
                  {{"aeroway", "aerodrome"},
                   {"surface", "grass"},
                   {"aerodrome:type", airport.is_large ? "international" : "airfield"}});
  const double width_m = airport.is_large ? 45.0 : 23.0;
  survey.add_line(
      Theme::Aerodrome, {airport.at(-half_m, 0), airport.at(half_m, 0)},
      {{"aeroway", "runway"},
       {"width", text_of(width_m)},
       {"surface", "asphalt"},
       {"ref", fmt::format("{:02}/{:02}", airport.runway_number, airport.runway_number + 18)}});
  builder.occupancy().add_line({airport.at(-half_m, 0), airport.at(half_m, 0)}, 75.0, kReserved);
  const double off_m = airport.is_large ? kTaxiway_m : 110.0;
  const double taxi_m = airport.is_large ? 23.0 : 12.0;
  // The parallel taxiway turns into the runway at both ends.
  taxiway({airport.at(-half_m + 20, 0), airport.at(-half_m + 20, off_m - 40),
           airport.at(-half_m + 60, off_m), airport.at(half_m - 60, off_m),
           airport.at(half_m - 20, off_m - 40), airport.at(half_m - 20, 0)},
          taxi_m);
  if (airport.is_large) {
    // Fast exits lead off at 30 degrees both ways.
    for (const double way : {-1.0, 1.0}) {
      taxiway({airport.at(way * 150, 0), airport.at(way * 430, off_m)}, taxi_m);
      taxiway({airport.at(way * 0.56 * half_m, 0), airport.at(way * 0.56 * half_m, off_m)}, taxi_m);
    }
    const double apron_m = std::min(620.0, 0.6 * half_m);
    for (const double u : {-0.75 * apron_m, 0.0, 0.75 * apron_m})
      taxiway({airport.at(u, off_m), airport.at(u, off_m + 70)}, taxi_m);
    const auto area = [&](const PointsWorld& ring, Theme theme, Tags tags) {
      survey.add_area(theme, ring, std::move(tags));
    };
    area(airport.box(-apron_m, apron_m, off_m + 45, off_m + 215), Theme::Aerodrome,
         {{"aeroway", "apron"}, {"surface", "concrete"}});
    // The terminal: a hall with piers that reach out over the apron.
    const double front_m = off_m + 217.0;
    PointsWorld terminal;
    const double hall_m = std::min(170.0, 0.34 * apron_m);
    for (const Point& p :
         {Point(-hall_m, 62), Point(-hall_m, 0), Point(-0.62 * hall_m, 0),
          Point(-0.62 * hall_m, -58), Point(-0.42 * hall_m, -58), Point(-0.42 * hall_m, 0),
          Point(0.42 * hall_m, 0), Point(0.42 * hall_m, -58), Point(0.62 * hall_m, -58),
          Point(0.62 * hall_m, 0), Point(hall_m, 0), Point(hall_m, 62)})
      terminal.push_back(airport.at(p.x(), front_m + p.y()));
    if (signed_area(terminal) < 0.0) std::reverse(terminal.begin(), terminal.end());
    builder.build(terminal, HouseKind::Office, 0, 60.0, 0.0,
                  {{"building", "terminal"},
                   {"aeroway", "terminal"},
                   {"height", "18"},
                   {"building:levels", "3"},
                   {"roof:shape", "flat"},
                   {"building:material", "glass"}});
    const double tower_u = hall_m + 60.0;
    builder.build(airport.box(tower_u - 6, tower_u + 6, front_m + 10, front_m + 22),
                  HouseKind::Office, 0, 12.0, 0.0,
                  {{"building", "control_tower"},
                   {"aeroway", "control_tower"},
                   {"man_made", "tower"},
                   {"height", "42"},
                   {"building:levels", "10"},
                   {"roof:shape", "flat"}});
    for (int k = 0; k < 4; ++k) {
      const double u = -hall_m - 70.0 - 84.0 * k;
      if (u - 74.0 < -apron_m) break;
      builder.build(airport.box(u - 70, u, front_m + 6, front_m + 62), HouseKind::Warehouse, 0,
                    56.0, 0.0,
                    {{"building", "hangar"},
                     {"aeroway", "hangar"},
                     {"height", "19"},
                     {"roof:shape", k % 2 == 0 ? "round" : "gabled"}});
    }
    for (int k = 0; k < 3; ++k)
      builder.build(
          airport.box(tower_u + 30 + 66.0 * k, tower_u + 86 + 66.0 * k, front_m + 8, front_m + 52),
          HouseKind::Warehouse, 0, 44.0, 0.0, {{"building", "warehouse"}});
    for (int k = 0; k < 4; ++k) {
      const double u = -220.0 + 114.0 * k;
      const PointsWorld parking = airport.box(u, u + 98, front_m + 96, front_m + 178);
      area(parking, Theme::Road, {{"amenity", "parking"}, {"surface", "asphalt"}});
      builder.occupancy().add_ring(parking, kReserved);
    }
    // The road in, past the hall.
    Way road;
    road.kind = RoadKind::Secondary;
    road.line = {airport.gate(),
                 airport.at(0, front_m + 190),
                 airport.at(-260, front_m + 190),
                 airport.at(-260, front_m + 80),
                 airport.at(280, front_m + 80),
                 airport.at(280, front_m + 190),
                 airport.at(0, front_m + 190)};
    road.is_urban = true;
    ways.push_back(road);
  } else {
    survey.add_area(Theme::Aerodrome, airport.box(-120, 120, off_m + 10, off_m + 80),
                    {{"aeroway", "apron"}, {"surface", "asphalt"}});
    for (int k = 0; k < 3; ++k)
      builder.build(airport.box(-110.0 + 44 * k, -74.0 + 44 * k, off_m + 86, off_m + 114),
                    HouseKind::Warehouse, 0, 28.0, 0.0,
                    {{"building", "hangar"},
                     {"aeroway", "hangar"},
                     {"height", "9"},
                     {"roof:shape", "round"}});
    builder.build(airport.box(50, 74, off_m + 86, off_m + 100), HouseKind::Office, 0, 14.0, 0.0,
                  {{"building", "terminal"}, {"aeroway", "terminal"}, {"building:levels", "2"}});
  }
  survey.add_point(Theme::Aerodrome, airport.at(60.0 - half_m, -60.0), {{"aeroway", "windsock"}});
  builder.occupancy().add_ring(airport.boundary(), kReserved);
}

}  // namespace terracast::tiler::country
