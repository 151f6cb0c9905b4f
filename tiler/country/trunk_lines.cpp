#include "tiler/country/trunk_lines.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace terracast::tiler::country {
namespace {

constexpr double kCarriageway_m = 9.4;  ///< off the middle
constexpr double kInterchange_m = 4500.0;
constexpr double kRamp_m = 360.0;
/// A motorway bends less than what leads it through the grid.
constexpr Easing kMotorwayEasing{.rounds = 80, .reach = 1.7, .least_yield = 0.6};

/// A line moved to its right.
PointsWorld beside(const PointsWorld& line, double right_m) {
  PointsWorld moved;
  for (std::size_t k = 0; k < line.size(); ++k) {
    const Point before = k > 0 ? Point((line[k] - line[k - 1]).normalized()) : Point::Zero();
    const Point after =
        k + 1 < line.size() ? Point((line[k + 1] - line[k]).normalized()) : Point::Zero();
    const Point along = (before + after).normalized();
    moved.push_back(snapped(line[k] - right_m * left_of(along)));
  }
  return moved;
}

/// Places of the square's border where a way may leave it: one for each side that has land.
std::vector<Point> border_gates(const PlanGround& ground, const Occupancy& occupancy,
                                const Point& from) {
  std::vector<Point> gates;
  const double half_m = ground.half_grid_m();
  for (const Point& side : {Point(1, 0), Point(-1, 0), Point(0, 1), Point(0, -1)}) {
    double least = 1e9;
    Point best = Point::Zero();
    for (double t = -0.85; t <= 0.86; t += 0.05) {
      const Point at = half_m * (side + t * left_of(side));
      if (ground.sea_distance_m(at) < 300.0 || !occupancy.is_free(at, 60.0, kWater)) continue;
      const double cost = std::round(0.4 * (at - from).norm() + 30000.0 * ground.slope(at) +
                                     8.0 * ground.height_m(at));
      if (cost < least) least = cost, best = at;
    }
    if (least < 1e9) gates.push_back(best);
  }
  return gates;
}

PointsWorld curve(const Point& from, const Point& from_control, const Point& to_control,
                  const Point& to) {
  PointsWorld line;
  for (int k = 0; k <= 24; ++k) {
    const double t = k / 24.0, s = 1.0 - t;
    line.push_back(s * s * s * from + 3 * s * s * t * from_control + 3 * s * t * t * to_control +
                   t * t * t * to);
  }
  return line;
}

std::size_t nearest_vertex(const PointsWorld& line, const Point& at) {
  std::size_t best = 0;
  for (std::size_t k = 1; k < line.size(); ++k)
    if ((line[k] - at).squaredNorm() < (line[best] - at).squaredNorm()) best = k;
  return best;
}

}  // namespace

Motorway plan_motorway(const PlanGround& ground, const Grid<std::uint8_t>& rivers,
                       const std::vector<Settlement>& settlements, const Occupancy& occupancy) {
  Motorway motorway;
  if (settlements.empty() || ground.half_size_m() < 6000.0) return motorway;
  const Settlement& city = settlements.front();
  RouteGrid net(ground, rivers);
  RouteStyle style;
  style.steepest = 0.042;
  style.climb = 3.0;
  style.tunnel = 4.0;
  style.water = 5.0;
  style.water_reach_m = 450.0;
  style.river_m = 90.0;
  style.avoid = [&](const Point& place) {
    if (!occupancy.is_free(place, 60.0, kReserved)) return 0.0;
    if (!occupancy.is_free(place, 0.0, kLake)) return kOverLakes;
    for (const Settlement& town : settlements)
      if ((town.center - place).norm() <
          (town.rank == Rank::Hamlet ? 160.0 : 1.1 * town.radius_m + 120.0))
        return 7.0;
    return 1.0;
  };
  // Past the city on its gentlest side.
  double least = 1e9;
  Point pass = city.center;
  Point out = Point::UnitX();
  for (int k = 0; k < 16; ++k, out = turned(out, 0.19891236737965800)) {
    const Point at = city.center + (1.2 * city.radius_m + 300.0) * out;
    if (!ground.is_in_square(at, 500.0) || ground.sea_distance_m(at) < 500.0 ||
        !occupancy.is_free(at, 200.0, kReserved | kLake))
      continue;
    const double cost = std::round(8000.0 * ground.slope(at) + 0.3 * at.norm());
    if (cost < least) least = cost, pass = at;
  }
  if (least == 1e9) return motorway;
  std::vector<Point> ends = border_gates(ground, occupancy, city.center);
  for (std::size_t k = settlements.size(); ends.size() < 2 && k-- > 1;)
    if (settlements[k].rank == Rank::Town && (settlements[k].center - city.center).norm() > 5000.0)
      ends.push_back(settlements[k].center +
                     (settlements[k].radius_m + 150.0) *
                         (city.center - settlements[k].center).normalized());
  // The two that lead most nearly opposite ways.
  std::size_t first = 0, second = 0;
  double opposite = 2.0;
  for (std::size_t a = 0; a < ends.size(); ++a)
    for (std::size_t b = a + 1; b < ends.size(); ++b) {
      const double cosine = (ends[a] - pass).normalized().dot((ends[b] - pass).normalized());
      if (std::round(cosine * 1024.0) < std::round(opposite * 1024.0))
        opposite = cosine, first = a, second = b;
    }
  for (const std::size_t end : {first, second}) {
    if (end >= ends.size()) continue;
    const int from = net.node_at(pass), to = net.node_at(ends[end]);
    if (from == to) continue;
    if (const auto nodes = net.route(from, to, style)) net.add(*nodes, 0);
    if (first == second) break;
  }
  motorway.middles = alignments(net, ground, kMotorwayEasing);
  for (const Alignment& middle : motorway.middles)
    for (const bool is_back : {false, true}) {
      Way way;
      way.kind = RoadKind::Motorway;
      way.line = beside(middle.line, is_back ? -kCarriageway_m : kCarriageway_m);
      auto tunnels = middle.tunnels_m;
      if (is_back) {
        std::reverse(way.line.begin(), way.line.end());
        const double length = length_of(middle.line);
        for (auto& [from_m, to_m] : tunnels)
          std::tie(from_m, to_m) = std::pair(length - to_m, length - from_m);
        std::reverse(tunnels.begin(), tunnels.end());
      }
      // The sides of a bend differ in length.
      const double stretch = length_of(way.line) / length_of(middle.line);
      for (auto& [from_m, to_m] : tunnels) from_m *= stretch, to_m *= stretch;
      motorway.carriageways.push_back(std::move(way));
      motorway.tunnels_m.push_back(std::move(tunnels));
    }
  return motorway;
}

