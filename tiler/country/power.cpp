#include "tiler/country/power.h"

#include <algorithm>
#include <cmath>

#include "tiler/country/route_grid.h"

namespace terracast::tiler::country {
namespace {

constexpr double kSpan_m = 310.0;
constexpr double kTowerClear_m = 9.0;

bool can_stand(const Builder& builder, Occupancy& occupancy, const Point& at) {
  const PlanGround& ground = builder.ground();
  return ground.is_in_square(at, 30.0) && ground.sea_distance_m(at) > 45.0 &&
         ground.slope(at) < 0.8 && occupancy.is_free(at, kTowerClear_m, kInTheWay);
}

/// Towers along a line's straight legs, each moved along it until it stands clear.
PointsWorld towers_along(const PointsWorld& route, Builder& builder) {
  PointsWorld towers;
  const PointsWorld corners = simplified(route, 110.0);
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const auto place = [&](const Point& at, const Point& along) {
      for (const double step :
           {0.0, 15.0, -15.0, 30.0, -30.0, 50.0, -50.0, 75.0, -75.0, 100.0, -100.0}) {
        const Point moved = snapped(at + step * along +
                                    (std::abs(step) > 40.0 ? 0.3 * step : 0.0) * left_of(along));
        if (!can_stand(builder, builder.occupancy(), moved)) continue;
        if (towers.empty() || (towers.back() - moved).norm() > 80.0) towers.push_back(moved);
        return;
      }
    };
    const Point& next = corners[std::min(k + 1, corners.size() - 1)];
    const Point leg = next - corners[k];
    const double length = leg.norm();
    place(corners[k], length > 0.0 ? Point(leg / length) : Point::UnitX());
    const int spans = static_cast<int>(std::ceil(length / kSpan_m));
    for (int s = 1; s < spans; ++s) place(corners[k] + leg * s / spans, leg / length);
  }
  return towers;
}

void add_wind_farms(const PlanGround& ground, const std::vector<Settlement>& settlements,
                    Builder& builder) {
  struct Ridge {
    double prominence_m;
    Point at;
  };
  std::vector<Ridge> ridges;
  const int stride = std::max(static_cast<int>(256.0 / ground.spacing_m()), 1);
  for (int j = 0; j < ground.side(); j += stride)
    for (int i = 0; i < ground.side(); i += stride) {
      const Point at = ground.place(i, j);
      if (!ground.is_in_square(at, 500.0) || ground.sea_distance_m(at) < 400.0 ||
          ground.slope(at) > 0.22)
        continue;
      double round_m = 0.0;
      for (const Point& way : {Point(1, 0), Point(0, 1), Point(-1, 0), Point(0, -1)})
        round_m += 0.125 * (ground.height_m(at + 900.0 * way) + ground.height_m(at + 500.0 * way));
      ridges.push_back({std::round(ground.height_m(at) - round_m), at});
    }
  std::stable_sort(ridges.begin(), ridges.end(),
                   [](const Ridge& a, const Ridge& b) { return a.prominence_m > b.prominence_m; });
  const double square_km2 = 4e-6 * ground.half_size_m() * ground.half_size_m();
  const int most = 3 + static_cast<int>(square_km2 / 70.0);
  PointsWorld turbines;
  std::vector<Point> farms;
  for (const Ridge& ridge : ridges) {
    if (static_cast<int>(turbines.size()) >= most) break;
    // Not on the mountains' tops, where no road leads.
    if (ridge.prominence_m > 160.0) continue;
    const bool is_new = std::none_of(farms.begin(), farms.end(), [&](const Point& farm) {
      return (farm - ridge.at).norm() < 2600.0;
    });
    const bool joins = !turbines.empty() && (turbines.back() - ridge.at).norm() < 1300.0;
    if (!is_new && !joins && farms.size() >= 1 && (farms.back() - ridge.at).norm() > 2600.0)
      continue;
    if (std::any_of(turbines.begin(), turbines.end(),
                    [&](const Point& other) { return (other - ridge.at).norm() < 380.0; }))
      continue;
    if (std::any_of(settlements.begin(), settlements.end(), [&](const Settlement& town) {
          return (town.center - ridge.at).norm() < town.radius_m + 650.0;
        }))
      continue;
    if (!builder.occupancy().is_free(ridge.at, 60.0)) continue;
    if (is_new) farms.push_back(ridge.at);
    turbines.push_back(ridge.at);
    builder.survey().add_point(Theme::Power, ridge.at,
                               {{"power", "generator"},
                                {"generator:source", "wind"},
                                {"generator:method", "wind_turbine"},
                                {"height:hub", "95"},
                                {"rotor:diameter", "110"}});
    builder.occupancy().add_line({ridge.at, ridge.at + Point(0.1, 0)}, 14.0, kPower);
  }
}

}  // namespace

