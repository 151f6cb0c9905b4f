#include "tiler/country/country.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <set>

#include "core/parallel.h"
#include "tiler/buildings/building_tags.h"
#include "tiler/country/plan_geometry.h"
#include "tiler/objects/object_tags.h"
#include "tiler/objects/rules.h"
#include "tiler/roads/road_features.h"
#include "tiler/roads/road_tags.h"
#include "tiler/surface.h"
#include "tiler/tag_ledger.h"
#include "tiler/tag_values.h"
#include "tiler/water/water_features.h"
#include "tiler/water/water_tags.h"

namespace terracast::test {
namespace {

using tiler::Country;
using tiler::FeatureKind;
using tiler::PointsWorld;
using tiler::VectorFeature;
using tiler::WorldSurface;
using Point = Eigen::Vector2d;

const core::Log& quiet() {
  static const core::Log log("test", core::LogLevel::Off);
  return log;
}

struct World {
  std::shared_ptr<const WorldSurface> surface;
  std::unique_ptr<Country> country;
};

World make_world(const std::string& kind, double size_m, std::int64_t seed = 1,
                 const std::string& landform = "coast", double relief_m = 500.0) {
  tiler::WorldOptions options;
  options.origin_lat_deg = 43.0;
  options.origin_lon_deg = 7.0;
  options.size_m = size_m;
  options.seed = seed;
  options.outside = "extend";
  options.detail_roughness = kind == "procedural" ? 1.0 : 0.0;
  tiler::ElevationOptions entry;
  entry.kind = kind;
  entry.vertical_datum = "ellipsoid";
  entry.relief_m = relief_m;
  entry.landform = landform;
  entry.height_m = 100.0;
  options.elevation.push_back(entry);
  const core::Context context{.log = quiet()};
  World world;
  world.surface = WorldSurface::prepare(options, context);
  world.country =
      std::make_unique<Country>(*world.surface, static_cast<std::uint64_t>(seed), context);
  return world;
}

/// One coast with a city, towns, an airport, harbours: what most tests look at.
const World& coast() {
  static const World world = make_world("procedural", 12288.0, 1);
  return world;
}

std::vector<const VectorFeature*> features_with(const World& world, const std::string& key,
                                                FeatureKind kind, const std::string& value = "") {
  std::vector<const VectorFeature*> found;
  for (const VectorFeature& feature : world.country->features())
    if (feature.kind == kind && feature.tags.has(key) &&
        (value.empty() || feature.tags.value(key) == value))
      found.push_back(&feature);
  return found;
}

/// Twice the area on one side of a line; above 0: left. Integers of the plan's lattice: exact.
std::int64_t side_of(const Point& a, const Point& b, const Point& c) {
  const auto whole = [](double v) { return static_cast<std::int64_t>(std::llround(v * 128.0)); };
  return (whole(b.x()) - whole(a.x())) * (whole(c.y()) - whole(a.y())) -
         (whole(b.y()) - whole(a.y())) * (whole(c.x()) - whole(a.x()));
}
bool cross_properly(const Point& a, const Point& b, const Point& c, const Point& d) {
  const auto sign = [](std::int64_t v) { return v > 0 ? 1 : v < 0 ? -1 : 0; };
  return sign(side_of(a, b, c)) * sign(side_of(a, b, d)) < 0 &&
         sign(side_of(c, d, a)) * sign(side_of(c, d, b)) < 0;
}
/// Whether two rings have places in common, beyond their borders.
bool overlap(const PointsWorld& a, const PointsWorld& b) {
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j)
      if (cross_properly(a[i], a[(i + 1) % a.size()], b[j], b[(j + 1) % b.size()])) return true;
  return tiler::country::contains(a, b[0]) || tiler::country::contains(b, a[0]);
}

struct Bounds {
  Point low, high;
  explicit Bounds(const PointsWorld& points) : low(points[0]), high(points[0]) {
    for (const Point& p : points) low = low.cwiseMin(p), high = high.cwiseMax(p);
  }
  bool touches(const Bounds& o, double margin_m) const {
    return low.x() <= o.high.x() + margin_m && o.low.x() <= high.x() + margin_m &&
           low.y() <= o.high.y() + margin_m && o.low.y() <= high.y() + margin_m;
  }
};

// What we make ourselves holds nothing that our own layers do not know or understand.
TEST(Country, HoldsNoTagThatItsLayersDoNotKnow) {
  const auto warnings = [](const tiler::TagTable& table, const auto& is_wanted) {
    std::vector<VectorFeature> taken;
    for (const VectorFeature& feature : coast().country->features())
      if (is_wanted(feature)) taken.push_back(feature);
    EXPECT_GT(taken.size(), 10U) << table.layer;
    std::string text;
    for (const std::string& line : tiler::ledger_of_tags(taken, table).warnings())
      text += std::string(table.layer) + ": " + line + "\n";
    return text;
  };
  EXPECT_EQ(warnings(tiler::building_tag_table(),
                     [](const VectorFeature& feature) {
                       return feature.kind == FeatureKind::Area &&
                              tiler::is_tagged_building(feature.tags);
                     }),
            "");
  EXPECT_EQ(warnings(tiler::road_tag_table(),
                     [](const VectorFeature& feature) { return tiler::is_of_roads(feature.tags); }),
            "");
  EXPECT_EQ(warnings(tiler::water_tag_table(),
                     [](const VectorFeature& feature) {
                       return feature.kind != FeatureKind::Point &&
                              tiler::is_water_feature(feature.tags);
                     }),
            "");
  EXPECT_EQ(
      warnings(tiler::object_tag_table(),
               [](const VectorFeature& feature) { return tiler::is_feature_wanted(feature.tags); }),
      "");
}

TEST(Country, HasWhatACountryHas) {
  EXPECT_GT(features_with(coast(), "building", FeatureKind::Area).size(), 2000u);
  EXPECT_EQ(features_with(coast(), "place", FeatureKind::Point, "city").size(), 1u);
  EXPECT_GE(features_with(coast(), "building", FeatureKind::Area, "church").size(), 3u);
  EXPECT_GE(features_with(coast(), "aeroway", FeatureKind::Line, "runway").size(), 1u);
  EXPECT_GE(features_with(coast(), "waterway", FeatureKind::Line).size(), 3u);
  EXPECT_GE(features_with(coast(), "landuse", FeatureKind::Area, "farmland").size(), 20u);
  EXPECT_GE(features_with(coast(), "power", FeatureKind::Point, "tower").size(), 5u);
  EXPECT_GE(features_with(coast(), "railway", FeatureKind::Line, "rail").size(), 1u);
  for (const char* highway : {"primary", "tertiary", "residential"})
    EXPECT_GE(features_with(coast(), "highway", FeatureKind::Line, highway).size(), 3u) << highway;
}

TEST(Country, FootprintsOverlapNoOther) {
  auto buildings = features_with(coast(), "building", FeatureKind::Area);
  std::vector<std::pair<Bounds, const VectorFeature*>> sorted;
  for (const VectorFeature* building : buildings)
    sorted.emplace_back(Bounds(building->parts_world[0][0]), building);
  std::sort(sorted.begin(), sorted.end(),
            [](const auto& a, const auto& b) { return a.first.low.x() < b.first.low.x(); });
  int num_pairs = 0;
  for (std::size_t i = 0; i < sorted.size(); ++i)
    for (std::size_t j = i + 1;
         j < sorted.size() && sorted[j].first.low.x() <= sorted[i].first.high.x(); ++j) {
      if (!sorted[i].first.touches(sorted[j].first, 0.0)) continue;
      ++num_pairs;
      ASSERT_FALSE(
          overlap(sorted[i].second->parts_world[0][0], sorted[j].second->parts_world[0][0]))
          << sorted[i].second->number << " and " << sorted[j].second->number;
    }
  EXPECT_GT(num_pairs, 100);  // there were neighbours to look at
}

TEST(Country, FootprintsKeepOffCarriagewaysRailsAndRivers) {
  // What a way takes up: half its width. Houses were asked to keep half a metre off; lines are
  // written on a lattice of 8 mm.
  struct Piece {
    Point from, to;
    double half_m;
  };
  std::vector<Piece> pieces;
  for (const VectorFeature& feature : coast().country->features()) {
    if (feature.kind != FeatureKind::Line) continue;
    const bool is_way =
        feature.tags.has("highway") || feature.tags.has("railway") || feature.tags.has("waterway");
    if (!is_way || feature.tags.has("tunnel")) continue;
    const double half_m = 0.5 * tiler::length_from_tag(feature.tags.value("width"))
                                    .value_or(tiler::Amount{3.0, 3.0})
                                    .middle();
    const PointsWorld& line = feature.parts_world[0][0];
    for (std::size_t k = 1; k < line.size(); ++k) pieces.push_back({line[k - 1], line[k], half_m});
  }
  std::sort(pieces.begin(), pieces.end(), [](const Piece& a, const Piece& b) {
    return std::min(a.from.x(), a.to.x()) < std::min(b.from.x(), b.to.x());
  });
  int num_near = 0;
  for (const VectorFeature* building : features_with(coast(), "building", FeatureKind::Area)) {
    const PointsWorld& ring = building->parts_world[0][0];
    const Bounds bounds(ring);
    for (const Piece& piece : pieces) {
      if (std::min(piece.from.x(), piece.to.x()) > bounds.high.x() + 10.0) break;
      const Bounds reach(PointsWorld{piece.from, piece.to});
      if (!bounds.touches(reach, piece.half_m)) continue;
      ++num_near;
      bool is_clear = !tiler::country::contains(ring, piece.from);
      for (std::size_t k = 0; k < ring.size(); ++k)
        is_clear =
            is_clear && tiler::country::distance_of_segments(ring[k], ring[(k + 1) % ring.size()],
                                                             piece.from, piece.to) > piece.half_m;
      ASSERT_TRUE(is_clear) << "building " << building->number << " at " << ring[0].transpose();
    }
  }
  EXPECT_GT(num_near, 100);
}

TEST(Country, NoFootprintStandsInTheSeaOrOnACliff) {
  for (const VectorFeature* building : features_with(coast(), "building", FeatureKind::Area)) {
    double low = 1e9, high = -1e9;
    const PointsWorld& ring = building->parts_world[0][0];
    for (const Point& corner : ring) {
      const auto ground = coast().surface->sample(corner.x(), corner.y());
      ASSERT_NE(ground.cover, world::Cover::Sea) << building->number;
      low = std::min(low, ground.z_world);
      high = std::max(high, ground.z_world);
    }
    const Bounds bounds(ring);
    // The plan's slope, and what detail finer than its grid adds.
    EXPECT_LT(high - low, 0.24 * (bounds.high - bounds.low).norm() + 5.0) << building->number;
  }
}

TEST(Country, EverySettlementIsReachedByRoad) {
  std::map<std::pair<double, double>, int> node_of;
  std::vector<int> root;
  const auto find = [&](int n) {
    while (root[static_cast<std::size_t>(n)] != n) n = root[static_cast<std::size_t>(n)];
    return n;
  };
  const auto node = [&](const Point& at) {
    const auto [known, is_new] =
        node_of.emplace(std::pair(at.x(), at.y()), static_cast<int>(root.size()));
    if (is_new) root.push_back(known->second);
    return known->second;
  };
  for (const VectorFeature* way : features_with(coast(), "highway", FeatureKind::Line)) {
    const PointsWorld& line = way->parts_world[0][0];
    for (std::size_t k = 1; k < line.size(); ++k) {
      const int a = find(node(line[k - 1])), b = find(node(line[k]));
      root[static_cast<std::size_t>(a)] = b;
    }
  }
  std::map<int, int> places_of;
  int num_places = 0;
  for (const VectorFeature* place : features_with(coast(), "place", FeatureKind::Point)) {
    const Point at = place->parts_world[0][0][0];
    double nearest = 1e9;
    int best = -1;
    for (const auto& [where, n] : node_of)
      if (const double d = std::hypot(where.first - at.x(), where.second - at.y()); d < nearest)
        nearest = d, best = n;
    ASSERT_GE(best, 0);
    EXPECT_LT(nearest, 120.0);
    ++places_of[find(best)];
    ++num_places;
  }
  EXPECT_GT(num_places, 10);
  EXPECT_EQ(places_of.size(), 1u) << "the net falls into parts";
}

TEST(Country, ARunwayIsLevel) {
  for (const VectorFeature* runway :
       features_with(coast(), "aeroway", FeatureKind::Line, "runway")) {
    const PointsWorld& line = runway->parts_world[0][0];
    const auto height = [&](const Point& at) {
      return coast().surface->sample(at.x(), at.y()).z_world +
             at.squaredNorm() / (2.0 * geo::kWgs84SemiMajorAxis_m);
    };
    const double from = height(line.front()), to = height(line.back());
    EXPECT_LT(std::abs(to - from), 0.03 * (line.back() - line.front()).norm());
    for (int k = 0; k <= 40; ++k) {
      const Point at = line.front() + (line.back() - line.front()) * k / 40.0;
      // The plan allows 12 m; detail finer than its grid adds some.
      EXPECT_LT(std::abs(height(at) - from - (to - from) * k / 40.0), 15.0);
    }
  }
}

TEST(Country, NumbersAreUniqueAndRingsSimple) {
  std::set<std::uint64_t> numbers;
  for (const VectorFeature& feature : coast().country->features()) {
    EXPECT_TRUE(numbers.insert(feature.number).second) << feature.number;
    for (const auto& part : feature.parts_world)
      for (const PointsWorld& points : part) {
        for (const Point& at : points) ASSERT_TRUE(at.allFinite());
        if (feature.kind == FeatureKind::Area) {
          ASSERT_GE(points.size(), 3u);
          for (std::size_t i = 0; i < points.size(); ++i)
            for (std::size_t j = i + 2; j < points.size(); ++j)
              ASSERT_FALSE(cross_properly(points[i], points[(i + 1) % points.size()], points[j],
                                          points[(j + 1) % points.size()]))
                  << feature.number;
        } else if (feature.kind == FeatureKind::Line) {
          ASSERT_GE(points.size(), 2u);
        }
      }
  }
}

std::string text_of(const Country& country) {
  std::string text;
  for (const VectorFeature& feature : country.features()) {
    text += std::to_string(feature.number);
    for (const auto& [key, value] : feature.tags.all()) text += key + "=" + value + ";";
    for (const auto& part : feature.parts_world)
      for (const PointsWorld& points : part)
        text.append(reinterpret_cast<const char*>(points.data()), points.size() * sizeof(Point));
  }
  return text;
}

TEST(Country, IsTheSameFromAnyThreadsAndAnotherFromAnotherSeed) {
  const World once = make_world("procedural", 4096.0, 3);
  const core::ThreadLimit one(1);
  const World again = make_world("procedural", 4096.0, 3);
  EXPECT_EQ(text_of(*once.country), text_of(*again.country));
  EXPECT_EQ(once.country->content_hash(), again.country->content_hash());
  const World other = make_world("procedural", 4096.0, 4);
  EXPECT_NE(text_of(*once.country), text_of(*other.country));
  EXPECT_NE(once.country->content_hash(), other.country->content_hash());
}

TEST(Country, IsMadeOnAnyGround) {
  EXPECT_GT(make_world("plane", 6144.0).country->features().size(), 500u);
  EXPECT_NO_THROW(make_world("plane", 256.0));
  EXPECT_NO_THROW(make_world("procedural", 2048.0));
  EXPECT_NO_THROW(make_world("procedural", 8192.0, 2, "valleys", 3500.0));
  EXPECT_NO_THROW(make_world("fractal", 4096.0, 1, "coast", 2500.0));
  EXPECT_NO_THROW(make_world("procedural", 8192.0, 3, "islands", 300.0));
}

/// A town of blocks of 48 m at every 100 m, in a square of 2 km of which all buildings are known.
tiler::SurveyedGround surveyed_town() {
  tiler::SurveyedGround ground;
  const auto box = [](const Point& middle, double half_m) {
    return PointsWorld{middle + Point(-half_m, -half_m), middle + Point(half_m, -half_m),
                       middle + Point(half_m, half_m), middle + Point(-half_m, half_m)};
  };
  for (int j = -9; j <= 9; ++j)
    for (int i = -9; i <= 9; ++i) ground.buildings.push_back(box(100.0 * Point(i, j), 24.0));
  ground.areas.push_back(box(Point::Zero(), 1000.0));
  ground.content_hash = "town";
  return ground;
}

TEST(Country, MakesUpNoBuildingsOnSurveyedGroundAndLeadsNothingThroughThoseThatStand) {
  const World without = make_world("plane", 6144.0);
  const core::Context context{.log = quiet()};
  const tiler::SurveyedGround surveyed = surveyed_town();
  const Country country(*without.surface, 1, context, surveyed);
  const auto num_built_there = [](const Country& of) {
    int num = 0;
    for (const VectorFeature& feature : of.features())
      if (feature.kind == FeatureKind::Area && feature.tags.has("building"))
        for (const Point& corner : feature.parts_world.front().front())
          num += corner.cwiseAbs().maxCoeff() < 1000.0 ? 1 : 0;
    return num;
  };
  // Its city would stand there.
  EXPECT_GT(num_built_there(*without.country), 400);
  EXPECT_EQ(num_built_there(country), 0);
  int num_roads = 0;
  for (const VectorFeature& feature : country.features()) {
    const bool is_line = feature.kind == FeatureKind::Line;
    if (!is_line || (!feature.tags.has("highway") && !feature.tags.has("railway") &&
                     !feature.tags.has("waterway")))
      continue;
    if (feature.tags.has("tunnel")) continue;
    const double half_width_m =
        0.5 *
        tiler::length_from_tag(feature.tags.value("width")).value_or(tiler::Amount{}).middle();
    for (const auto& line : feature.parts_world.front())
      for (std::size_t k = 1; k < line.size(); ++k) {
        if (std::max(line[k].cwiseAbs().maxCoeff(), line[k - 1].cwiseAbs().maxCoeff()) < 1000.0)
          ++num_roads;
        for (const PointsWorld& ring : surveyed.buildings) {
          if ((ring[0] - line[k]).cwiseAbs().maxCoeff() > 1500.0) continue;
          bool is_clear = !tiler::country::contains(ring, line[k]);
          for (std::size_t c = 0; c < 4 && is_clear; ++c)
            is_clear = tiler::country::distance_of_segments(ring[c], ring[(c + 1) % 4], line[k - 1],
                                                            line[k]) >= half_width_m;
          EXPECT_TRUE(is_clear) << feature.number << " at " << line[k].transpose();
        }
      }
  }
  // Streets between the blocks.
  EXPECT_GT(num_roads, 100);
  EXPECT_NE(country.content_hash(), without.country->content_hash());
}

}  // namespace
}  // namespace terracast::test
