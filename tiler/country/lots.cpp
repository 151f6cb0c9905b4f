#include "tiler/country/lots.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/random.h"
#include "tiler/country/industry.h"
#include "tiler/country/zones.h"

namespace terracast::tiler::country {
namespace {

using core::random_unit;

constexpr double kPavement_m = 2.2;
constexpr double kLargestBlock_m2 = 90000.0;
constexpr double kLargestQuarter_m2 = 400000.0;  ///< of industry

struct HouseRule {
  HouseKind kind;
  double frontage_m, width_m, depth_m, setback_m, margin_m;
};

HouseRule house_rule(Zone zone, Rank rank, std::uint64_t draw) {
  const double u = random_unit(draw, 1, 0);
  const double size = 0.88 + 0.3 * random_unit(draw, 2, 0);
  switch (zone) {
    case Zone::Center:
    case Zone::Dense:
      return {HouseKind::OldTown, 13.0 * size, 12.8 * size, 11.0, 0.6, 0.05};
    case Zone::Mixed:
      if (u < 0.45) return {HouseKind::Terrace, 8.6, 8.45, 10.0, 3.5, 0.05};
      if (u < 0.75) return {HouseKind::SemiDetached, 20.0 * size, 14.5 * size, 10.0, 4.0, 1.4};
      return {HouseKind::Apartments, 30.0 * size, 22.0 * size, 12.5, 5.0, 2.5};
    case Zone::Slabs:
      return {HouseKind::Slab, 52.0 * size, 40.0 * size, 12.0, 8.0, 6.0};
    case Zone::Business:
      return {HouseKind::Office, 46.0 * size, 36.0 * size, 22.0, 4.0, 4.0};
    case Zone::Industry:
      TERRACAST_CHECK(false, "industry is parted into plots, not houses");
      break;
    case Zone::Houses:
      break;
  }
  // Plots were parted and built on by many hands: no two houses are alike, and in villages hardly two
  // stand as far from the road.
  const bool is_rural = rank == Rank::Village || rank == Rank::Hamlet;
  const double far = random_unit(draw, 3, 0);
  const double wide = random_unit(draw, 4, 0);
  if (rank == Rank::Village && u < 0.25)
    return {HouseKind::Terrace, 13.0 + 9.0 * wide,
            11.0 + 7.0 * wide,  8.5 + 2.5 * random_unit(draw, 5, 0),
            1.0 + 2.5 * far,    0.9};
  const double width_m = 9.5 + 6.5 * wide;
  return {HouseKind::Detached,
          width_m + (rank == Rank::Hamlet ? 20.0 : 7.0) + (is_rural ? 14.0 : 8.0) * far * far,
          width_m,
          8.0 + 3.2 * random_unit(draw, 5, 0),
          is_rural ? 2.0 + 13.0 * far * far : 3.5 + 5.0 * far,
          2.2};
}

/// A house's outline within its rectangle: plain, or with a wing.
PointsWorld outline(const Rectangle& box, std::uint64_t draw, double share_of_wings) {
  if (random_unit(draw, 11, 0) >= share_of_wings) return box.ring();
  const double a = -0.1 + 0.35 * random_unit(draw, 12, 0);
  const double b = -0.15 + 0.35 * random_unit(draw, 13, 0);
  if (random_unit(draw, 14, 0) < 0.7) {
    if (random_unit(draw, 15, 0) < 0.5)
      return {box.at(-1, -1), box.at(1, -1), box.at(1, 1),
              box.at(a, 1),   box.at(a, b),  box.at(-1, b)};
    return {box.at(-1, -1), box.at(1, -1), box.at(1, b),
            box.at(-a, b),  box.at(-a, 1), box.at(-1, 1)};
  }
  return {box.at(-1, -1), box.at(1, -1),   box.at(1, b),    box.at(0.4, b),
          box.at(0.4, 1), box.at(-0.4, 1), box.at(-0.4, b), box.at(-1, b)};
}

class SettlementBuilder {
 public:
  SettlementBuilder(Builder& builder, const std::vector<TownShape>& shapes, std::uint64_t seed)
      : builder_(builder),
        shapes_(shapes),
        seed_(seed),
        index_(builder.ground().half_size_m(), 256.0) {
    for (std::size_t k = 0; k < shapes.size(); ++k) {
      const Settlement& town = shapes[k].settlement();
      const double reach_m = std::max(1.8 * town.radius_m, 160.0);
      index_.add(static_cast<std::int32_t>(k), town.center.array() - reach_m,
                 town.center.array() + reach_m);
    }
  }