void add_interchanges(Motorway& motorway, const std::vector<Way>& roads, const PlanGround& ground,
                      const Occupancy& occupancy) {
  std::vector<Point> built;
  for (std::size_t m = 0; m < motorway.middles.size(); ++m) {
    const PointsWorld& middle = motorway.middles[m].line;
    for (const Way& road : roads) {
      if (road.kind > RoadKind::Tertiary) continue;
      for (std::size_t r = 1; r < road.line.size(); ++r)
        for (std::size_t k = 1; k < middle.size(); ++k) {
          const auto share = crossing(middle[k - 1], middle[k], road.line[r - 1], road.line[r]);
          if (!share) continue;
          const Point at = middle[k - 1] + *share * (middle[k] - middle[k - 1]);
          const Point along = (middle[k] - middle[k - 1]).normalized();
          const Point over = (road.line[r] - road.line[r - 1]).normalized();
          if (std::abs(cross(along, over)) < 0.5 || !ground.is_in_square(at, 700.0)) continue;
          if (std::any_of(built.begin(), built.end(),
                          [&](const Point& other) { return (other - at).norm() < kInterchange_m; }))
            continue;
          std::vector<Way> ramps;
          bool is_possible = true;
          for (const std::size_t c : {2 * m, 2 * m + 1}) {
            const PointsWorld& lane = motorway.carriageways[c].line;
            const Point ahead = c % 2 == 0 ? along : Point(-along);
            const Point right = -left_of(ahead);
            const Point to_right = over.dot(right) > 0.0 ? over : Point(-over);
            const std::size_t q = nearest_vertex(road.line, at + 120.0 * to_right);
            const Point& foot = road.line[q];
            const std::size_t leave = nearest_vertex(lane, at - kRamp_m * ahead),
                              enter = nearest_vertex(lane, at + kRamp_m * ahead);
            is_possible = is_possible && (foot - at).dot(right) > 50.0 &&
                          (foot - at).norm() < 220.0 && (lane[leave] - at).norm() < 460.0 &&
                          (lane[enter] - at).norm() < 460.0;
            for (const bool is_exit : {true, false}) {
              Way ramp;
              ramp.kind = RoadKind::MotorwayLink;
              ramp.line =
                  is_exit
                      ? curve(lane[leave], lane[leave] + 170.0 * ahead, foot - 90.0 * ahead, foot)
                      : curve(foot, foot + 90.0 * ahead, lane[enter] - 170.0 * ahead, lane[enter]);
              for (std::size_t p = 3; p + 3 < ramp.line.size(); ++p)
                is_possible = is_possible && ground.sea_distance_m(ramp.line[p]) > 40.0 &&
                              ground.slope(ramp.line[p]) < 0.14 &&
                              occupancy.is_free(ramp.line[p], 5.0, kWater | kReserved | kBuilding);
              ramps.push_back(std::move(ramp));
            }
          }
          if (!is_possible) continue;
          built.push_back(at);
          for (Way& ramp : ramps) motorway.ramps.push_back(std::move(ramp));
        }
    }
  }
}

