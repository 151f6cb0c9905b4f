#include "tiler/out_of_sight.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/test_data.h"
#include "tests/tiler/building_layers.h"
#include "tests/tiler/raster_files.h"
#include "tests/tiler/vector_files.h"
#include "tiler/roads/road_features.h"
#include "tiler/water/water_features.h"

namespace terracast::test {
namespace {

using tiler::FeatureTags;
using tiler::Sight;
using tiler::sight_of;
using tiler::SightOf;
using Tags = std::vector<std::pair<std::string, std::string>>;

constexpr SightOf kAll[] = {SightOf::Building, SightOf::Thing, SightOf::Area, SightOf::Way,
                            SightOf::Waterway};

std::string text_of(const Tags& tags) {
  std::string text;
  for (const auto& [key, value] : tags) text += key + "=" + value + " ";
  return text;
}

void expect_sights(const std::vector<std::pair<Tags, Sight>>& cases,
                   const std::vector<SightOf>& whats) {
  for (const auto& [tags, sight] : cases)
    for (const SightOf what : whats)
      EXPECT_EQ(sight_of(FeatureTags(tags), what), sight)
          << text_of(tags) << "as " << static_cast<int>(what);
}

TEST(OutOfSight, PlacesAreWhatTagsDefine) {
  expect_sights({{{}, Sight::Open},
                 {{{"location", "underground"}}, Sight::BelowGround},
                 {{{"location", "underground"}, {"height", "3"}}, Sight::BelowGround},
                 {{{"location", "underwater"}}, Sight::BelowWater},
                 {{{"location", "indoor"}}, Sight::Indoors},
                 {{{"location", "overground"}}, Sight::Open},
                 {{{"location", "roof"}}, Sight::Open},
                 {{{"indoor", "yes"}}, Sight::Indoors},
                 {{{"indoor", "room"}, {"level", "2"}}, Sight::Indoors},
                 {{{"indoor", "no"}}, Sight::Open},
                 {{{"highway", "corridor"}}, Sight::Indoors},
                 {{{"level", "-1"}}, Sight::BelowGround},
                 {{{"level", "-2;-1"}}, Sight::BelowGround},
                 {{{"level", "-1;0"}}, Sight::Open},
                 {{{"level", "0"}}, Sight::Open},
                 {{{"level", "cellar"}}, Sight::Open},
                 {{{"tunnel", "yes"}}, Sight::BelowGround},
                 {{{"tunnel", "culvert"}}, Sight::BelowGround},
                 {{{"tunnel", "F"}}, Sight::Open},
                 {{{"covered", "no"}}, Sight::Open},
                 {{{"covered", ""}}, Sight::Open},
                 {{{"layer", "1"}}, Sight::Open}},
                {std::begin(kAll), std::end(kAll)});
}

// A layer orders what crosses; it is no depth.
TEST(OutOfSight, LayersAreAnOrderAlone) {
  expect_sights({{{{"layer", "-1"}}, Sight::Open},
                 {{{"layer", "-5"}, {"natural", "water"}}, Sight::Open},
                 {{{"layer", "-1"}, {"location", "underground"}}, Sight::BelowGround},
                 {{{"layer", "-1"}, {"tunnel", "yes"}}, Sight::BelowGround},
                 {{{"layer", "-1"}, {"level", "-1"}}, Sight::BelowGround},
                 {{{"layer", "-2"}, {"covered", "yes"}}, Sight::BelowGround},
                 {{{"layer", "-1"}, {"covered", "no"}}, Sight::Open}},
                {std::begin(kAll), std::end(kAll)});
}

// A building that is covered has a roof, or stands under a larger one; a passage leads through it.
TEST(OutOfSight, CoversHideWhatIsNoBuilding) {
  const std::vector<Tags> covers = {{{"covered", "yes"}},
                                    {{"covered", "arcade"}},
                                    {{"covered", "T"}, {"layer", "1"}},
                                    {{"tunnel", "building_passage"}},
                                    {{"tunnel", "avalanche_protector"}}};
  for (const Tags& tags : covers) {
    expect_sights({{tags, Sight::Covered}},
                  {SightOf::Thing, SightOf::Area, SightOf::Way, SightOf::Waterway});
    expect_sights({{tags, Sight::Open}}, {SightOf::Building});
  }
}

// Storeys below the ground are those of a house whose storeys above nobody noted, unless there are none.
TEST(OutOfSight, CellarsWithoutStoreysAboveAreBelowGround) {
  expect_sights(
      {{{{"building:levels:underground", "2"}, {"building:levels", "0"}}, Sight::BelowGround},
       {{{"building:levels:underground", "1"}, {"building:levels", "0"}, {"roof:shape", "flat"}},
        Sight::BelowGround},
       {{{"building:levels:underground", "2"}}, Sight::Open},
       {{{"building:levels", "0"}}, Sight::Open},
       {{{"building:levels", "0"}, {"building:levels:underground", "0"}}, Sight::Open},
       {{{"building:levels:underground", "2"}, {"building:levels", "3"}}, Sight::Open},
       {{{"building:levels:underground", "1"}, {"building:levels", "0"}, {"height", "6"}},
        Sight::Open},
       {{{"building:levels:underground", "1"}, {"building:levels", "0"}, {"roof:levels", "1"}},
        Sight::Open},
       {{{"building:levels:underground", "1"}, {"building:levels", "0"}, {"roof:shape", "gabled"}},
        Sight::Open},
       {{{"amenity", "parking"}, {"parking", "underground"}}, Sight::BelowGround},
       {{{"building", "apartments"}, {"parking", "underground"}, {"building:levels", "5"}},
        Sight::Open},
       {{{"amenity", "parking"}, {"parking", "surface"}}, Sight::Open}},
      {SightOf::Building, SightOf::Thing, SightOf::Area});
}

// What a whole building states of its height is above the ground, whatever storey is noted beside it.
TEST(OutOfSight, BuildingsThatRiseAreMoreThanTheirLowestStorey) {
  const std::vector<Tags> rising = {{{"level", "-1"}, {"height", "7"}},
                                    {{"level", "-1"}, {"building:levels", "2"}},
                                    {{"level", "-2;-1"}, {"min_height", "4"}},
                                    {{"level", "-1"}, {"roof:shape", "hipped"}}};
  for (const Tags& tags : rising) {
    expect_sights({{tags, Sight::Open}}, {SightOf::Building});
    expect_sights({{tags, Sight::BelowGround}}, {SightOf::Thing, SightOf::Area});
  }
  expect_sights({{{{"level", "-1"}, {"building:levels", "0"}}, Sight::BelowGround}},
                {SightOf::Building});
}

TEST(OutOfSight, BuildingsBelowGroundAreLeftOutAndCounted) {
  const ScratchFolder folder;
  write_vectors(
      folder / "a.gpkg", "GPKG",
      {{wkt(0, 0, 12, 9), {{"building", "yes"}, {"location", "underground"}}},
       {wkt(40, 0, 12, 9), {{"building", "parking"}, {"parking", "underground"}}},
       {wkt(80, 0, 12, 9), {{"building:part", "yes"}, {"indoor", "room"}, {"level", "-2"}}},
       {wkt(120, 0, 12, 9), {{"building", "yes"}, {"covered", "yes"}}},
       {wkt(160, 0, 12, 9), {{"building", "yes"}, {"layer", "1"}, {"building:levels", "2"}}},
       {wkt(200, 0, 12, 9), {{"building", "yes"}, {"layer", "-1"}}},
       {wkt(240, 0, 12, 9), {{"building", "yes"}, {"layer", "-1"}, {"covered", "yes"}}},
       {wkt(280, 0, 12, 9), {{"building", "yes"}, {"building:levels:underground", "1"}}}},
      "EPSG:32631");
  const Built built(files_key(folder / "a.gpkg"));
  EXPECT_EQ(built.count("buildings"), 4);
  EXPECT_EQ(built.count("below ground, left out"), 3);
  EXPECT_EQ(built.count("indoors, left out"), 1);
  EXPECT_EQ(built.count("under a cover, left out"), 0);
}

tiler::VectorFeature square(tiler::FeatureKind kind, const Tags& tags) {
  tiler::VectorFeature feature;
  feature.kind = kind;
  feature.tags = FeatureTags(tags);
  feature.parts_world = {{{{0, 0}, {20, 0}, {20, 20}, {0, 20}}}};
  return feature;
}

TEST(OutOfSight, WaterAndPavedAreasFollowTheSameRule) {
  const auto water = tiler::water_of(
      {square(tiler::FeatureKind::Area, {{"natural", "water"}}),
       square(tiler::FeatureKind::Area, {{"natural", "water"}, {"location", "underground"}}),
       square(tiler::FeatureKind::Area, {{"natural", "water"}, {"covered", "T"}}),
       square(tiler::FeatureKind::Area, {{"natural", "water"}, {"layer", "-1"}})},
      500.0);
  EXPECT_EQ(water.polygons.size(), 2U);
  const auto sorted = tiler::sort_features(
      {square(tiler::FeatureKind::Area, {{"amenity", "parking"}}),
       square(tiler::FeatureKind::Area, {{"amenity", "parking"}, {"layer", "-1"}}),
       square(tiler::FeatureKind::Area, {{"amenity", "parking"}, {"level", "-1"}}),
       square(tiler::FeatureKind::Area, {{"amenity", "bench"}, {"highway", "proposed"}})},
      {}, 500.0);
  EXPECT_EQ(sorted.areas.size(), 2U);
  EXPECT_EQ(sorted.num_not_built, 1);
  std::vector<std::pair<std::string, std::int64_t>> counts;
  sorted.hidden.append_to(counts);
  EXPECT_EQ(counts,
            (std::vector<std::pair<std::string, std::int64_t>>{{"below ground, left out", 1}}));
}

// As OpenStreetMap has them in Monaco: a building with a layer below 0 alone, and the railway station in the rock.
TEST(OutOfSight, LayersOfMonacosBuildings) {
  TERRACAST_NEEDS_SHARED_DATA("monaco/monaco.osm.pbf");
  tiler::WorldOptions options = world_of("plane", 8192.0);
  options.origin_lat_deg = 43.7375;
  options.origin_lon_deg = 7.4225;
  const Built built(files_key(shared_data() / "monaco/monaco.osm.pbf"), options);
  const auto solids = built.all(Land());
  const auto stands = [&](std::uint64_t way) {
    return std::any_of(solids.begin(), solids.end(), [&](const auto& solid) {
      return (solid.second.provenance.feature & 0xfffffffffffULL) == way;
    });
  };
  EXPECT_TRUE(stands(850169345));
  EXPECT_FALSE(stands(156780354));
  EXPECT_GE(built.count("below ground, left out"), 1);
}

}  // namespace
}  // namespace terracast::test
