#include "tiler/country/countryside.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "core/random.h"

namespace terracast::tiler::country {
namespace {

using core::random_unit;

constexpr std::uint64_t kStream = 0x6669656c64;
constexpr double kFarmEvery_m = 1100.0;
constexpr double kRegion_m = 1900.0;

bool is_in_settlement(const std::vector<TownShape>& shapes, const PlaceIndex& index,
                      const Point& at, double most, std::vector<std::int32_t>& found) {
  index.find(at, at, found);
  return std::any_of(found.begin(), found.end(), [&](std::int32_t k) {
    return shapes[static_cast<std::size_t>(k)].at(at) < most;
  });
}

class FieldLayer {
 public:
  FieldLayer(const std::vector<Settlement>& settlements, Builder& builder, std::uint64_t seed)
      : settlements_(settlements), builder_(builder), seed_(seed) {}

  void split(const Rectangle& lot, double wanted_m2, std::uint64_t key, int depth) {
    const double area_m2 = 4.0 * lot.half_along_m * lot.half_across_m;
    if (depth > 12 || area_m2 < 8000.0 || std::min(lot.half_along_m, lot.half_across_m) < 22.0)
      return;
    // In the midst of a settlement there are none.
    const double reach_m = lot.half_along_m + lot.half_across_m;
    for (const Settlement& town : settlements_)
      if ((town.center - lot.center).norm() + reach_m < 0.8 * town.radius_m) return;
    if (area_m2 <= wanted_m2 && lay(lot, key)) return;
    const double share = 0.4 + 0.2 * random_unit(seed_, kStream + 1, key);
    Rectangle first = lot, second = lot;
    if (lot.half_along_m > lot.half_across_m) {
      first.half_along_m = share * lot.half_along_m;
      second.half_along_m = (1.0 - share) * lot.half_along_m;
      first.center = lot.at(share - 1.0, 0.0);
      second.center = lot.at(share, 0.0);
    } else {
      first.half_across_m = share * lot.half_across_m;
      second.half_across_m = (1.0 - share) * lot.half_across_m;
      first.center = lot.at(0.0, share - 1.0);
      second.center = lot.at(0.0, share);
    }
    split(first, wanted_m2, core::mix_bits(2 * key + 1), depth + 1);
    split(second, wanted_m2, core::mix_bits(2 * key + 2), depth + 1);
  }

 private:
  bool lay(Rectangle lot, std::uint64_t key) {
    lot.half_along_m -= 2.5;
    lot.half_across_m -= 2.5;
    PointsWorld ring = lot.ring();
    for (Point& corner : ring) corner = snapped(corner);
    const PlanGround& ground = builder_.ground();
    if (!ground.is_in_square(lot.center, 30.0)) return false;
    const double slope = ground.slope(lot.center);
    if (slope > 0.13 || ground.sea_distance_m(lot.center) < 90.0) return false;
    if (!builder_.occupancy().is_free(lot.center, 1.0, kInTheWay & ~unsigned{kPower})) return false;
    if (ground.rise_m(ring) > 0.28 * (lot.half_along_m + lot.half_across_m) || !ground.is_dry(ring))
      return false;
    if (!builder_.occupancy().is_free(ring, 4.0, kInTheWay & ~unsigned{kField | kPower}) ||
        !builder_.occupancy().is_free(ring, 1.0, kField))
      return false;
    const double u = random_unit(seed_, kStream + 2, key);
    const bool is_southern = builder_.manner() == BuildingManner::Southern;
    Tags tags;
    if (builder_.manner() == BuildingManner::Alpine ? u < 0.7 : u < 0.2) {
      tags = {{"landuse", "meadow"}};
    } else if (u > (is_southern ? 0.8 : 0.95) && slope > 0.015) {
      tags = {{"landuse", is_southern && u > 0.88 ? "vineyard" : "orchard"}};
    } else {
      constexpr const char* kCrops[] = {"wheat",      "barley", "maize",    "rape",
                                        "sugar_beet", "potato", "sunflower"};
      tags = {{"landuse", "farmland"},
              {"crop", kCrops[core::random_bits(seed_, kStream + 3, key) % std::size(kCrops)]}};
    }
    // Hedges are not surveyed: they stand on the borders that the ground shows (world::FieldPattern), by vegetation.
    builder_.survey().add_area(Theme::LandUse, ring, std::move(tags));
    builder_.occupancy().add_ring(ring, kField);
    return true;
  }

