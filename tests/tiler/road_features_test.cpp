// What features of maps make of roads: marks and strips, the ways' network, what is repaired or left out, and what is
// painted on.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <set>

#include "core/toml_reader.h"
#include "tests/tiler/made_layer.h"
#include "tests/tiler/road_worlds.h"
#include "tiler/layer_stack.h"
#include "tiler/roads/road_bed.h"
#include "tiler/roads/road_network.h"
#include "tiler/roads/road_paint.h"
#include "tiler/tile_builder.h"

namespace terracast::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using world::Cover;
using world::kHeightStep_m;
using world::Marking;

TEST(Roads, MarksStopBeforeJunctionsAndStripsKnowTheirFeatures) {
  const RoadWorld world(
      world_of("plane"),
      {{.number = 7,
        .points_world = {{-200, 3}, {0, 3}, {200, 3}},
        .tags = {{"highway", "primary"}}},
       {.number = 9, .points_world = {{0, 3}, {0, 200}}, .tags = {{"highway", "secondary"}}},
       {.number = 11,
        .points_world = {{-900, -500}, {600, -500}},
        .tags = {{"aeroway", "runway"}, {"ref", "09/27"}, {"width", "30"}}}});
  const world::Tile tile = build_tile(*world.finished, {3, 0, 0});
  bool has_side_road = false;
  for (const world::Strip& strip : tile.objects.strips)
    if (strip.coating.feature == 9) {
      has_side_road = true;
      EXPECT_EQ(strip.marking, Marking::Lanes);
      // From the junction's middle: beyond the other road's edge, 4 m.
      EXPECT_GT(strip.unmarked_start_m, 4.0);
      EXPECT_EQ(strip.unmarked_end_m, 0.0);
      EXPECT_NEAR(strip.whole_m, 197.0, 0.5);
      EXPECT_EQ(strip.half_width_steps, static_cast<int>(std::lround(3.75 / kHeightStep_m)));
    }
  EXPECT_TRUE(has_side_road);
  bool has_runway = false;
  for (int y : {-1, 0})
    for (const world::Strip& strip : build_tile(*world.finished, {3, 0, y}).objects.strips)
      if (strip.marking == Marking::Runway) {
        has_runway = true;
        EXPECT_EQ(strip.num_lanes, 9);
        EXPECT_NEAR(strip.whole_m, 1500.0, 1.0);
      }
  EXPECT_TRUE(has_runway);
  EXPECT_EQ(tiler::runway_number("03R/21L", {-1.0, -1.7}), 21);
  EXPECT_EQ(tiler::runway_number("", {0.0, 1.0}), 36);
  EXPECT_EQ(tiler::runway_number("99/00", {1.0, 0.0}), 9);
}

