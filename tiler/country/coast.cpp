#include "tiler/country/coast.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>

#include "core/random.h"

namespace terracast::tiler::country {
namespace {

constexpr std::uint64_t kStream = 0x636f617374;

/// The shore near a place, or nothing within reach.
std::optional<Shore> shore_near(const PlanGround& ground, const Point& near, double reach_m) {
  if (ground.sea_distance_m(near) > reach_m) return std::nullopt;
  Point at = near;
  const auto inland = [&](const Point& p) {
    return ground.sea_distance_m(p) - ground.land_distance_m(p);
  };
  const double h = 2.0 * ground.spacing_m();
  const auto uphill = [&](const Point& p) {
    return Point(inland(p + Point(h, 0)) - inland(p - Point(h, 0)),
                 inland(p + Point(0, h)) - inland(p - Point(0, h)));
  };
  for (int k = 0; k < 200 && ground.sea_distance_m(at) > ground.spacing_m(); ++k) {
    const Point gradient = uphill(at);
    if (gradient.norm() < 1e-6) return std::nullopt;
    at -= 0.5 * ground.spacing_m() * gradient.normalized();
    if (!ground.is_in_square(at, 400.0)) return std::nullopt;
  }
  const Point gradient = uphill(at);
  if (gradient.norm() < 1e-6) return std::nullopt;
  Shore shore;
  // The land is on the left of `along`.
  shore.along = -left_of(gradient.normalized());
  double on_land_m = -120.0, at_sea_m = 120.0;
  shore.at = at;
  if (ground.is_sea_at(shore.place(0, on_land_m)) || !ground.is_sea_at(shore.place(0, at_sea_m)))
    return std::nullopt;
  for (int k = 0; k < 9; ++k) {
    const double middle_m = 0.5 * (on_land_m + at_sea_m);
    (ground.is_sea_at(shore.place(0, middle_m)) ? at_sea_m : on_land_m) = middle_m;
  }
  shore.at = snapped(shore.place(0, on_land_m));
  return shore;
}

/// How far seaward the land reaches beside a shore's place; nothing beyond 100 m.
std::optional<double> land_edge_m(const PlanGround& ground, const Shore& shore, double along_m,
                                  double reach_m = 100.0) {
  double on_land_m = -reach_m, at_sea_m = reach_m;
  if (ground.is_sea_at(shore.place(along_m, on_land_m)) ||
      !ground.is_sea_at(shore.place(along_m, at_sea_m)))
    return std::nullopt;
  for (int k = 0; k < 8; ++k) {
    const double middle_m = 0.5 * (on_land_m + at_sea_m);
    (ground.is_sea_at(shore.place(along_m, middle_m)) ? at_sea_m : on_land_m) = middle_m;
  }
  return on_land_m;
}

bool is_all_sea(const PlanGround& ground, std::initializer_list<Point> places) {
  return std::all_of(places.begin(), places.end(), [&](const Point& at) {
    return ground.is_in_square(at, 20.0) && ground.is_sea_at(at);
  });
}

}  // namespace

std::optional<Port> choose_port(const PlanGround& ground,
                                const std::vector<Settlement>& settlements,
                                const Occupancy& occupancy) {
  for (const Settlement& town : settlements) {
    if (town.rank > Rank::Town || ground.sea_distance_m(town.center) > 7000.0) continue;
    for (const double half_m : {260.0, 170.0})
      for (int k = 0; k < 160; ++k) {
        // Outward, round and round: the golden angle's direction by repeated turning.
        const double away_m = 0.6 * town.radius_m + 40.0 * k;
        Point out = Point::UnitX();
        for (int turn = 0; turn < k % 13; ++turn) out = turned(out, 0.246);
        const Point near = town.center + away_m * out;
        if (!ground.is_in_square(near, 900.0) || ground.sea_distance_m(near) > 500.0 ||
            !ground.is_land_near(near))
          continue;
        auto shore = shore_near(ground, near, 700.0);
        if (!shore || !ground.is_in_square(shore->at, 900.0)) continue;
        double lowest_m = 1e9, highest_m = -1e9;
        bool is_straight = true;
        for (double u = -half_m; u <= half_m + 1.0 && is_straight; u += half_m / 4.0) {
          const auto edge_m = land_edge_m(ground, *shore, u, 140.0);
          is_straight = edge_m.has_value();
          if (edge_m)
            lowest_m = std::min(lowest_m, *edge_m), highest_m = std::max(highest_m, *edge_m);
        }
        if (!is_straight || highest_m - lowest_m > 70.0) continue;
        shore->at = snapped(shore->place(0.0, lowest_m));
        const PointsWorld yard = shore->box(-half_m, half_m, -190.0, -2.0);
        if (ground.rise_m(yard) > 12.0 || !ground.is_dry(shore->box(-half_m, half_m, -330.0, -3.0)))
          continue;
        if (!is_all_sea(ground, {shore->place(-half_m, 150.0), shore->place(0, 150.0),
                                 shore->place(half_m, 150.0), shore->place(0, 500.0)}))
          continue;
        if (!occupancy.is_free(shore->box(-half_m - 20, half_m + 20, -340.0, 80.0), 10.0)) continue;
        bool is_off_towns = true;
        for (const Settlement& other : settlements)
          is_off_towns = is_off_towns && (other.center - shore->place(0, -150)).norm() >
                                             0.55 * other.radius_m + 420.0;
        if (!is_off_towns) continue;
        return Port{*shore, half_m, shore->place(0.0, -420.0)};
      }
  }
  return std::nullopt;
}

void build_port(const Port& port, Builder& builder) {
  const Shore& shore = port.shore;
  const double half_m = port.half_length_m;
  Survey& survey = builder.survey();
  survey.add_area(Theme::Harbour, shore.box(-half_m - 15, half_m + 15, -22.0, 14.0),
                  {{"man_made", "quay"}, {"surface", "concrete"}});
  survey.add_area(
      Theme::Harbour, shore.box(-half_m, half_m, -195.0, 10.0),
      {{"landuse", "industrial"}, {"industrial", "container_terminal"}, {"surface", "concrete"}});
  const int count = static_cast<int>(2.0 * half_m / 100.0);
  for (int k = 0; k < count; ++k) {
    const double u = -half_m + 4.0 + 2.0 * half_m * k / count;
    builder.build(shore.box(u, u + 84.0, -262.0, -215.0), HouseKind::Warehouse, 0, 47.0, 0.0);
    if (k != count / 2)
      builder.build(shore.box(u, u + 70.0, -325.0, -286.0), HouseKind::Warehouse, 0, 39.0, 0.0);
  }
  for (int k = 0; k < 6; ++k) {
    const Point tank =
        shore.place(half_m + 60.0 + 48.0 * (k % 2), -70.0 - 52.0 * static_cast<double>(k / 2));
    if (builder.ground().is_dry(
            {tank + Point(22, 0), tank + Point(0, 22), tank - Point(22, 0), tank - Point(0, 22)}) &&
        builder.occupancy().is_free(tank, 24.0)) {
      survey.add_point(Theme::Harbour, tank,
                       {{"man_made", "storage_tank"}, {"diameter", "36"}, {"height", "15"}});
      builder.occupancy().add_line({tank, tank + Point(0.1, 0)}, 21.0, kReserved);
    }
  }
  builder.occupancy().add_ring(shore.box(-half_m - 20, half_m + 20, -338.0, 60.0), kReserved);
}

std::vector<PointsWorld> port_roads(const Port& port, const Point& outside) {
  const double half_m = port.half_length_m;
  const int count = static_cast<int>(2.0 * half_m / 100.0);
  // The place in the second row of sheds that is left free.
  const double u = -half_m + 39.0 + 2.0 * half_m * static_cast<double>(count / 2) / count;
  const Point inside = snapped(port.shore.place(u, -274.0));
  return {{outside, port.shore.place(u, -345.0), inside},
          {port.shore.place(-half_m, -274.0), inside, port.shore.place(half_m, -274.0)}};
}

void build_harbours(const std::vector<Settlement>& settlements, Builder& builder) {
  const PlanGround& ground = builder.ground();
  Survey& survey = builder.survey();
  int count = 0;
  for (const Settlement& town : settlements) {
    if (town.rank == Rank::Hamlet || count >= 24) continue;
    const auto shore = shore_near(ground, town.center,
                                  town.radius_m + (town.rank == Rank::Village ? 350.0 : 1200.0));
    if (!shore) continue;
    const double size = town.rank == Rank::Village ? 0.55 : town.rank == Rank::Town ? 1.0 : 1.25;
    const auto at = [&](double u, double v) { return shore->place(size * u, size * v); };
    if (!is_all_sea(ground, {at(-170, 130), at(-120, 230), at(10, 255), at(110, 215), at(170, 130),
                             at(0, 90), at(-90, 60), at(90, 60)}))
      continue;
    if (!builder.occupancy().is_free(shore->box(-210 * size, 210 * size, -40.0, 270 * size), 5.0))
      continue;
    ++count;
    const Tags mole{{"man_made", "breakwater"}, {"width", "9"}, {"surface", "concrete"}};
    survey.add_line(Theme::Harbour,
                    {at(-190, -12), at(-196, 110), at(-150, 205), at(-60, 250), at(15, 255)}, mole);
    survey.add_line(Theme::Harbour, {at(195, -12), at(192, 120), at(150, 190), at(95, 215)}, mole);
    survey.add_point(
        Theme::Harbour, at(15, 255),
        {{"man_made", "lighthouse"}, {"height", "12"}, {"seamark:type", "light_minor"}});
    survey.add_area(Theme::Harbour, shore->box(-150 * size, 150 * size, -16.0, 14.0),
                    {{"man_made", "quay"}, {"surface", "concrete"}});
    survey.add_line(Theme::Harbour, {at(-150, 8), at(-150, 95)},
                    {{"man_made", "pier"}, {"width", "6"}});
    survey.add_line(Theme::Harbour, {at(150, 8), at(150, 85)},
                    {{"man_made", "pier"}, {"width", "6"}});
    survey.add_area(Theme::Harbour, shore->box(-125 * size, 125 * size, 22.0, 165.0 * size),
                    {{"leisure", "marina"}});
    for (int k = 0; k < static_cast<int>(7 * size); ++k)
      survey.add_point(Theme::Harbour, at(-100.0 + 34.0 * k, 190.0 + 12.0 * (k % 2)),
                       {{"seamark:type", "mooring"}});
    survey.add_point(Theme::Harbour, at(-130, 20 / size + 12), {{"ship", "fishing"}});
    survey.add_point(Theme::Harbour, at(-166, 60), {{"ship", "fishing"}});
    for (int k = 0; k < static_cast<int>(8 * size); ++k)
      builder.build(shore->box(-140 * size + 34.0 * k, -140 * size + 34.0 * k + 24.0, -40.0, -24.0),
                    HouseKind::Warehouse, town.palette, 16.0, 0.0,
                    {{"building", "boathouse"}, {"height", "6.5"}, {"roof:shape", "gabled"}});
    builder.occupancy().add_ring(shore->box(-155 * size, 155 * size, -46.0, 12.0), kReserved);
  }
}

void add_shore_features(const std::vector<Settlement>& settlements, Builder& builder) {
  const PlanGround& ground = builder.ground();
  Survey& survey = builder.survey();
  const int stride = std::max(static_cast<int>(96.0 / ground.spacing_m()), 1);
  int num_lighthouses = 0;
  std::vector<Point> lights, beaches;
  const double square_km2 = 4e-6 * ground.half_size_m() * ground.half_size_m();
  const int most_lights = 1 + static_cast<int>(square_km2 / 260.0);
  for (int j = stride; j + stride < ground.side(); j += stride)
    for (int i = stride; i + stride < ground.side(); i += stride) {
      const Point node = ground.place(i, j);
      const double sea_m = ground.sea_distance_m(node);
      if (sea_m <= 0.0 || sea_m > 1.6 * stride * ground.spacing_m() ||
          !ground.is_in_square(node, 500.0))
        continue;
      const auto key = static_cast<std::uint64_t>(j) << 32 | static_cast<std::uint64_t>(i);
      // Headlands: mostly sea round about.
      int num_sea = 0;
      for (const Point& way :
           {Point(1, 0), Point(0, 1), Point(-1, 0), Point(0, -1), Point(0.7, 0.7), Point(-0.7, 0.7),
            Point(0.7, -0.7), Point(-0.7, -0.7)})
        num_sea += ground.sea_distance_m(node + 450.0 * way) <= 0.0 ? 1 : 0;
      if (num_sea >= 6 && num_lighthouses < most_lights && ground.slope(node) < 0.35 &&
          builder.occupancy().is_free(node, 14.0) && !ground.is_sea_at(node) &&
          std::none_of(lights.begin(), lights.end(),
                       [&](const Point& other) { return (other - node).norm() < 7000.0; })) {
        survey.add_point(
            Theme::Harbour, node,
            {{"man_made", "lighthouse"}, {"height", "28"}, {"seamark:type", "light_major"}});
        builder.occupancy().add_line({node, node + Point(0.1, 0)}, 6.0, kReserved);
        lights.push_back(node);
        ++num_lighthouses;
      }
      if (ground.slope(node) > 0.09 || core::random_unit(builder.draw(), kStream, key) > 0.3)
        continue;
      if (std::any_of(beaches.begin(), beaches.end(),
                      [&](const Point& other) { return (other - node).norm() < 420.0; }))
        continue;
      const auto shore = shore_near(ground, node, 400.0);
      if (!shore) continue;
      // The beach runs both ways as far as the shore is smooth and low.
      PointsWorld sea_side, land_side;
      constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
      double before_m = kNone;
      const double half_m = core::random_between(110.0, 330.0, builder.draw(), kStream + 1, key);
      for (double u = -half_m; u <= half_m; u += 15.0) {
        const auto edge_m = land_edge_m(ground, *shore, u);
        if (!edge_m || std::abs(*edge_m - before_m) > 14.0) {
          if (u > 0.0) break;
          sea_side.clear(), land_side.clear(), before_m = kNone;
          continue;
        }
        before_m = *edge_m;
        const double taper = std::min(1.0, 0.15 + 1.6 * (1.0 - std::abs(u) / half_m));
        sea_side.push_back(shore->place(u, *edge_m + 1.0));
        land_side.push_back(shore->place(
            u, *edge_m - taper * core::random_between(
                                     22.0, 34.0, builder.draw(), kStream + 2,
                                     key + static_cast<std::uint64_t>(u + half_m) * 7919)));
      }
      if (sea_side.size() < 8) continue;
      PointsWorld ring(sea_side.begin(), sea_side.end());
      ring.insert(ring.end(), land_side.rbegin(), land_side.rend());
      for (Point& corner : ring) corner = snapped(corner);
      if (signed_area(ring) < 0.0) std::reverse(ring.begin(), ring.end());
      if (!is_simple(ring) || !builder.occupancy().is_free(ring, 1.0) || ground.rise_m(ring) > 14.0)
        continue;
      survey.add_area(
          Theme::Harbour, ring,
          {{"natural", "beach"},
           {"surface",
            core::random_unit(builder.draw(), kStream + 3, key) < 0.75 ? "sand" : "pebblestone"}});
      builder.occupancy().add_ring(ring, kReserved);
      beaches.push_back(node);
    }
  // Ships: some under way, some at anchor off the ports.
  constexpr const char* kShips[] = {"cargo", "fishing", "tanker", "container", "sailing",
                                    "bulk",  "fishing", "ferry",  "yacht",     "sailing"};
  const int wanted = static_cast<int>(square_km2 / 22.0) + 4;
  int num_ships = 0;
  for (int k = 0; k < 12 * wanted && num_ships < wanted; ++k) {
    const auto index = static_cast<std::uint64_t>(k);
    const Point at(
        ground.half_size_m() * (2.0 * core::random_unit(builder.draw(), kStream + 4, index) - 1.0),
        ground.half_size_m() * (2.0 * core::random_unit(builder.draw(), kStream + 5, index) - 1.0));
    const char* ship =
        kShips[core::random_bits(builder.draw(), kStream + 6, index) % std::size(kShips)];
    const bool is_small = std::string_view(ship) == "sailing" ||
                          std::string_view(ship) == "yacht" || std::string_view(ship) == "fishing";
    if (!ground.is_in_square(at, 300.0) ||
        ground.land_distance_m(at) < (is_small ? 250.0 : 900.0) || !ground.is_sea_at(at))
      continue;
    if (is_small && ground.land_distance_m(at) > 5000.0) continue;
    survey.add_point(
        Theme::Harbour, at,
        {{"ship", ship},
         {"direction",
          fmt::format("{}", core::random_bits(builder.draw(), kStream + 7, index) % 360)}});
    ++num_ships;
  }
  static_cast<void>(settlements);
}

}  // namespace terracast::tiler::country