Railway plan_railway(const PlanGround& ground, const Grid<std::uint8_t>& rivers,
                     const std::vector<Settlement>& settlements, const Occupancy& occupancy) {
  Railway railway;
  if (settlements.empty() || ground.half_size_m() < 4000.0) return railway;
  RouteGrid net(ground, rivers);
  RouteStyle style;
  style.steepest = 0.018;
  style.climb = 5.0;
  style.side_slope = 3.0;
  style.tunnel = 3.0;
  style.water = 5.0;
  style.water_reach_m = 350.0;
  style.reuse = 0.3;
  style.avoid = [&](const Point& place) {
    if (!occupancy.is_free(place, 40.0, kReserved)) return 0.0;
    if (!occupancy.is_free(place, 0.0, kLake)) return kOverLakes;
    for (const Settlement& town : settlements) {
      const double far = (town.center - place).norm() / town.radius_m;
      if (far < 0.3) return 5.0;
      if (far < 1.0) return 1.5;
    }
    return 1.0;
  };
  // A station lies at the edge of the old middle, on level ground.
  const auto station_of = [&](const Settlement& town) -> std::optional<Point> {
    double least = 1e9;
    Point best = Point::Zero();
    Point out = Point::UnitX();
    for (int k = 0; k < 16; ++k, out = turned(out, 0.19891236737965800)) {
      const Point at = town.center + 0.45 * town.radius_m * out;
      if (!ground.is_in_square(at, 300.0) || ground.sea_distance_m(at) < 200.0 ||
          !occupancy.is_free(at, 70.0, kWater | kReserved))
        continue;
      const double cost =
          std::round(10000.0 * ground.slope(at) + 0.1 * (at - settlements.front().center).norm());
      if (cost < least) least = cost, best = at;
    }
    return least < 1e9 ? std::optional(net.place(net.node_at(best))) : std::nullopt;
  };
  const auto main = station_of(settlements.front());
  if (!main) return railway;
  railway.stations.push_back(*main);
  int num_linked = 0;
  for (std::size_t k = 1; k < settlements.size() && num_linked < 5; ++k) {
    if (settlements[k].rank != Rank::Town) break;
    const auto station = station_of(settlements[k]);
    if (!station) continue;
    // On from the nearest station there is.
    const Point* from = &railway.stations.front();
    for (const Point& other : railway.stations)
      if ((other - *station).norm() < (*from - *station).norm()) from = &other;
    const auto nodes = net.route(net.node_at(*from), net.node_at(*station), style);
    if (!nodes) continue;
    net.add(*nodes, 0);
    railway.stations.push_back(*station);
    ++num_linked;
  }
  for (const Point& gate : border_gates(ground, occupancy, *main)) {
    const Point* from = &railway.stations.front();
    for (const Point& other : railway.stations)
      if ((other - gate).norm() < (*from - gate).norm()) from = &other;
    if (const auto nodes = net.route(net.node_at(*from), net.node_at(gate), style)) {
      net.add(*nodes, 0);
      break;
    }
  }
  railway.lines = alignments(net, ground);
  return railway;
}

void build_stations(const Railway& railway, Builder& builder) {
  for (const Point& station : railway.stations) {
    double nearest_m = 90.0;
    Station track;
    for (const Alignment& line : railway.lines)
      for (std::size_t k = 1; k < line.line.size(); ++k)
        if (const double away_m = distance_to_segment(station, line.line[k - 1], line.line[k]);
            away_m < nearest_m) {
          nearest_m = away_m;
          track = {0.5 * (line.line[k - 1] + line.line[k]),
                   (line.line[k] - line.line[k - 1]).normalized()};
        }
    if (nearest_m == 90.0) continue;
    builder.survey().add_point(Theme::Rail, track.at, {{"railway", "station"}});
    const Point across = left_of(track.along);
    for (const double side : {1.0, -1.0}) {
      const Rectangle platform{track.at + side * 7.6 * across, track.along, 75.0, 2.6};
      builder.reserve(
          platform.ring(), 0.0, Theme::Rail,
          {{"railway", "platform"}, {"public_transport", "platform"}, {"surface", "concrete"}});
    }
    for (const double side : {1.0, -1.0})
      if (builder.build(Rectangle{track.at + side * 22.0 * across, track.along, 27.0, 7.5}.ring(),
                        HouseKind::Civic, 0, 15.0, 1.0,
                        {{"building", "train_station"}, {"building:levels", "2"}})) {
        builder.reserve(Rectangle{track.at + side * 46.0 * across, track.along, 34.0, 12.0}.ring(),
                        1.0, Theme::Road, {{"amenity", "parking"}, {"surface", "asphalt"}});
        break;
      }
  }
}

}  // namespace terracast::tiler::country