  const TownShape* shape_at(const Point& at) {
    index_.find(at, at, found_);
    const TownShape* best = nullptr;
    double least = 1.06;
    for (const std::int32_t k : found_) {
      const TownShape& shape = shapes_[static_cast<std::size_t>(k)];
      if (const double far = shape.at(at); far < least) {
        least = far;
        best = &shape;
      }
    }
    return best;
  }

  /// What a settlement has one of, or few.
  void build_landmarks(const TownShape& shape) {
    const Settlement& town = shape.settlement();
    if (town.rank == Rank::Hamlet) {
      if (random_unit(builder_.draw(), 1, 0) < 0.25) build_church(town, 16.0, 8.0);
      return;
    }
    const double people = town.population;
    if (town.rank != Rank::Village)
      place_area(
          town, 64.0, 44.0, 0.0, 0.4,
          {{"place", "square"}, {"highway", "pedestrian"}, {"area", "yes"}, {"surface", "sett"}},
          Theme::Road, 1.0);
    build_church(town, town.rank == Rank::Village ? 26.0 : 40.0,
                 town.rank == Rank::Village ? 12.0 : 18.0);
    place_house(town, HouseKind::Civic, 30.0, 16.0, 0.0, 1.5);
    for (int k = 0; k < static_cast<int>(people / 3500.0) + 1; ++k) build_school(town, k);
    for (int k = 0; k < static_cast<int>(people / 6000.0) + (people > 1200 ? 1 : 0); ++k)
      build_shop(town, k);
    const int num_parks = static_cast<int>(people / 4000.0) + (people > 2500 ? 1 : 0);
    for (int k = 0; k < num_parks; ++k)
      place_area(town, 60.0 + 70.0 * random_unit(builder_.draw(), 4, 0), 55.0,
                 0.15 + 0.6 * k / num_parks, 0.7, {{"leisure", "park"}}, Theme::Leisure, 3.0);
    place_area(town, 58.0 + 8.0 * std::sqrt(people / 1000.0), 42.0, 0.8, 0.8,
               {{"landuse", "cemetery"}}, Theme::LandUse, 3.0);
    const int num_pitches = static_cast<int>(people / 5000.0) + 1;
    for (int k = 0; k < num_pitches; ++k)
      if (people > 700)
        place_area(town, 105.0, 68.0, 0.85, 0.8,
                   {{"leisure", "pitch"}, {"sport", "soccer"}, {"surface", "grass"}},
                   Theme::Leisure, 4.0);
    if (town.rank == Rank::City) {
      build_stadium(town);
      for (int k = 0; k < 3; ++k)
        place_area(town, 320.0, 220.0, 0.3 + 0.2 * k, 0.9, {{"leisure", "park"}}, Theme::Leisure,
                   4.0);
    }
  }

  void fill_block(const Block& whole) {
    const Block block = tidied(whole, 2.5);
    if (block.ring.size() < 3 || block.area_m2 < 700.0 || block.area_m2 > kLargestQuarter_m2)
      return;
    Point middle = Point::Zero();
    for (const Point& corner : block.ring)
      middle += corner / static_cast<double>(block.ring.size());
    const TownShape* shape = shape_at(middle);
    if (shape == nullptr || shape->settlement().rank == Rank::Hamlet) return;
    const Zone zone = zone_of(shape->settlement(), middle, shape->at(middle), seed_);
    const int palette = shape->settlement().palette;
    if (zone == Zone::Industry) return fill_industry(block, palette, builder_);
    if (block.area_m2 > kLargestBlock_m2) return;
    if (zone == Zone::Center || zone == Zone::Dense)
      build_perimeter(block,
                      zone == Zone::Center && shape->settlement().rank != Rank::City
                          ? HouseKind::OldTown
                      : zone == Zone::Center ? HouseKind::OldTown
                                             : HouseKind::Apartments,
                      palette);
    else if (zone == Zone::Slabs)
      fill_rows(block, HouseKind::Slab, 48.0, 12.0, 34.0, 14.0, palette);
    else if (zone == Zone::Business)
      build_business(block, palette);
  }