TEST(Roads, WaysOfTheWorldMeetWhereTheirSourcesDoAndLieWhereTheyAreDrawn) {
  const std::vector<Drawn> drawn = {
      {.number = 1,
       .points_world = {{-600, 3}, {0, 3}, {600, 3}},
       .tags = {{"highway", "primary"}, {"lanes", "4"}, {"maxspeed", "50"}}},
      {.number = 2,
       .points_world = {{0, 3}, {3, 300}},
       .tags = {{"highway", "residential"}, {"oneway", "-1"}, {"maxspeed", "20 mph"}}},
      {.number = 3,
       .points_world = {{3, 300}, {9, 340}, {3, 380}},
       .tags = {{"highway", "residential"}, {"bridge", "yes"}, {"layer", "1"}}},
      {.number = 4, .points_world = {{0, 3}, {-100, -300}}, .tags = {{"highway", "footway"}}},
      {.number = 5,
       .points_world = {{700, 3}, {700, 700}},
       .tags = {{"highway", "motorway"}, {"lanes", "2"}, {"maxspeed", "none"}}},
      {.number = 6,
       .points_world = {{-700, 60}, {-700, 200}},
       .tags = {{"highway", "service"}, {"access", "private"}}},
      {.number = 7,
       .points_world = {{-640, -30}, {-700, -30}},
       .tags = {{"railway", "rail"}, {"tracks", "2"}, {"maxspeed", "160"}}},
      {.number = 8,
       .points_world = {{-640, -90}, {-700, -90}},
       .tags = {{"railway", "tram"}, {"service", "siding"}, {"oneway", "yes"}}},
      {.number = 9,
       .points_world = {{-640, -150}, {-700, -150}},
       .tags = {{"railway", "funicular"}}},
      {.number = 10,
       .points_world = {{-640, -210}, {-700, -210}},
       .tags = {{"aeroway", "taxiway"}}}};
  const RoadWorld world(hills(60.0), drawn);
  const world::WayNetwork ways = world.finished->layers().ways();
  EXPECT_EQ(ways.parts.size(), 10u);  // the first way is two parts; taxiways are none
  std::map<std::uint64_t, std::vector<const world::WayPart*>> by_feature;
  for (const world::WayPart& part : ways.parts) {
    by_feature[part.feature].push_back(&part);
    // In its source's direction, on its source's line but for corners that are rounded by some metres.
    const std::vector<Vector2d>& line = drawn[part.feature - 1].points_world;
    const auto along = [&](const Vector2d& at) {
      return (at - line.front()).dot((line.back() - line.front()).normalized());
    };
    EXPECT_GT(along(part.at_world(part.points_steps.size() - 1)), along(part.at_world(0)));
    for (std::size_t i = 0; i < part.points_steps.size(); ++i) {
      double nearest_m = 1e300;
      for (std::size_t k = 0; k + 1 < line.size(); ++k) {
        const Vector2d step = line[k + 1] - line[k];
        const double t =
            std::clamp((part.at_world(i) - line[k]).dot(step) / step.squaredNorm(), 0.0, 1.0);
        nearest_m = std::min(nearest_m, (part.at_world(i) - line[k] - t * step).norm());
      }
      EXPECT_LT(nearest_m, part.feature == 2 || part.feature == 3 ? 1.0 : 0.02) << part.feature;
    }
  }
  // Where the first way has its middle, four ends meet: those of road and footway are one node.
  ASSERT_EQ(by_feature[1].size(), 2u);
  const auto middle_of = [](const world::WayPart& part) {
    return (part.at_world(0) - Vector2d(0, 3)).norm() < 0.1 ? part.from_node : part.to_node;
  };
  const std::uint32_t node = middle_of(*by_feature[1][0]);
  EXPECT_EQ(middle_of(*by_feature[1][1]), node);
  EXPECT_EQ(by_feature[2][0]->from_node, node);
  EXPECT_EQ(by_feature[4][0]->from_node, node);
  EXPECT_EQ(by_feature[2][0]->to_node, by_feature[3][0]->from_node);
  EXPECT_NE(by_feature[3][0]->to_node, node);
  // What their tags say.
  EXPECT_EQ(by_feature[1][0]->num_lanes, 4);
  EXPECT_EQ(by_feature[1][0]->max_speed_kmph, 50);
  EXPECT_TRUE(by_feature[1][0]->may_go_forward && by_feature[1][0]->may_go_backward);
  EXPECT_EQ(by_feature[2][0]->max_speed_kmph, 32);
  EXPECT_TRUE(!by_feature[2][0]->may_go_forward && by_feature[2][0]->may_go_backward);
  EXPECT_EQ(by_feature[4][0]->kind, world::WayKind::Footway);
  EXPECT_FALSE(by_feature[4][0]->may_go_forward);
  EXPECT_EQ(by_feature[5][0]->kind, world::WayKind::Motorway);
  EXPECT_EQ(by_feature[5][0]->max_speed_kmph, 0);
  EXPECT_FALSE(by_feature[5][0]->may_go_backward);
  // A motorway's lanes, 3.5 m wide at least, leave a hard shoulder of 2.5 m at most at the right.
  const double lanes_m =
      (by_feature[5][0]->lanes_left_steps - by_feature[5][0]->lanes_right_steps) * kHeightStep_m;
  EXPECT_GE(lanes_m, 7.0);
  EXPECT_LE(lanes_m, 10.5 - 2.5 - 0.5);
  EXPECT_GT(by_feature[5][0]->lanes_left_steps, -by_feature[5][0]->lanes_right_steps);
  EXPECT_FALSE(by_feature[6][0]->may_go_forward || by_feature[6][0]->may_go_backward);
  // Two tracks 4.2 m apart lie evenly across their bed, as they are drawn.
  const world::WayPart& rail = *by_feature[7][0];
  EXPECT_EQ(rail.kind, world::WayKind::Rail);
  EXPECT_EQ(rail.num_lanes, 2);
  EXPECT_EQ(rail.max_speed_kmph, 160);
  EXPECT_TRUE(rail.may_go_forward && rail.may_go_backward && !rail.is_siding);
  EXPECT_EQ(rail.lanes_left_steps, rail.half_width_steps);
  EXPECT_EQ(rail.lanes_right_steps, -rail.half_width_steps);
  EXPECT_NEAR(rail.half_width_steps * kHeightStep_m, 4.2, 0.01);
  EXPECT_EQ(by_feature[8][0]->kind, world::WayKind::Tram);
  EXPECT_TRUE(by_feature[8][0]->is_siding);
  EXPECT_TRUE(by_feature[8][0]->may_go_forward && !by_feature[8][0]->may_go_backward);
  EXPECT_EQ(by_feature[9][0]->kind, world::WayKind::Funicular);
  // On the bridge each point lies on the deck: on a triangle of its asphalt.
  const world::WayPart& bridge = *by_feature[3][0];
  EXPECT_TRUE(bridge.is_bridge);
  const world::Solid* deck = nullptr;
  const world::Tile tile = build_tile(*world.finished, {1, 0, 0});
  for (const world::Solid& solid : tile.objects.solids)
    if (solid.provenance.feature == 3) deck = &solid;
  ASSERT_NE(deck, nullptr);
  const world::Shape& shape = deck->levels.front().shape;
  for (const Eigen::Vector3i& steps : bridge.points_steps) {
    const Vector3d at = steps.cast<double>() * kHeightStep_m;
    double nearest_m = 1e300;
    for (const auto& triangle : shape.triangles) {
      if (shape.finishes[triangle.finish].material != world::Material::Asphalt) continue;
      const auto corner = [&](std::size_t k) {
        return Vector3d(
            (deck->origin_steps + shape.vertices_steps[triangle.corners[k]]).cast<double>() *
            kHeightStep_m);
      };
      const Vector3d normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
      if (std::abs(normal.z()) < 0.5 * normal.norm()) continue;
      bool is_inside = true;  // with 2 cm to spare, for ends and seams
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector2d a = corner(k).head<2>(), step = corner((k + 1) % 3).head<2>() - a;
        const Vector2d off = at.head<2>() - a;
        is_inside &= (step.x() * off.y() - step.y() * off.x()) * (normal.z() > 0 ? 1 : -1) >
                     -0.02 * step.norm();
      }
      if (!is_inside) continue;
      const double z = corner(0).z() - (normal.x() * (at.x() - corner(0).x()) +
                                        normal.y() * (at.y() - corner(0).y())) /
                                           normal.z();
      nearest_m = std::min(nearest_m, std::abs(z - at.z()));
    }
    EXPECT_LT(nearest_m, 0.02) << at.transpose();
  }
  for (const world::WayPart& part : ways.parts)
    for (const Eigen::Vector3i& point : part.points_steps) {
      EXPECT_TRUE(part.is_bridge || point.z() == 0);
    }
}

