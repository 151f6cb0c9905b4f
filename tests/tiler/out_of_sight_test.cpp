#include "tiler/out_of_sight.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

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

constexpr SightOf kAll[] = {SightOf::Body, SightOf::Area, SightOf::Way, SightOf::Waterway};

TEST(OutOfSight, PlacesAreWhatTagsDefine) {
  const std::vector<std::pair<Tags, Sight>> of_all = {
      {{}, Sight::Open},
      {{{"location", "underground"}}, Sight::BelowGround},
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
      {{{"covered", "yes"}}, Sight::Covered},
      {{{"covered", "arcade"}}, Sight::Covered},
      {{{"covered", "no"}}, Sight::Open},
      {{{"covered", ""}}, Sight::Open},
      {{{"layer", "1"}}, Sight::Open}};
  for (const auto& [tags, sight] : of_all)
    for (const SightOf what : kAll)
      EXPECT_EQ(sight_of(FeatureTags(tags), what), sight)
          << (tags.empty() ? "" : tags[0].first + "=" + tags[0].second);
}

TEST(OutOfSight, LayersBelow0AreAnOrderOfWaysAlone) {
  const FeatureTags below(Tags{{"layer", "-1"}});
  for (const SightOf what : {SightOf::Body, SightOf::Area, SightOf::Waterway})
    EXPECT_EQ(sight_of(below, what), Sight::BelowGround);
  EXPECT_EQ(sight_of(below, SightOf::Way), Sight::Open);
}

TEST(OutOfSight, CellarsAloneAreBelowGround) {
  const std::vector<std::pair<Tags, Sight>> bodies = {
      {{{"building:levels:underground", "2"}}, Sight::BelowGround},
      {{{"building:levels:underground", "2"}, {"building:levels", "0"}}, Sight::BelowGround},
      {{{"building:levels:underground", "2"}, {"building:levels", "3"}}, Sight::Open},
      {{{"building:levels:underground", "1"}, {"height", "6"}}, Sight::Open},
      {{{"building:levels:underground", "1"}, {"roof:shape", "gabled"}}, Sight::Open},
      {{{"building:levels:underground", "0"}}, Sight::Open},
      {{{"amenity", "parking"}, {"parking", "underground"}}, Sight::BelowGround},
      {{{"building", "apartments"}, {"parking", "underground"}, {"building:levels", "5"}},
       Sight::Open},
      {{{"amenity", "parking"}, {"parking", "surface"}}, Sight::Open}};
  for (const auto& [tags, sight] : bodies)
    EXPECT_EQ(sight_of(FeatureTags(tags), SightOf::Body), sight) << tags[0].second;
}

TEST(OutOfSight, BuildingsBelowGroundAreLeftOutAndCounted) {
  const ScratchFolder folder;
  write_vectors(
      folder / "a.gpkg", "GPKG",
      {{wkt(0, 0, 12, 9), {{"building", "yes"}, {"location", "underground"}}},
       {wkt(40, 0, 12, 9), {{"building", "parking"}, {"parking", "underground"}}},
       {wkt(80, 0, 12, 9), {{"building:part", "yes"}, {"indoor", "room"}, {"level", "-2"}}},
       {wkt(120, 0, 12, 9), {{"building", "yes"}, {"covered", "yes"}}},
       {wkt(160, 0, 12, 9), {{"building", "yes"}, {"layer", "1"}, {"building:levels", "2"}}}},
      "EPSG:32631");
  const Built built(files_key(folder / "a.gpkg"));
  EXPECT_EQ(built.count("buildings"), 1);
  EXPECT_EQ(built.count("below ground, left out"), 2);
  EXPECT_EQ(built.count("indoors, left out"), 1);
  EXPECT_EQ(built.count("under a cover, left out"), 1);
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
       square(tiler::FeatureKind::Area, {{"natural", "water"}, {"covered", "T"}})},
      500.0);
  EXPECT_EQ(water.polygons.size(), 1U);
  const auto sorted = tiler::sort_features(
      {square(tiler::FeatureKind::Area, {{"amenity", "parking"}}),
       square(tiler::FeatureKind::Area, {{"amenity", "parking"}, {"layer", "-1"}}),
       square(tiler::FeatureKind::Area, {{"amenity", "parking"}, {"level", "-1"}}),
       square(tiler::FeatureKind::Area, {{"amenity", "bench"}, {"highway", "proposed"}})},
      {}, 500.0);
  EXPECT_EQ(sorted.areas.size(), 1U);
  EXPECT_EQ(sorted.num_not_built, 1);
  std::vector<std::pair<std::string, std::int64_t>> counts;
  sorted.hidden.append_to(counts);
  EXPECT_EQ(counts,
            (std::vector<std::pair<std::string, std::int64_t>>{{"below ground, left out", 2}}));
}

}  // namespace
}  // namespace terracast::test