  /// Houses along the edges of a face, each facing its road.
  void line_edges(const Block& block) {
    const std::size_t n = block.ring.size();
    std::size_t begin = 0;
    while (begin < n) {
      // A frontage runs to the next corner.
      PointsWorld front{block.ring[begin]};
      const double half_width_m = block.half_width_m(begin);
      const RoadKind kind = block.kinds[begin];
      std::size_t k = begin;
      for (; k < n; ++k) {
        const Point& to = block.ring[(k + 1) % n];
        if (front.size() >= 2) {
          const Point before = (front.back() - front[front.size() - 2]).normalized();
          if (before.dot((to - front.back()).normalized()) < 0.8 || block.kinds[k] != kind) break;
        }
        front.push_back(to);
      }
      begin = k;
      if (kind != RoadKind::Track && kind != RoadKind::Motorway && kind != RoadKind::MotorwayLink)
        line_front(front, half_width_m);
    }
  }

 private:
  Point spot_center(const Settlement& town, double far) {
    const std::uint64_t draw = builder_.draw();
    const Point out = turned(Point(random_unit(draw, 1, 0) < 0.5 ? 1.0 : -1.0, 0.0),
                             2.0 * random_unit(draw, 2, 0) - 1.0);
    return town.center + far * town.radius_m * out;
  }

  bool place_area(const Settlement& town, double length_m, double depth_m, double far, double reach,
                  Tags tags, Theme theme, double margin_m) {
    const Point near = spot_center(town, far);
    const auto spot = builder_.find_spot(near, street_direction(near), length_m, depth_m,
                                         std::max(reach * town.radius_m, 150.0), margin_m);
    return spot && builder_.reserve(spot->ring(), margin_m, theme, std::move(tags));
  }

  bool place_house(const Settlement& town, HouseKind kind, double length_m, double depth_m,
                   double far, double margin_m, Tags more = {}) {
    const Point near = spot_center(town, far);
    const auto spot = builder_.find_spot(near, street_direction(near), length_m, depth_m,
                                         std::max(0.7 * town.radius_m, 150.0), margin_m);
    return spot &&
           builder_.build(spot->ring(), kind, town.palette, depth_m, margin_m, std::move(more));
  }

  Point street_direction(const Point&) {
    return turned(Point::UnitX(), 2.0 * random_unit(builder_.draw(), 9, 0) - 1.0);
  }

  void build_church(const Settlement& town, double length_m, double width_m) {
    const Point near = spot_center(town, 0.04);
    // Choirs look east, more or less.
    const auto spot = builder_.find_spot(near, turned(Point::UnitX(), 0.12), length_m + 8.0,
                                         width_m + 6.0, std::max(0.8 * town.radius_m, 140.0), 2.0);
    if (!spot) return;
    const double tower_m = 0.5 * width_m;
    const double nave_m = length_m - tower_m;
    Rectangle nave{spot->center + 0.5 * (tower_m + 0.2) * spot->along, spot->along, 0.5 * nave_m,
                   0.5 * width_m};
    Rectangle tower{spot->center - 0.5 * (nave_m + 0.2) * spot->along, spot->along, 0.5 * tower_m,
                    0.5 * tower_m};
    const double height_m = 0.75 * width_m + 3.0;
    // The nave has a choir, narrower, at its far end.
    const PointsWorld plan{nave.at(-1, -1), nave.at(0.6, -1),  nave.at(0.6, -0.6), nave.at(1, -0.6),
                           nave.at(1, 0.6), nave.at(0.6, 0.6), nave.at(0.6, 1),    nave.at(-1, 1)};
    const std::uint64_t draw = builder_.draw();
    if (builder_.build(plan, HouseKind::Church, town.palette, width_m, 0.0,
                       {{"height", text_of(height_m + 0.5 * width_m)}}))
      builder_.build(tower.ring(), HouseKind::Church, town.palette, tower_m, 0.0,
                     {{"height", text_of(2.1 * height_m + 4.0)},
                      {"roof:shape", random_unit(draw, 1, 0) < 0.7 ? "pyramidal" : "dome"},
                      {"tower:type", "bell_tower"}});
  }