TEST(Roads, AbsurdTagsAndBrokenWaysAreRepairedOrLeftOutAndCounted) {
  const RoadWorld world(
      world_of("plane"),
      {{.number = 1,
        .points_world = {{0, 0}, {100, 0}},
        .tags = {{"highway", "primary"}, {"lanes", "999"}}},
       {.number = 2,
        .points_world = {{0, 50}, {100, 50}},
        .tags = {{"highway", "primary"}, {"width", "1e9"}}},
       {.number = 3, .points_world = {{5, 90}, {5, 90}}, .tags = {{"highway", "primary"}}},
       {.number = 4, .points_world = {{0, 0}, {100, 0}}, .tags = {{"highway", "service"}}},
       {.number = 5, .points_world = {{0, -90}, {9000, -90}}, .tags = {{"highway", "primary"}}},
       {.number = 6,
        .points_world = {{-300, -300}, {-100, -100}, {-300, -100}, {-100, -300}, {-300, -300}},
        .tags = {{"highway", "residential"}}},
       {.number = 8,
        .kind = "Polygon",
        .points_world = {{300, 300}, {400, 400}, {400, 300}, {300, 400}, {300, 300}},
        .tags = {{"amenity", "parking"}}}});
  EXPECT_EQ(world.count("widths and lanes repaired"), 2);
  EXPECT_EQ(world.count("ways that are there twice"), 1);
  EXPECT_EQ(world.count("ways cut at the square"), 1);
  EXPECT_EQ(world.count("areas that are none"), 0);  // a bow tie is two triangles
  const world::Tile tile = build_tile(*world.finished, {2, 0, 0});
  for (const world::Strip& strip : tile.objects.strips) {
    EXPECT_LE(strip.half_width_steps * kHeightStep_m, 10.0);
    EXPECT_LE(strip.num_lanes, 8);
  }
}