void build_power(const PlanGround& ground, const std::vector<Settlement>& settlements,
                 Builder& builder) {
  if (settlements.empty()) return;
  Survey& survey = builder.survey();
  Occupancy& occupancy = builder.occupancy();
  const Settlement& city = settlements.front();
  const Point near = city.center + (city.radius_m + 700.0) * turned(Point::UnitX(), 0.4);
  if (const auto spot = builder.find_spot(near, Point::UnitX(), 300.0, 190.0, 4000.0, 10.0)) {
    const auto at = [&](double u, double v) {
      return Point(spot->center + u * spot->along + v * left_of(spot->along));
    };
    const auto box = [&](double u0, double u1, double v0, double v1) {
      return PointsWorld{at(u0, v0), at(u1, v0), at(u1, v1), at(u0, v1)};
    };
    survey.add_area(Theme::Power, spot->ring(),
                    {{"landuse", "industrial"},
                     {"power", "plant"},
                     {"plant:source", "gas"},
                     {"surface", "gravel"}});
    builder.build(box(-90, 0, -40, 10), HouseKind::Industrial, 0, 50.0, 0.0,
                  {{"height", "34"}, {"roof:shape", "flat"}});
    builder.build(box(6, 66, -34, 6), HouseKind::Industrial, 0, 40.0, 0.0,
                  {{"height", "22"}, {"roof:shape", "flat"}});
    for (int k = 0; k < 2; ++k) {
      const Point chimney = at(-60.0 + 44.0 * k, 26.0);
      survey.add_point(Theme::Power, chimney,
                       {{"man_made", "chimney"}, {"height", "110"}, {"diameter", "6"}});
      occupancy.add_line({chimney, chimney + Point(0.1, 0)}, 5.0, kBuilding);
    }
    for (int k = 0; k < 3; ++k) {
      const Point tank = at(100.0, -60.0 + 46.0 * k);
      survey.add_point(Theme::Power, tank,
                       {{"man_made", "storage_tank"}, {"diameter", "34"}, {"height", "14"}});
      occupancy.add_line({tank, tank + Point(0.1, 0)}, 19.0, kBuilding);
    }
    survey.add_area(Theme::Power, box(-130, -20, 48, 90),
                    {{"power", "substation"}, {"voltage", "220000"}, {"surface", "gravel"}});
    occupancy.add_ring(spot->ring(), kReserved);
    // Lines to the towns, round the settlements.
    RouteGrid net(ground, Grid<std::uint8_t>(ground.side(), ground.side()));
    RouteStyle style;
    style.steepest = 0.6;
    style.climb = 0.4;
    style.side_slope = 0.3;
    style.water = 2.0;
    style.water_reach_m = 260.0;
    style.reuse = 0.25;
    style.beside = 1.2;
    style.avoid = [&](const Point& place) {
      double factor = 1.0;
      for (const Settlement& town : settlements) {
        if (town.rank == Rank::Hamlet) break;
        if ((town.center - place).norm() < 1.15 * town.radius_m) factor = 5.0;
      }
      return occupancy.is_free(place, 40.0, kReserved) ? factor : 4.0 * factor;
    };
    const int from = net.node_at(at(0, 140.0));
    for (const Settlement& town : settlements) {
      if (town.rank > Rank::Town) break;
      const Point toward = (spot->center - town.center);
      const Point end =
          town.center + (1.05 * town.radius_m + 60.0) *
                            (toward.norm() > 1.0 ? Point(toward.normalized()) : Point::UnitX());
      const int to = net.node_at(end);
      if (to == from) continue;
      if (const auto nodes = net.route(from, to, style)) net.add(*nodes, 0);
    }
    for (const Alignment& line : alignments(net, ground)) {
      const PointsWorld towers = towers_along(line.line, builder);
      if (towers.size() < 2) continue;
      survey.add_line(Theme::Power, towers,
                      {{"power", "line"}, {"voltage", "110000"}, {"cables", "6"}});
      for (const Point& tower : towers) {
        survey.add_point(Theme::Power, tower, {{"power", "tower"}});
        occupancy.add_line({tower, tower + Point(0.1, 0)}, kTowerClear_m, kPower);
      }
      occupancy.add_line(towers, 11.0, kPower);
    }
  }
  add_wind_farms(ground, settlements, builder);
}

}  // namespace terracast::tiler::country