  void build_school(const Settlement& town, int k) {
    const Point near = spot_center(town, 0.3 + 0.12 * (k % 5));
    const auto spot =
        builder_.find_spot(near, street_direction(near), 96.0, 62.0, town.radius_m, 2.0);
    if (!spot) return;
    const Point across = left_of(spot->along);
    Rectangle house{spot->center - 14.0 * across, spot->along, 36.0, 15.0};
    const PointsWorld plan{house.at(-1, -1),   house.at(1, -1),      house.at(1, 1),
                           house.at(0.65, 1),  house.at(0.65, -0.2), house.at(-0.65, -0.2),
                           house.at(-0.65, 1), house.at(-1, 1)};
    if (!builder_.build(plan, HouseKind::School, town.palette, 12.0, 1.0)) return;
    builder_.reserve(Rectangle{spot->center + 17.0 * across, spot->along, 20.0, 10.0}.ring(), 1.0,
                     Theme::Leisure,
                     {{"leisure", "pitch"}, {"sport", "basketball"}, {"surface", "tartan"}});
  }

  void build_shop(const Settlement& town, int k) {
    const Point near = spot_center(town, 0.55 + 0.1 * (k % 4));
    const auto spot =
        builder_.find_spot(near, street_direction(near), 74.0, 92.0, town.radius_m, 2.0);
    if (!spot) return;
    const Point across = left_of(spot->along);
    if (!builder_.build(Rectangle{spot->center + 24.0 * across, spot->along, 32.0, 20.0}.ring(),
                        HouseKind::Retail, town.palette, 40.0, 1.0, {{"shop", "supermarket"}}))
      return;
    builder_.reserve(Rectangle{spot->center - 22.0 * across, spot->along, 34.0, 21.0}.ring(), 1.0,
                     Theme::Road, {{"amenity", "parking"}, {"surface", "asphalt"}});
  }

  void build_stadium(const Settlement& town) {
    const Point near = spot_center(town, 0.6);
    const auto spot =
        builder_.find_spot(near, street_direction(near), 250.0, 190.0, town.radius_m, 4.0);
    if (!spot) return;
    // Four stands round a pitch; the corners are open.
    const Point across = left_of(spot->along);
    builder_.reserve(Rectangle{spot->center, spot->along, 52.5, 34.0}.ring(), 0.0, Theme::Leisure,
                     {{"leisure", "pitch"}, {"sport", "soccer"}, {"surface", "grass"}});
    for (const double side : {-1.0, 1.0}) {
      builder_.build(Rectangle{spot->center + side * 52.0 * across, spot->along, 56.0, 13.0}.ring(),
                     HouseKind::Civic, 1, 26.0, 0.5,
                     {{"building", "stadium"},
                      {"height", "18"},
                      {"roof:shape", "flat"},
                      {"roof:colour", "#d9dcde"},
                      {"building:material", "concrete"},
                      {"building:colour", "#c9cbcc"}});
      builder_.build(Rectangle{spot->center + side * 72.0 * spot->along, across, 34.0, 11.0}.ring(),
                     HouseKind::Civic, 1, 22.0, 0.5,
                     {{"building", "stadium"},
                      {"height", "15"},
                      {"roof:shape", "flat"},
                      {"roof:colour", "#d9dcde"},
                      {"building:material", "concrete"},
                      {"building:colour", "#c9cbcc"}});
      builder_.reserve(
          Rectangle{spot->center + side * 88.0 * across, spot->along, 70.0, 9.0}.ring(), 0.5,
          Theme::Road, {{"amenity", "parking"}, {"surface", "asphalt"}});
    }
  }

  std::optional<PointsWorld> building_line(const Block& block, double more_m) const {
    std::vector<double> inward;
    for (std::size_t k = 0; k < block.ring.size(); ++k)
      inward.push_back(block.half_width_m(k) + kPavement_m + more_m);
    return inset(block.ring, inward);
  }