  const std::vector<Settlement>& settlements_;
  Builder& builder_;
  std::uint64_t seed_;
};

}  // namespace

std::vector<FarmSite> plan_farms(const PlanGround& ground, const std::vector<TownShape>& shapes,
                                 const Occupancy& occupancy, std::vector<Way>& ways,
                                 std::uint64_t seed) {
  PlaceIndex index(ground.half_size_m(), 256.0);
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    const Settlement& town = shapes[k].settlement();
    const double reach_m = std::max(1.9 * town.radius_m, 250.0);
    index.add(static_cast<std::int32_t>(k), town.center.array() - reach_m,
              town.center.array() + reach_m);
  }
  std::vector<std::int32_t> found;
  std::vector<FarmSite> farms;
  Occupancy taken(ground.half_size_m());
  const std::size_t num_roads = ways.size();
  for (std::size_t w = 0; w < num_roads; ++w)
    taken.add_line(ways[w].line, ways[w].half_width_m(), kRoad);
  std::vector<Way> tracks;
  for (std::size_t w = 0; w < num_roads; ++w) {
    const Way& road = ways[w];
    if (road.kind < RoadKind::Secondary || road.kind > RoadKind::Unclassified) continue;
    double since_m = kFarmEvery_m * random_unit(seed, kStream + 10, w);
    for (std::size_t k = 2; k + 2 < road.line.size(); ++k) {
      since_m += (road.line[k] - road.line[k - 1]).norm();
      const std::uint64_t key = core::stream_of(w, k);
      if (since_m < kFarmEvery_m * (0.55 + random_unit(seed, kStream + 11, key))) continue;
      const Point from = road.line[k];
      const Point along = (road.line[k + 1] - road.line[k - 1]).normalized();
      const double side = random_unit(seed, kStream + 12, key) < 0.5 ? -1.0 : 1.0;
      const Point out =
          side * turned(left_of(along), 0.3 * (random_unit(seed, kStream + 13, key) - 0.5));
      const bool is_farm = ground.slope(from) < 0.09;
      if (is_in_settlement(shapes, index, from, 1.25, found)) continue;
      if (is_farm) {
        const double far_m = 70.0 + 130.0 * random_unit(seed, kStream + 14, key);
        const Point yard = snapped(from + far_m * out);
        if (!ground.is_in_square(yard, 150.0) || ground.sea_distance_m(yard) < 120.0 ||
            ground.slope(yard) > 0.1)
          continue;
        if (is_in_settlement(shapes, index, yard, 1.1, found)) continue;
        if (!occupancy.is_free(from, yard, 10.0) || !taken.is_free(yard, 48.0) ||
            !taken.is_free(from + 20.0 * out, yard, 12.0))
          continue;
        Way track;
        track.kind =
            random_unit(seed, kStream + 15, key) < 0.5 ? RoadKind::Track : RoadKind::Service;
        track.line = resampled(PointsWorld{from, yard}, 25.0);
        taken.add_line(track.line, 40.0, kRoad);
        tracks.push_back(std::move(track));
        farms.push_back({yard, left_of(out), snapped(yard)});
        since_m = 0.0;
      } else {
        // A track into the woods, along the slope, gaining height slowly.
        PointsWorld line{from};
        Point at = from, heading = out;
        const int steps = 14 + static_cast<int>(30.0 * random_unit(seed, kStream + 16, key));
        for (int step = 0; step < steps; ++step) {
          const Point gradient = ground.gradient(at);
          const double slope = gradient.norm();
          if (slope > 0.02) {
            Point level = left_of(gradient / slope);
            if (level.dot(heading) < 0.0) level = -level;
            heading = (heading + 1.6 * level + 0.25 * gradient / slope).normalized();
          }
          const Point next = at + 32.0 * heading;
          if (!ground.is_in_square(next, 60.0) || ground.sea_distance_m(next) < 60.0 ||
              std::abs(ground.height_m(next) - ground.height_m(at)) > 5.5 ||
              !occupancy.is_free(at, next, 8.0) || (step > 0 && !taken.is_free(at, next, 14.0)))
            break;
          line.push_back(next);
          at = next;
        }
        since_m = 0.4 * kFarmEvery_m;
        if (line.size() < 8) continue;
        Way track;
        track.kind = RoadKind::Track;
        track.line = splined(line, 1);
        taken.add_line(track.line, 2.0, kRoad);
        farms.push_back({at + 8.0 * heading, heading, snapped(track.line.back()), true});
        tracks.push_back(std::move(track));
      }
    }
  }
  for (Way& track : tracks) ways.push_back(std::move(track));
  return farms;
}

