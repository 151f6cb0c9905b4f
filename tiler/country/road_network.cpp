#include "tiler/country/road_network.h"

#include <algorithm>
#include <cmath>

namespace terracast::tiler::country {
namespace {

/// A metre beside or below buildings that stand costs so much more.
constexpr double kBelowBuildings = 5.0;
constexpr double kOffBuildings_m = 12.0;

RouteStyle style_of(RoadKind kind, const Occupancy& obstacles, const Occupancy& standing) {
  RouteStyle style;
  style.steepest = 0.85 * rule_of(kind).steepest;
  if (kind == RoadKind::Primary) style.tunnel = 5.0;
  if (kind == RoadKind::Primary || kind == RoadKind::Secondary) style.water_reach_m = 400.0;
  style.avoid = [&obstacles, &standing](const Point& at) {
    if (!obstacles.is_free(at, 30.0, kReserved)) return 0.0;
    if (!standing.is_free(at, kOffBuildings_m)) return kBelowBuildings;
    return obstacles.is_free(at, 0.0, kLake) ? 1.0 : kOverLakes;
  };
  return style;
}

}  // namespace

RoadNetwork plan_roads(RouteGrid& net, const PlanGround& ground,
                       const std::vector<Settlement>& settlements, const std::vector<Point>& gates,
                       const Occupancy& obstacles, const Occupancy& standing) {
  std::vector<RouteStyle> styles;
  for (int kind = 0; kind <= static_cast<int>(RoadKind::Unclassified); ++kind)
    styles.push_back(style_of(static_cast<RoadKind>(kind), obstacles, standing));
  const auto link = [&](const Point& from, const Point& to, RoadKind kind) {
    const int a = net.node_at(from), b = net.node_at(to);
    if (a == b) return false;
    const auto nodes = net.route(a, b, styles[static_cast<std::size_t>(kind)]);
    if (nodes) net.add(*nodes, static_cast<int>(kind));
    return nodes.has_value();
  };
  // A pair is linked where no third lies nearer to both (the relative neighbourhood; Toussaint 1980): so
  // all are reached, with some round trips.
  const auto link_neighbours = [&](Rank lowest, Rank of, RoadKind kind) {
    for (std::size_t a = 0; a < settlements.size(); ++a)
      for (std::size_t b = a + 1; b < settlements.size(); ++b) {
        if (settlements[a].rank > lowest || settlements[b].rank > lowest ||
            settlements[b].rank != of)
          continue;
        const double apart_m = (settlements[a].center - settlements[b].center).norm();
        bool is_linked = true;
        for (std::size_t c = 0; c < settlements.size() && is_linked; ++c) {
          if (c == a || c == b || settlements[c].rank > lowest) continue;
          is_linked = std::max((settlements[c].center - settlements[a].center).norm(),
                               (settlements[c].center - settlements[b].center).norm()) >= apart_m;
        }
        if (is_linked) link(settlements[a].center, settlements[b].center, kind);
      }
  };
  link_neighbours(Rank::Town, Rank::Town, RoadKind::Primary);
  if (!settlements.empty()) {
    // Out of the square, to each side by its easiest place.
    const double half_m = ground.half_grid_m();
    for (const Point& side : {Point(1, 0), Point(-1, 0), Point(0, 1), Point(0, -1)}) {
      Point best = Point::Zero();
      double least = 1e9;
      const Settlement* from = nullptr;
      for (const Settlement& settlement : settlements) {
        if (settlement.rank > Rank::Town) continue;
        for (double t = -0.9; t <= 0.91; t += 0.05) {
          const Point at = half_m * (side + t * left_of(side));
          if (ground.sea_distance_m(at) < 100.0 || !obstacles.is_free(at, 60.0, kLake)) continue;
          const double cost =
              std::round((at - settlement.center).norm() + 20000.0 * ground.slope(at) +
                         6.0 * std::max(ground.height_m(at), 0.0));
          if (cost < least) {
            least = cost;
            best = at;
            from = &settlement;
          }
        }
      }
      if (from != nullptr) link(from->center, best, RoadKind::Primary);
    }
    for (const Point& gate : gates) link(settlements.front().center, gate, RoadKind::Secondary);
  }
  link_neighbours(Rank::Village, Rank::Village, RoadKind::Tertiary);
  // Hamlets: to the nearest place of a higher rank.
  for (const Settlement& hamlet : settlements) {
    if (hamlet.rank != Rank::Hamlet) continue;
    std::vector<std::pair<double, const Settlement*>> near;
    for (const Settlement& other : settlements)
      if (other.rank < Rank::Hamlet)
        near.emplace_back(std::round((other.center - hamlet.center).norm()), &other);
    std::stable_sort(near.begin(), near.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (std::size_t k = 0; k < std::min<std::size_t>(near.size(), 2); ++k)
      if (link(hamlet.center, near[k].second->center, RoadKind::Unclassified)) break;
  }
  RoadNetwork network;
  for (Alignment& alignment : alignments(net, ground)) {
    for (const auto& [from_m, to_m] : alignment.tunnels_m)
      network.tunnels.push_back(part_of(alignment.line, from_m, to_m));
    Way way;
    way.kind = static_cast<RoadKind>(alignment.kind);
    way.line = std::move(alignment.line);
    network.ways.push_back(std::move(way));
  }
  return network;
}

}  // namespace terracast::tiler::country