  bool build_perimeter(const Block& block, HouseKind kind, int palette) {
    const auto outer = building_line(block, 0.0);
    if (!outer || signed_area(*outer) < 150.0) return false;
    const std::size_t n = outer->size();
    const double depth_m = kind == HouseKind::OldTown ? 11.0 : 12.5;
    const auto inner = inset(*outer, std::vector<double>(n, depth_m));
    if (!inner || signed_area(*inner) < 60.0) {
      if (signed_area(*outer) < 900.0) return builder_.build(*outer, kind, palette, 14.0, 0.0);
      return false;
    }
    // Where the houses of an edge begin and end: past the corner houses, which turn.
    struct Cut {
      double outer_m, inner_m;
    };
    std::vector<Cut> begins(n), ends(n);
    std::vector<bool> is_corner(n);
    for (std::size_t k = 0; k < n; ++k) {
      const Point before = ((*outer)[k] - (*outer)[(k + n - 1) % n]).normalized();
      const Point after = ((*outer)[(k + 1) % n] - (*outer)[k]).normalized();
      is_corner[k] = before.dot(after) < 0.9;
    }
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t next = (k + 1) % n;
      const Point along = ((*outer)[next] - (*outer)[k]).normalized();
      const double outer_m = ((*outer)[next] - (*outer)[k]).norm();
      const double inner_m = ((*inner)[next] - (*inner)[k]).norm();
      const double lead_m = ((*inner)[k] - (*outer)[k]).dot(along);
      const double trail_m = ((*outer)[next] - (*inner)[next]).dot(along);
      begins[k] = is_corner[k]
                      ? Cut{std::max(lead_m, 6.0) + 4.0, std::max(lead_m, 6.0) + 4.0 - lead_m}
                      : Cut{0.0, 0.0};
      ends[k] = is_corner[next] ? Cut{outer_m - std::max(trail_m, 6.0) - 4.0,
                                      inner_m - (std::max(trail_m, 6.0) + 4.0 - trail_m)}
                                : Cut{outer_m, inner_m};
      if (ends[k].outer_m < begins[k].outer_m + 5.0 || ends[k].inner_m < begins[k].inner_m + 3.0)
        return false;
    }
    constexpr double kGap_m = 0.08;
    for (std::size_t k = 0; k < n; ++k) {
      const std::size_t next = (k + 1) % n;
      const Point along = ((*outer)[next] - (*outer)[k]).normalized();
      const auto on_outer = [&](double m) -> Point { return (*outer)[k] + m * along; };
      const auto on_inner = [&](double m) -> Point { return (*inner)[k] + m * along; };
      if (is_corner[k]) {
        const std::size_t before = (k + n - 1) % n;
        const Point back = ((*outer)[k] - (*outer)[before]).normalized();
        builder_.build({(*outer)[before] + (ends[before].outer_m + kGap_m) * back, (*outer)[k],
                        on_outer(begins[k].outer_m - kGap_m), on_inner(begins[k].inner_m - kGap_m),
                        (*inner)[k], (*inner)[before] + (ends[before].inner_m + kGap_m) * back},
                       kind, palette, depth_m, 0.0);
      }
      const double length = ends[k].outer_m - begins[k].outer_m;
      const int count = std::max(
          static_cast<int>(std::round(length / (12.5 + 6.0 * random_unit(builder_.draw(), 1, 0)))),
          1);
      for (int house = 0; house < count; ++house) {
        const double from = static_cast<double>(house) / count, to = (house + 1.0) / count;
        const auto outer_at = [&](double t) { return begins[k].outer_m + t * length; };
        const auto inner_at = [&](double t) {
          return begins[k].inner_m + t * (ends[k].inner_m - begins[k].inner_m);
        };
        builder_.build({on_outer(outer_at(from) + kGap_m), on_outer(outer_at(to) - kGap_m),
                        on_inner(inner_at(to) - kGap_m), on_inner(inner_at(from) + kGap_m)},
                       kind, palette, depth_m, 0.0);
      }
    }
    if (const auto yard = inset(*inner, std::vector<double>(n, 1.0));
        yard && signed_area(*yard) > 400.0) {
      if (random_unit(builder_.draw(), 2, 0) < 0.3)
        builder_.reserve(*yard, 0.0, Theme::Road, {{"amenity", "parking"}, {"surface", "asphalt"}});
      else
        builder_.reserve(*yard, 0.0, Theme::Leisure, {{"leisure", "garden"}});
    }
    return true;
  }

  /// Rows of like buildings with room between.
  void fill_rows(const Block& block, HouseKind kind, double length_m, double depth_m,
                 double between_rows_m, double between_m, int palette) {
    const auto line = building_line(block, 5.0);
    if (!line) return;
    const Point along = longest_edge(block), across = left_of(along);
    double low_u = 1e9, high_u = -1e9, low_v = 1e9, high_v = -1e9;
    for (const Point& corner : *line) {
      low_u = std::min(low_u, corner.dot(along)), high_u = std::max(high_u, corner.dot(along));
      low_v = std::min(low_v, corner.dot(across)), high_v = std::max(high_v, corner.dot(across));
    }
    for (double v = low_v + 0.5 * depth_m + 0.5; v + 0.5 * depth_m < high_v;
         v += depth_m + between_rows_m)
      for (double u = low_u + 0.5 * length_m + 0.5; u + 0.5 * length_m < high_u;) {
        const double size = 0.8 + 0.2 * random_unit(builder_.draw(), 1, 0);
        const Rectangle box{u * along + v * across, along, 0.5 * length_m * size, 0.5 * depth_m};
        if (!is_within(box.ring(), *line)) {
          u += 6.0;
          continue;
        }
        builder_.build(box.ring(), kind, palette, depth_m, 2.0);
        u += length_m + between_m;
      }
  }

