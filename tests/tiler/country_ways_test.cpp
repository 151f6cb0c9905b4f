#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "core/toml_reader.h"
#include "tiler/country/country.h"
#include "tiler/country/plan_geometry.h"
#include "tiler/surface.h"
#include "tiler/tag_values.h"

/// The countries of the worlds that terracast ships, on smaller squares.
namespace terracast::test {
namespace {

using tiler::FeatureKind;
using tiler::PointsWorld;
using tiler::VectorFeature;
using Point = Eigen::Vector2d;

constexpr double kSize_m = 16384.0;

struct Land {
  std::shared_ptr<const tiler::WorldSurface> surface;
  std::unique_ptr<tiler::Country> country;
};

const Land& land_of(const std::string& name) {
  static std::map<std::string, Land> lands;
  Land& land = lands[name];
  if (land.country == nullptr) {
    static const core::Log log("test", core::LogLevel::Off);
    const core::Context context{.log = log};
    tiler::WorldOptions options;
    core::TomlDocument::load(fmt::format("{}/configs/worlds/{}.toml", TERRACAST_SOURCE_DIR, name))
        .read(options);
    options.size_m = kSize_m;
    land.surface = tiler::WorldSurface::prepare(options, context);
    land.country = std::make_unique<tiler::Country>(
        *land.surface, static_cast<std::uint64_t>(options.seed), context);
  }
  return land;
}

/// What water a country has, by its features and the ground.
class Waters {
 public:
  explicit Waters(const Land& land) : surface_(*land.surface) {
    for (const VectorFeature& feature : land.country->features()) {
      if (feature.kind == FeatureKind::Area && feature.tags.value("natural") == "water")
        lakes_.push_back(&feature.parts_world[0][0]);
      if (feature.kind == FeatureKind::Line && feature.tags.has("waterway"))
        rivers_.emplace_back(
            &feature.parts_world[0][0],
            0.5 * tiler::length_from_tag(feature.tags.value("width")).value().middle());
    }
  }
  std::size_t num_lakes() const { return lakes_.size(); }
  std::string at(const Point& place) const {
    if (surface_.sample(place.x(), place.y()).cover == world::Cover::Sea) return "the sea";
    for (const PointsWorld* lake : lakes_)
      if (tiler::country::contains(*lake, place)) return "a lake";
    for (const auto& [line, half_width_m] : rivers_)
      for (std::size_t k = 1; k < line->size(); ++k)
        if (tiler::country::distance_to_segment(place, (*line)[k - 1], (*line)[k]) < half_width_m)
          return "a river";
    return {};
  }

 private:
  const tiler::WorldSurface& surface_;
  std::vector<const PointsWorld*> lakes_;
  std::vector<std::pair<const PointsWorld*, double>> rivers_;
};

class CountryWays : public testing::TestWithParam<const char*> {};

TEST_P(CountryWays, NoneEndsInWaterOrOnABridgeToNowhere) {
  // Seen in the alpine world in November 2026: a road to a hamlet in a lake, on a bridge that ended in its middle.
  const Land& land = land_of(GetParam());
  const Waters waters(land);
  for (const char* key : {"highway", "railway"}) {
    std::vector<const VectorFeature*> ways;
    std::map<std::pair<double, double>, int> features_at;
    for (const VectorFeature& feature : land.country->features())
      if (feature.kind == FeatureKind::Line && feature.tags.has(key)) {
        ways.push_back(&feature);
        for (const Point& point : feature.parts_world[0][0]) ++features_at[{point.x(), point.y()}];
      }
    int num_ends = 0;
    for (const VectorFeature* way : ways) {
      const PointsWorld& line = way->parts_world[0][0];
      for (const Point& end : {line.front(), line.back()}) {
        if (features_at.at({end.x(), end.y()}) > 1) continue;
        ++num_ends;
        const std::string where = fmt::format("{} {} ends at {:.0f} E {:.0f} N", key,
                                              way->tags.value(key), end.x(), end.y());
        EXPECT_EQ(waters.at(end), "") << where;
        // At the square's border ways go on; a motorway's lanes lie 9.4 m beside the line that ends there.
        EXPECT_TRUE(!way->tags.has("bridge") || end.cwiseAbs().maxCoeff() > 0.5 * kSize_m - 10.0)
            << where;
      }
    }
    if (key == std::string("highway")) {
      EXPECT_GT(num_ends, 20);
    }
  }
}

TEST_P(CountryWays, NobodyLivesInALake) {
  const Land& land = land_of(GetParam());
  const Waters waters(land);
  for (const VectorFeature& feature : land.country->features()) {
    if (!feature.tags.has("place") || feature.kind != FeatureKind::Point) continue;
    EXPECT_NE(waters.at(feature.parts_world[0][0][0]), "a lake") << feature.tags.value("place");
  }
}

INSTANTIATE_TEST_SUITE_P(Worlds, CountryWays, testing::Values("archipelago", "alpine", "plains"),
                         [](const auto& world) { return std::string(world.param); });

/// Sides of a rectangle's or a rectangle's with a wing's box, the longer first.
Point sides_of(const PointsWorld& ring) {
  const Point along = (ring[1] - ring[0]).normalized();
  const Point across(-along.y(), along.x());
  Point low = Point::Constant(1e9), high = Point::Constant(-1e9);
  for (const Point& corner : ring) {
    const Point own(corner.dot(along), corner.dot(across));
    low = low.cwiseMin(own), high = high.cwiseMax(own);
  }
  const Point size = high - low;
  return {size.maxCoeff(), size.minCoeff()};
}

TEST(CountryIndustry, HasHallsOfAllSizesInPavedYards) {
  const Land& land = land_of("plains");
  std::vector<const PointsWorld*> yards, halls;
  int num_docks = 0, num_works = 0;
  for (const VectorFeature& feature : land.country->features()) {
    const std::string_view building = feature.tags.value("building");
    if (feature.kind == FeatureKind::Area && feature.tags.value("highway") == "service")
      yards.push_back(&feature.parts_world[0][0]);
    if (feature.kind == FeatureKind::Area && building == "warehouse")
      halls.push_back(&feature.parts_world[0][0]);
    num_works += building == "industrial" ? 1 : 0;
    num_docks += feature.tags.value("amenity") == "loading_dock" ? 1 : 0;
  }
  ASSERT_GT(halls.size(), 10u);
  EXPECT_GT(num_works, 40);
  EXPECT_GT(num_docks, 10);
  std::vector<double> areas_m2;
  double longest_m = 0.0;
  int num_paved = 0;
  for (const PointsWorld* hall : halls) {
    const Point sides = sides_of(*hall);
    areas_m2.push_back(sides.x() * sides.y());
    longest_m = std::max(longest_m, sides.x());
    num_paved += std::any_of(yards.begin(), yards.end(), [&](const PointsWorld* yard) {
      return std::all_of(hall->begin(), hall->end(), [&](const Point& corner) {
        return tiler::country::contains(*yard, corner);
      });
    });
  }
  std::sort(areas_m2.begin(), areas_m2.end());
  // Seen: one of 77 m, in this small city; the largest tenth is many times the smallest.
  EXPECT_GT(longest_m, 70.0);
  EXPECT_GT(areas_m2[areas_m2.size() * 9 / 10], 5.0 * areas_m2[areas_m2.size() / 10]);
  // The airport's sheds stand on their own ground.
  EXPECT_GE(num_paved + 3, static_cast<int>(halls.size()));
}

}  // namespace
}  // namespace terracast::test