TEST(Roads, AnAirfieldsGroundIsGrassAndNothingElseOfItIsTold) {
  const RoadWorld world(
      world_of("plane"),
      {{.number = 1,
        .kind = "Polygon",
        .points_world = {{-200, -100}, {300, -100}, {300, 150}, {-200, 150}, {-200, -100}},
        .tags = {{"aeroway", "aerodrome"}}},
       {.number = 2, .points_world = {{-100, 0}, {200, 0}}, .tags = {{"aeroway", "taxiway"}}}});
  EXPECT_EQ(world.count("airfields"), 1);
  const auto cover = [&](double x, double y) { return world.finished->sample(x, y).cover; };
  EXPECT_EQ(cover(290, 140), Cover::Grass);
  EXPECT_EQ(cover(-190, -90), Cover::Grass);
  for (const auto& [x, y] : {std::pair{310.0, 0.0}, {0.0, -110.0}, {0.0, 160.0}, {-210.0, 0.0}})
    EXPECT_NE(cover(x, y), Cover::Grass) << x << " " << y;
}

tiler::WayStyle street() {
  std::int64_t num_repaired = 0;
  const std::vector<std::pair<std::string, std::string>> tags = {{"highway", "residential"}};
  return *tiler::way_style(tiler::FeatureTags(tags), num_repaired);
}

TEST(RoadNetwork, PlacesThatAreNoneAndWaysOfAMillionPointsAreBounded) {
  const double nan = std::nan("");
  tiler::Way way;
  way.style = street();
  tiler::Way broken = way;
  broken.feature = 1;
  broken.points_world = {{nan, 0.0}, {0.0, 0.0}, {50.0, nan}, {100.0, 0.0}};
  tiler::Way empty = way;
  empty.feature = 2;
  empty.points_world = {{nan, nan}, {5.0, 5.0}};
  tiler::Way huge = way;
  huge.feature = 3;
  for (int i = 0; i < 1000000; ++i)
    huge.points_world.emplace_back(1e-3 * i, 300.0 + std::sin(0.01 * i));
  const auto start = std::chrono::steady_clock::now();
  const tiler::RoadNetwork network({broken, empty, huge}, 2048.0);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(5));
  EXPECT_EQ(network.counts().num_not_finite, 3);
  EXPECT_EQ(network.counts().num_without_length, 1);
  EXPECT_EQ(network.counts().num_thinned, 1);
  EXPECT_EQ(network.lines().size(), 2u);
  EXPECT_LT(network.stations().size(), 2000u);
}