  void build_business(const Block& block, int palette) {
    const auto line = building_line(block, 3.0);
    if (!line) return;
    Point middle = Point::Zero();
    for (const Point& corner : *line) middle += corner / static_cast<double>(line->size());
    const double half_m = std::min(0.26 * std::sqrt(std::max(signed_area(*line), 0.0)), 21.0);
    const Rectangle tower{middle, longest_edge(block),
                          half_m * (0.8 + 0.3 * random_unit(builder_.draw(), 1, 0)), half_m};
    if (half_m > 9.0 && is_within(tower.ring(), *line))
      builder_.build(
          tower.ring(),
          random_unit(builder_.draw(), 2, 0) < 0.6 ? HouseKind::Tower : HouseKind::Office, palette,
          half_m, 1.0);
    fill_rows(block, HouseKind::Office, 34.0, 16.0, 14.0, 10.0, palette);
  }

  void line_front(const PointsWorld& front, double half_width_m) {
    const double length = length_of(front);
    double at_m = half_width_m + 4.0;
    while (at_m + 8.0 < length) {
      const Station here = station_at(front, at_m);
      const TownShape* shape = shape_at(here.at);
      if (shape == nullptr) {
        at_m += 25.0;
        continue;
      }
      const Settlement& town = shape->settlement();
      const double far = shape->at(here.at);
      const Zone zone = zone_of(town, here.at, far, seed_);
      const std::uint64_t draw = builder_.draw();
      // Towards the rim some lots are still fields.
      const bool is_rural = town.rank == Rank::Village || town.rank == Rank::Hamlet;
      if (random_unit(draw, 21, 0) < (is_rural ? 0.08 : 0.02) + 0.75 * std::max(far - 0.68, 0.0)) {
        at_m += 14.0 + 18.0 * random_unit(draw, 20, 0);
        continue;
      }
      if (zone == Zone::Industry) {
        const double wide_m = build_plot_at(front, at_m, half_width_m, town.palette, builder_);
        at_m += wide_m > 0.0 ? wide_m : 9.0;
        continue;
      }
      const HouseRule rule = house_rule(zone, town.rank, draw);
      const Station there = station_at(front, at_m + rule.frontage_m);
      if (at_m + rule.frontage_m > length) {
        at_m += 0.25 * rule.frontage_m + 2.0;
        if (rule.frontage_m > 20.0) continue;
        break;
      }
      const Point chord = there.at - here.at;
      if (chord.norm() < 0.85 * rule.frontage_m) {
        at_m += 4.0;
        continue;
      }
      const Point along = chord.normalized();
      const double off_m = half_width_m + kPavement_m + rule.setback_m + 0.5 * rule.depth_m;
      Rectangle box{0.5 * (here.at + there.at) + off_m * left_of(along), along, 0.5 * rule.width_m,
                    0.5 * rule.depth_m};
      const bool is_house =
          rule.kind == HouseKind::Detached || rule.kind == HouseKind::SemiDetached;
      if (is_house && random_unit(draw, 22, 0) < 0.4)
        std::swap(box.half_along_m, box.half_across_m);
      // Hardly two houses stand in one line; in villages less so than in streets that were planned.
      if (is_house) {
        const double most = is_rural ? 0.22 : 0.06;
        box.along = turned(box.along, most * (2.0 * random_unit(draw, 25, 0) - 1.0));
        box.center += 3.0 * random_unit(draw, 26, 0) * left_of(along);
      }
      const PointsWorld plan = outline(box, draw, is_house ? 0.45 : 0.0);
      if (builder_.build(plan, rule.kind, town.palette,
                         2.0 * std::min(box.half_along_m, box.half_across_m), rule.margin_m)) {
        at_m += rule.frontage_m;
        if (is_house && random_unit(draw, 23, 0) < 0.3) build_garage(box, draw);
        if (is_house && is_rural && random_unit(draw, 27, 0) < 0.3)
          build_outhouse(box, left_of(along), town.palette, draw);
        if (is_house) enclose_garden({here.at, there.at, half_width_m}, draw);
      } else {
        at_m += 0.3 * rule.frontage_m + 2.0;
      }
    }
  }

