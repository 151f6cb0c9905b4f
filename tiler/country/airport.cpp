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
  return box(-0.5 * length_m - 180.0, 0.5 * length_m + 180.0, is_large ? -165.0 : -130.0,
             is_large ? 660.0 : 300.0);
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

namespace {

class AirportBuilder {
 public:
  AirportBuilder(const Airport& airport, Builder& builder, std::vector<Way>& ways)
      : airport_(airport), builder_(builder), ways_(ways) {}

  void build() {
    builder_.survey().add_area(
        Theme::Aerodrome, airport_.boundary(),
        {{"aeroway", "aerodrome"},
         {"surface", "grass"},
         {"aerodrome:type", airport_.is_large ? "international" : "airfield"}});
    lay_runway();
    if (airport_.is_large) {
      lay_apron();
      build_terminal();
      build_sheds();
      lay_car_parks();
    } else {
      build_airfield();
    }
    builder_.survey().add_point(Theme::Aerodrome, airport_.at(60.0 - half_m_, -60.0),
                                {{"aeroway", "windsock"}});
    builder_.occupancy().add_ring(airport_.boundary(), kReserved);
  }

 private:
  void add_taxiway(const PointsWorld& line) {
    const double width_m = airport_.is_large ? 23.0 : 12.0;
    builder_.survey().add_line(
        Theme::Aerodrome, line,
        {{"aeroway", "taxiway"}, {"width", text_of(width_m)}, {"surface", "asphalt"}});
    builder_.occupancy().add_line(line, 0.5 * width_m + 8.0, kReserved);
  }

  void lay_runway() {
    const PointsWorld line{airport_.at(-half_m_, 0), airport_.at(half_m_, 0)};
    const int number = airport_.runway_number;
    builder_.survey().add_line(Theme::Aerodrome, line,
                               {{"aeroway", "runway"},
                                {"width", airport_.is_large ? "45" : "23"},
                                {"surface", "asphalt"},
                                {"ref", fmt::format("{:02}/{:02}", number, number + 18)}});
    builder_.occupancy().add_line(line, 75.0, kReserved);
    // The parallel taxiway turns into the runway at both ends.
    add_taxiway({airport_.at(-half_m_ + 20, 0), airport_.at(-half_m_ + 20, off_m_ - 40),
                 airport_.at(-half_m_ + 60, off_m_), airport_.at(half_m_ - 60, off_m_),
                 airport_.at(half_m_ - 20, off_m_ - 40), airport_.at(half_m_ - 20, 0)});
  }

  void lay_apron() {
    // Fast exits lead off at 30 degrees both ways.
    for (const double way : {-1.0, 1.0}) {
      add_taxiway({airport_.at(way * 150, 0), airport_.at(way * 430, off_m_)});
      add_taxiway(
          {airport_.at(way * 0.56 * half_m_, 0), airport_.at(way * 0.56 * half_m_, off_m_)});
    }
    for (const double u : {-0.75 * apron_m_, 0.0, 0.75 * apron_m_})
      add_taxiway({airport_.at(u, off_m_), airport_.at(u, off_m_ + 70)});
    builder_.survey().add_area(Theme::Aerodrome,
                               airport_.box(-apron_m_, apron_m_, off_m_ + 45, off_m_ + 215),
                               {{"aeroway", "apron"}, {"surface", "concrete"}});
  }

  void build_glazed(const PointsWorld& ring, Tags more) {
    Tags tags{{"building", "terminal"},
              {"aeroway", "terminal"},
              {"roof:material", "metal"},
              {"roof:colour", "#e6e9ea"}};
    tags.insert(tags.end(), more.begin(), more.end());
    builder_.build(ring, HouseKind::Office, 0, 60.0, 0.0, std::move(tags));
  }

  /// A hall under a vault, piers that reach out over the apron, aircraft at both with their noses to the glass.
  void build_terminal() {
    build_glazed(airport_.box(-hall_m_, hall_m_, front_m_, front_m_ + 62.0),
                 {{"height", "24"},
                  {"building:levels", "4"},
                  {"building:material", "glass"},
                  {"building:colour", "#cfdbe0"},
                  {"roof:shape", "round"},
                  {"roof:height", "7"}});
    constexpr double kPier_m = 58.0;
    for (const double side : {-1.0, 1.0}) {
      const double middle = side * 0.52 * hall_m_;
      build_glazed(airport_.box(middle - 0.1 * hall_m_, middle + 0.1 * hall_m_, front_m_ - kPier_m,
                                front_m_ - 0.1),
                   {{"height", "11"},
                    {"building:levels", "3"},
                    {"building:material", "metal"},
                    {"building:colour", "#e3e7e8"},
                    {"roof:shape", "flat"}});
      add_stand(middle, front_m_ - kPier_m, true);
      add_stand(side * 0.81 * hall_m_, front_m_, true);
    }
    for (const double u : {-0.26 * hall_m_, 0.0, 0.26 * hall_m_}) add_stand(u, front_m_, true);
    // Others stand before the sheds, and are reached by bus.
    for (double u = hall_m_ + 70.0; u < apron_m_ - 30.0; u += 48.0)
      for (const double side : {-1.0, 1.0})
        for (const double before_m : {6.0, 100.0}) add_stand(side * u, front_m_ - before_m, false);
  }