void drop_without_track(const std::vector<Way>& ways, std::vector<FarmSite>& farms) {
  std::set<std::pair<double, double>> ends;
  for (const Way& way : ways)
    for (const Point& end : {way.line.front(), way.line.back()}) ends.emplace(end.x(), end.y());
  std::erase_if(farms, [&](const FarmSite& farm) {
    return !ends.contains({farm.track_end.x(), farm.track_end.y()});
  });
}

void build_farms(const std::vector<FarmSite>& farms, Builder& builder) {
  for (const FarmSite& farm : farms) {
    const std::uint64_t draw = builder.draw();
    const int palette = static_cast<int>(draw % 4);
    if (farm.is_hut) {
      builder.build(Rectangle{farm.at, farm.along, 4.5, 3.2}.ring(), HouseKind::Shed, palette, 6.4,
                    0.5,
                    {{"building", "cabin"},
                     {"height", "5"},
                     {"building:material", "wood"},
                     {"building:colour", "#7d5f43"},
                     {"roof:shape", "gabled"}});
      continue;
    }
    const Point across = left_of(farm.along);
    const auto box = [&](double along_m, double across_m, double half_long_m, double half_wide_m) {
      return Rectangle{farm.at + along_m * farm.along + across_m * across, farm.along, half_long_m,
                       half_wide_m}
          .ring();
    };
    builder.build(box(-19, 4, 8, 5.5), HouseKind::FarmHouse, palette, 11.0, 1.0);
    builder.build(box(20, 6, 6.5, 13), HouseKind::Barn, palette, 13.0, 1.0);
    if (random_unit(draw, 1, 0) < 0.7)
      builder.build(box(-2, 26, 14, 6.5), HouseKind::Barn, palette, 13.0, 1.0);
    if (random_unit(draw, 2, 0) < 0.4)
      builder.build(box(36, 24, 8, 4), HouseKind::Shed, palette, 8.0, 1.0);
    if (random_unit(draw, 3, 0) < 0.35)
      for (int k = 0; k < 2; ++k) {
        const Point silo = farm.at + 33.0 * farm.along + (-4.0 - 8.0 * k) * across;
        if (!builder.occupancy().is_free(silo, 4.5)) continue;
        builder.survey().add_point(Theme::Building, silo,
                                   {{"man_made", "silo"}, {"diameter", "6"}, {"height", "15"}});
        builder.occupancy().add_line({silo, silo + Point(0.1, 0)}, 3.2, kBuilding);
      }
  }
}

void lay_fields(const std::vector<Settlement>& settlements, Builder& builder, std::uint64_t seed) {
  const PlanGround& ground = builder.ground();
  FieldLayer layer(settlements, builder, seed);
  const int reach = static_cast<int>(ground.half_size_m() / kRegion_m) + 1;
  for (int j = -reach; j <= reach; ++j)
    for (int i = -reach; i <= reach; ++i) {
      const auto key = static_cast<std::uint64_t>((j + reach) * (2 * reach + 1) + i + reach);
      const Point center = kRegion_m * Point(i + random_unit(seed, kStream + 20, key) * 0.3,
                                             j + random_unit(seed, kStream + 21, key) * 0.3);
      if (!ground.is_in_square(center, 0.0) || !ground.is_land_near(center)) continue;
      const bool is_tilled =
          std::any_of(settlements.begin(), settlements.end(), [&](const Settlement& settlement) {
            return (settlement.center - center).norm() < settlement.radius_m + 3200.0;
          });
      if (!is_tilled) continue;
      // A region's fields lie along its slope, or as they please.
      Point along = turned(Point::UnitX(), 2.0 * random_unit(seed, kStream + 22, key) - 1.0);
      if (const Point gradient = ground.gradient(center); gradient.norm() > 0.015)
        along = left_of(gradient.normalized());
      const double wanted_m2 = 25000.0 + 60000.0 * random_unit(seed, kStream + 23, key) *
                                             random_unit(seed, kStream + 24, key);
      layer.split({center, along, 0.58 * kRegion_m, 0.58 * kRegion_m}, wanted_m2,
                  core::mix_bits(key + 77), 0);
    }
}

}  // namespace terracast::tiler::country