  /// Where a plot lies at its road.
  struct Frontage {
    Point from, to;
    double half_width_m;  ///< of the road
  };

  /// A hedge, a fence or a wall along the road, with a gap for the gate, along one side, of which the
  /// neighbour has the other, and at the back.
  void enclose_garden(const Frontage& at, std::uint64_t draw) {
    const Point along = (at.to - at.from).normalized();
    const Point inward = left_of(along);
    const double near_m = at.half_width_m + kPavement_m + 0.7;
    const double deep_m = near_m + 20.0 + 14.0 * random_unit(draw, 30, 0);
    const auto corner = [&](const Point& on_road, double in_m) -> Point {
      return on_road + in_m * inward;
    };
    const Point gate = at.from + (0.15 + 0.5 * random_unit(draw, 31, 0)) * (at.to - at.from);
    add_barrier(corner(at.from, near_m), corner(gate, near_m), random_unit(draw, 32, 0));
    add_barrier(corner(gate + 3.4 * along, near_m), corner(at.to, near_m),
                random_unit(draw, 32, 0));
    add_barrier(corner(at.to, near_m + 1.0), corner(at.to, deep_m - 1.0), random_unit(draw, 33, 0));
    add_barrier(corner(at.to, deep_m), corner(at.from, deep_m), random_unit(draw, 34, 0));
  }

  void add_barrier(const Point& from, const Point& to, double kind) {
    if ((to - from).norm() < 2.0 || !builder_.occupancy().is_free(from, to, 0.4) ||
        !builder_.ground().is_dry({from, 0.5 * (from + to), to}))
      return;
    Tags tags = {{"barrier", kind < 0.45 ? "hedge" : kind < 0.75 ? "fence" : "wall"}};
    builder_.survey().add_line(Theme::LandUse, {from, to}, std::move(tags));
  }

  /// A barn or a shed in the yard behind a house of a village, along it or at a right angle.
  void build_outhouse(const Rectangle& house, const Point& inward, int palette,
                      std::uint64_t draw) {
    const bool is_barn = random_unit(draw, 40, 0) < 0.55;
    const double half_length_m = (is_barn ? 6.0 : 3.0) + 2.0 * random_unit(draw, 41, 0);
    const double half_depth_m = is_barn ? 4.5 : 2.2;
    const double side = random_unit(draw, 42, 0) < 0.5 ? -1.0 : 1.0;
    const bool is_across = random_unit(draw, 43, 0) < 0.6;
    const double reach_m = std::max(house.half_along_m, house.half_across_m);
    const Rectangle barn{house.center + (reach_m + half_length_m + 3.0) * inward +
                             0.5 * side * reach_m * house.along,
                         is_across ? left_of(house.along) : house.along, half_length_m,
                         half_depth_m};
    builder_.build(barn.ring(), is_barn ? HouseKind::Barn : HouseKind::Shed, palette,
                   2.0 * half_depth_m, 1.0);
  }

  void build_garage(const Rectangle& house, std::uint64_t draw) {
    const double side = random_unit(draw, 24, 0) < 0.5 ? -1.0 : 1.0;
    const Rectangle garage{
        house.center + side * (house.half_along_m + 3.6) * house.along - 1.5 * left_of(house.along),
        house.along, 1.8, 3.0};
    builder_.build(garage.ring(), HouseKind::Shed, 0, 3.6, 0.4,
                   {{"building", "garage"}, {"roof:shape", "flat"}});
  }

  Builder& builder_;
  const std::vector<TownShape>& shapes_;
  std::uint64_t seed_;
  PlaceIndex index_;
  std::vector<std::int32_t> found_;
};

}  // namespace

void build_settlements(Builder& builder, const std::vector<TownShape>& shapes,
                       const std::vector<Block>& blocks, std::uint64_t seed) {
  SettlementBuilder towns(builder, shapes, seed);
  for (const TownShape& shape : shapes) towns.build_landmarks(shape);
  for (const Block& block : blocks)
    if (block.area_m2 > 0.0) towns.fill_block(block);
  for (const Block& block : blocks) towns.line_edges(block);
}

}  // namespace terracast::tiler::country