/// Pieces are counted, not timed: what lies about a place is looked at for each piece there.
TEST(RoadNetwork, WaysThatAreScribbledOrCrowdAreLeftOutAndCounted) {
  std::vector<tiler::Way> ways;
  const auto add = [&](tiler::PointsWorld points) {
    tiler::Way way;
    way.style = street();
    way.feature = ways.size() + 1;
    way.points_world = std::move(points);
    ways.push_back(way);
  };
  add({{-500.0, 3.0}, {500.0, 3.0}});
  // To and fro over 40 m of it, ends 2 cm apart.
  tiler::PointsWorld scribble;
  for (int k = 0; k < 100'000; ++k)
    scribble.emplace_back((k % 2) * 40.0 + 0.02 * (k / 2 % 300), 0.02 * (k / 600));
  add(scribble);
  const tiler::RoadNetwork network(ways, 2048.0);
  EXPECT_EQ(network.counts().num_crowded, 1);
  ASSERT_EQ(network.lines().size(), 1u);
  EXPECT_NEAR(network.lines()[0].length_m(), 1000.0, 1e-6);
  // Streets of 4 pieces of 8 m each in a square of 32 m.
  ways.clear();
  constexpr int kMost = 2048 / 4;
  for (int k = 0; k < kMost + 7; ++k) add({{-16.0, -15.0 + 0.05 * k}, {16.0, -15.0 + 0.05 * k}});
  const auto kept = [&] {
    const tiler::RoadNetwork crowd(ways, 2048.0);
    EXPECT_EQ(crowd.counts().num_crowded, 7);
    EXPECT_EQ(crowd.counts().num_thinned, 0);
    std::set<std::uint64_t> features;
    for (const tiler::Way& way : crowd.ways()) features.insert(way.feature);
    return features;
  };
  const std::set<std::uint64_t> first = kept();
  EXPECT_EQ(first.size(), static_cast<std::size_t>(kMost));
  std::reverse(ways.begin(), ways.end());
  EXPECT_EQ(kept(), first);
  // Drawn every 15 mm for 600 m: thinned.
  ways.clear();
  tiler::PointsWorld fine;
  for (int k = 0; k <= 40'000; ++k) fine.emplace_back(0.015 * k - 300.0, 5.0);
  add(fine);
  add({fine[12'345], {fine[12'345].x(), 90.0}});  // a street that meets it at a point between
  const tiler::RoadNetwork drawn_finely(ways, 2048.0);
  EXPECT_EQ(drawn_finely.counts().num_thinned, 1);
  EXPECT_EQ(drawn_finely.counts().num_crowded, 0);
  // Points each 134 x 15 mm, the ends, and the one where they meet.
  const tiler::PointsWorld& drawn = drawn_finely.ways()[0].points_world;
  EXPECT_EQ(drawn.size(), 301u);
  EXPECT_NE(std::find(drawn.begin(), drawn.end(), fine[12'345]), drawn.end());
  // A scribble on 30 cm that ends where it began has no length that counts.
  ways.clear();
  tiler::PointsWorld knot;
  for (int k = 0; k < 9000; ++k) knot.emplace_back(0.3 * (k % 2), 0.02 * (k % 15));
  knot.emplace_back(0.002, 0.0);
  add(knot);
  const tiler::RoadNetwork knotted(ways, 2048.0);
  EXPECT_EQ(knotted.counts().num_crowded, 1);
  EXPECT_EQ(knotted.lines().size(), 0u);
  // As dense as ways may be drawn: a labyrinth, 900 m in a disc of 29 m, with a point each half metre.
  tiler::PointsWorld labyrinth;
  constexpr double kRadius_m = 14.5;
  for (int k = 1; k <= 1800; ++k) {
    const double radius_m = kRadius_m * std::sqrt(k / 1800.0);
    const double angle_rad = 2.0 * 900.0 / kRadius_m * radius_m / kRadius_m;
    labyrinth.emplace_back(radius_m * std::cos(angle_rad), radius_m * std::sin(angle_rad));
  }
  ways.clear();
  add(labyrinth);
  EXPECT_EQ(tiler::RoadNetwork(ways, 2048.0).counts().num_crowded, 0);
}

/// A lake in a disc about the origin, level.
class Lake final : public tiler::Layer {
 public:
  world::LayerInfo info() const override { return {}; }
  std::string input_hash() const override { return "lake"; }
  std::optional<Cover> cover(const Vector2d& at, const tiler::SurfaceSample&) const override {
    return at.norm() < 100.0 ? std::optional(Cover::Lake) : std::nullopt;
  }
};

TEST(Roads, NothingIsPaintedOnWaterAndBridgesStandAboveIt) {
  const RoadWorld world(
      world_of("plane"),
      {{.number = 1, .points_world = {{-400, 0}, {400, 0}}, .tags = {{"highway", "primary"}}}});
  const ScratchFolder& folder = world.folder;
  write_text(
      folder / "more.geojson",
      geojson(
          *world.bare,
          {{.number = 1, .points_world = {{-400, 0}, {400, 0}}, .tags = {{"highway", "primary"}}},
           {.number = 2,
            .points_world = {{-120, 50}, {120, 50}},
            .tags = {{"highway", "tertiary"}, {"bridge", "yes"}}},
           {.number = 3, .points_world = {{20, 150}, {60, 20}}, .tags = {{"man_made", "pier"}}},
           // Seen in Monaco in November 2026: stands were marked in the harbour.
           {.number = 4,
            .kind = "Polygon",
            .points_world = {{30, 40}, {220, 40}, {220, 140}, {30, 140}, {30, 40}},
            .tags = {{"amenity", "parking"}}},
           // A square that reaches over the water, where it is only painted.
           {.number = 5,
            .kind = "Polygon",
            .points_world = {{-240, 10}, {-20, 10}, {-20, 200}, {-240, 200}, {-240, 10}},
            .tags = {{"place", "square"}}}}));
  std::vector<std::unique_ptr<tiler::Layer>> layers;
  layers.push_back(std::make_unique<Lake>());
  tiler::LayerOptions options;
  core::TomlDocument::parse("kind = \"roads\"\nnumber_field = \"number\"\nfiles = [\"" +
                                (folder / "more.geojson").string() + "\"]\n",
                            "layer.toml")
      .read(options);
  layers.push_back(made_layer(options, *world.bare, 1, layers));
  const auto finished =
      tiler::layered_surface(world.bare, tiler::LayerStack(4096.0, std::move(layers)));
  const world::Tile tile = build_tile(*finished, {3, 0, 0});
  const world::Tile west = build_tile(*finished, {3, -1, 0});
  const world::Tile fine = build_tile(*finished, {0, 0, 0});
  for (const world::Tile* one : {&tile, &west, &fine})
    for (const world::Strip& strip : one->objects.strips)
      for (const Eigen::Vector2i& point : strip.points_steps)
        // A shore is known to 0.1 m, points to half a step.
        EXPECT_GT((point.cast<double>() * kHeightStep_m).norm(), 100.0 - 0.001);
  for (const world::TileId& id : {world::TileId{0, -1, 0}, world::TileId{3, -1, 0}}) {
    const world::Tile shore = build_tile(*finished, id);
    for (double x = -255.5; x < 0.0; x += 3.0)
      for (double y = 0.5; y < 256.0; y += 3.0) {
        const Vector2d at(x, y);
        // A tile's shore lies within a diagonal of its cells.
        if (std::abs(at.norm() - 100.0) < std::sqrt(2.0) * id.spacing_m()) continue;
        bool is_painted = false;
        for (const world::Area& area : shore.objects.areas) {
          std::vector<tiler::PointsWorld> rings;
          for (const auto& ring : area.rings_steps) {
            rings.emplace_back();
            for (const Eigen::Vector2i& corner : ring)
              rings.back().push_back(corner.cast<double>() * kHeightStep_m);
          }
          is_painted = is_painted || tiler::side_of_rings(rings, at).is_inside;
        }
        const bool is_in_square = x > -240.0 && x < -20.0 && y > 10.0 && y < 200.0;
        EXPECT_EQ(is_painted, is_in_square && at.norm() > 100.0)
            << id.name() << " " << at.transpose();
      }
  }
  EXPECT_FALSE(tile.objects.strips.empty());
  EXPECT_TRUE(
      std::any_of(fine.objects.strips.begin(), fine.objects.strips.end(),
                  [](const world::Strip& strip) { return strip.marking == Marking::Stands; }));
  ASSERT_EQ(tile.objects.solids.size(), 2u);
  const double lake_z = finished->sample(0.0, 50.0).z_world;
  EXPECT_EQ(lake_z, world.bare->sample(0.0, 50.0).z_world);
  for (const world::Solid& solid : tile.objects.solids) {
    const auto& shape = solid.levels.front().shape;
    count_bodies(shape);
    double lowest_m = 1e9;
    double highest_m = -1e9;
    for (const Eigen::Vector3i& vertex : shape.vertices_steps) {
      const double z = (solid.origin_steps + vertex).z() * kHeightStep_m - lake_z;
      lowest_m = std::min(lowest_m, z);
      highest_m = std::max(highest_m, z);
    }
    EXPECT_LT(lowest_m, -2.0);  // it stands on something
    EXPECT_GT(highest_m, 1.2);
  }
}

TEST(Roads, AndorrasWaysAreMadeInSeconds) {
  TERRACAST_NEEDS_SHARED_DATA("andorra/andorra.osm.pbf");
  const auto data = shared_data() / "andorra";
  tiler::WorldOptions options = world_of_rasters({data / "andorra_dem_3s.tif"}, 16384.0);
  options.origin_lat_deg = 42.54;
  options.origin_lon_deg = 1.56;
  options.elevation[0].vertical_datum = "egm96";
  options.elevation[0].unit = "m";
  options.elevation[0].nodata = "declared";
  tiler::LayerOptions layer;
  core::TomlDocument::parse(
      "kind = \"roads\"\nfiles = [\"" + (data / "andorra.osm.pbf").string() + "\"]\n", "layer.toml")
      .read(layer);
  const auto before = std::chrono::steady_clock::now();
  prepare(options);
  const auto bare = std::chrono::steady_clock::now();
  options.layers.push_back(layer);
  const auto world = prepare(options);
  const auto seconds = [](auto time) { return std::chrono::duration<double>(time).count(); };
  const auto after = std::chrono::steady_clock::now();
  RecordProperty("seconds", std::to_string(seconds((after - bare) - (bare - before))));
  EXPECT_LT(seconds((after - bare) - (bare - before)), 60.0);  // 5 s; machines are shared
  std::map<std::string, std::int64_t> counts;
  for (const auto& [name, count] : world->layers().infos().at(0).counts) counts[name] = count;
  EXPECT_GT(counts["roads, railways and runways"], 1500);
  EXPECT_GT(counts["bridges"], 100);
  // Ramps between both levels are too short for some, whose ways cannot be that far apart.
  EXPECT_LE(counts["crossings of bridges with less room than stated"],
            counts["crossings of bridges"] * 2 / 3);
  // Finished ground is whole, and tiles hold strips.
  const world::Tile tile = build_tile(*world, {3, -1, -1});
  EXPECT_GT(tile.objects.strips.size(), 10u);
}

}  // namespace
}  // namespace terracast::test