  /// For one aircraft before a front, its nose to it; with a bridge to its door.
  void add_stand(double along_m, double front_m, bool has_bridge) {
    constexpr double kWheel_m = 17.5;  ///< from the front to where the nose wheel stops
    builder_.survey().add_line(
        Theme::Aerodrome,
        {airport_.at(along_m, front_m - kWheel_m - 50.0), airport_.at(along_m, front_m - kWheel_m)},
        {{"aeroway", "parking_position"}});
    if (!has_bridge) return;
    // Doors are on the left of an aircraft, which looks away from the runway.
    const double left = -airport_.side;
    builder_.survey().add_line(Theme::Aerodrome,
                               {airport_.at(along_m + left * 9.0, front_m - 0.2),
                                airport_.at(along_m + left * 3.4, front_m - 16.6)},
                               {{"aeroway", "jet_bridge"}});
  }

  void build_sheds() {
    const double tower_u = hall_m_ + 60.0;
    const Point tower = airport_.at(tower_u, front_m_ + 16.0);
    builder_.survey().add_point(
        Theme::Aerodrome, tower,
        {{"aeroway", "control_tower"}, {"man_made", "tower"}, {"height", "46"}});
    builder_.occupancy().add_line({tower, tower + Point(0.1, 0.0)}, 10.0, kReserved);
    for (int k = 0; k < 4; ++k) {
      const double u = -hall_m_ - 70.0 - 84.0 * k;
      if (u - 74.0 < -apron_m_) break;
      builder_.build(airport_.box(u - 70, u, front_m_ + 6, front_m_ + 62), HouseKind::Warehouse, 0,
                     56.0, 0.0,
                     {{"building", "hangar"},
                      {"aeroway", "hangar"},
                      {"height", "19"},
                      {"roof:shape", k % 2 == 0 ? "round" : "gabled"}});
    }
    for (int k = 0; k < 3; ++k)
      builder_.build(airport_.box(tower_u + 30 + 66.0 * k, tower_u + 86 + 66.0 * k, front_m_ + 8,
                                  front_m_ + 52),
                     HouseKind::Warehouse, 0, 44.0, 0.0, {{"building", "warehouse"}});
  }

  void lay_car_parks() {
    for (int k = 0; k < 4; ++k) {
      const double u = -220.0 + 114.0 * k;
      const PointsWorld parking = airport_.box(u, u + 98, front_m_ + 96, front_m_ + 178);
      builder_.survey().add_area(Theme::Road, parking,
                                 {{"amenity", "parking"}, {"surface", "asphalt"}});
      builder_.occupancy().add_ring(parking, kReserved);
    }
    // The road in, past the hall.
    Way road;
    road.kind = RoadKind::Secondary;
    road.line = {airport_.gate(),
                 airport_.at(0, front_m_ + 190),
                 airport_.at(-260, front_m_ + 190),
                 airport_.at(-260, front_m_ + 80),
                 airport_.at(280, front_m_ + 80),
                 airport_.at(280, front_m_ + 190),
                 airport_.at(0, front_m_ + 190)};
    road.is_urban = true;
    ways_.push_back(road);
  }

  void build_airfield() {
    builder_.survey().add_area(Theme::Aerodrome, airport_.box(-120, 120, off_m_ + 10, off_m_ + 80),
                               {{"aeroway", "apron"}, {"surface", "asphalt"}});
    for (int k = 0; k < 3; ++k)
      builder_.build(airport_.box(-110.0 + 44 * k, -74.0 + 44 * k, off_m_ + 86, off_m_ + 114),
                     HouseKind::Warehouse, 0, 28.0, 0.0,
                     {{"building", "hangar"},
                      {"aeroway", "hangar"},
                      {"height", "9"},
                      {"roof:shape", "round"}});
    builder_.build(airport_.box(50, 74, off_m_ + 86, off_m_ + 100), HouseKind::Office, 0, 14.0, 0.0,
                   {{"building", "terminal"}, {"aeroway", "terminal"}, {"building:levels", "2"}});
  }

  const Airport& airport_;
  Builder& builder_;
  std::vector<Way>& ways_;
  const double half_m_ = 0.5 * airport_.length_m;
  const double off_m_ = airport_.is_large ? kTaxiway_m : 110.0;  ///< of the taxiway
  const double apron_m_ = std::min(620.0, 0.6 * half_m_);        ///< half its length
  const double hall_m_ = std::min(170.0, 0.34 * apron_m_);
  const double front_m_ = off_m_ + 217.0;  ///< off the runway, of the terminal's hall
};

}  // namespace

void build_airport(const Airport& airport, Builder& builder, std::vector<Way>& ways) {
  AirportBuilder(airport, builder, ways).build();
}

}  // namespace terracast::tiler::country
