#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>

#include "tests/tiler/object_worlds.h"
#include "tiler/layer_stack.h"
#include "tiler/surface.h"
#include "tiler/vector_source.h"
#include "world/tile_id.h"

namespace terracast::test {
namespace {

using core::ErrorKind;
using Eigen::Vector2d;
using world::Cover;
using world::Instance;
using world::TileId;

/// A road through the block, car parks on land and over the shore, a power line, a marina, an apron, a port.
std::vector<VectorSpec> features() {
  return {
      {"LINESTRING (" + line_of({{-1500, 200}, {900, 200}}) + ")",
       {{"osm_id", "1"}, {"highway", "primary"}, {"lanes", "2"}}},
      {area_of(-1000, -400, -880, -320), {{"osm_way_id", "2"}, {"amenity", "parking"}}},
      {area_of(540, -400, 700, -320), {{"osm_way_id", "3"}, {"amenity", "parking"}}},
      {"LINESTRING (" + line_of({{-1400, -900}, {-1050, -880}, {-700, -700}, {1500, -700}}) + ")",
       {{"osm_id", "4"}, {"power", "line"}, {"voltage", "400000"}}},
      {area_of(700, 400, 1100, 800), {{"osm_way_id", "5"}, {"leisure", "marina"}}},
      {area_of(-1500, 600, -1000, 800), {{"osm_way_id", "6"}, {"aeroway", "apron"}}},
      {area_of(100, 700, 590, 1200), {{"osm_way_id", "7"}, {"landuse", "port"}}},
      {"LINESTRING (" + line_of({{-1500, 260}, {-200, 260}}) + ")",
       {{"osm_id", "8"}, {"highway", "residential"}}},
      {"POINT (" + text_of(-700, -1200) + ")",
       {{"osm_id", "9"}, {"power", "generator"}, {"generator:source", "wind"}}},
      {"POINT (" + text_of(900, -1200) + ")",
       {{"osm_id", "10"}, {"ship", "tanker"}, {"direction", "90"}}},
      {"POINT (" + text_of(-900, -1200) + ")", {{"osm_id", "11"}, {"ship", "tanker"}}}};
}

TEST(Objects, AreNotShownInTheAirBesideWalls) {
  // Seen in Monaco in November 2026. Terraces 20 m high, whose walls stand 2 m beyond samples of all tiles.
  const auto terrace_z = [](double x) { return 300.0 + 20.0 * std::floor((x - 2.0) / 64.0); };
  const ScratchFolder folder;
  const PlacedWorld made(write(folder, features(), "all.geojson"));
  OpenLand land(*made.surface);
  land.z_at = [&](const Vector2d& place) { return terrace_z(place.x()); };
  int num_things = 0;
  int num_hidden = 0;
  for (const int x : {-1, 0}) {
    world::TileObjects objects;
    made.layer->add_objects({2, x, -1}, land, objects);
    for (const Instance& instance : objects.instances) {
      const double at = place_of(instance).x();
      const double z = instance.place_steps.z() * world::kHeightStep_m;
      if (std::abs(z - terrace_z(at)) > 0.01) continue;  // it stands upon another
      ++num_things;
      for (int level = 0; level <= 2; ++level) {
        const double spacing_m = std::exp2(level);
        const double west = spacing_m * std::floor(at / spacing_m);
        const double share = (at - west) / spacing_m;
        const double above_m =
            z - (1.0 - share) * terrace_z(west) - share * terrace_z(west + spacing_m);
        const bool is_shown = level <= instance.coarsest_level;
        if (is_shown) {
          EXPECT_LE(above_m, 0.25 + 0.3 * spacing_m) << made.name_of(instance) << " at " << at;
        }
        num_hidden += is_shown ? 0 : 1;
      }
    }
  }
  EXPECT_GT(num_things, 50);
  EXPECT_GT(num_hidden, 0);
}

TEST(Objects, RulesPlaceWhatFeaturesSayWhereItMayStand) {
  const ScratchFolder folder;
  const PlacedWorld made(write(folder, features(), "all.geojson"));
  std::map<std::string, int> by_first_word;
  const auto all = made.all();
  for (const auto& [id, instance] : all) {
    const std::string name = made.name_of(instance);
    ++by_first_word[name.substr(0, name.find(' '))];
    const Vector2d at = place_of(instance);
    EXPECT_LT(at.cwiseAbs().maxCoeff(), 0.5 * kSize_m);
    EXPECT_GT((at - Obstacles::kBlock).norm(), Obstacles::kBlockRadius_m) << name;
    const bool floats =
        name.find("ship") != std::string::npos || name.find("tanker") != std::string::npos ||
        name.find("yacht") != std::string::npos || name.find("boat") != std::string::npos ||
        name.find("pontoon") != std::string::npos;
    EXPECT_EQ(at.x() > Obstacles::kShore_m, floats) << name << " at " << at.x();
    // Feet on the ground, whatever stands on what.
    const double above_m = instance.place_steps.z() * world::kHeightStep_m -
                           made.surface->sample(at.x(), at.y()).z_world;
    if (name.find("container_") != 0 || name.find("ship") != std::string::npos) {
      EXPECT_NEAR(above_m, 0.0, world::kHeightStep_m) << name;
    }
    EXPECT_EQ(instance.provenance.feature >= tiler::osm_number(tiler::OsmKind::Node, 0), true);
  }
  EXPECT_GT(by_first_word["pylon"], 5);
  EXPECT_GT(by_first_word["street_lamp"], 20);
  EXPECT_GT(by_first_word["pontoon"], 10);
  EXPECT_GT(by_first_word["sailing_yacht"], 10);
  EXPECT_GT(by_first_word["container_40"], 50);
  EXPECT_GT(by_first_word["airliner"] + by_first_word["airliner_with_winglets"], 2);
  EXPECT_EQ(by_first_word["wind_turbine"] + by_first_word["wind_turbine_large"], 1);
  EXPECT_EQ(by_first_word["tanker"], 1) << "the one on land is left out";
  EXPECT_EQ(made.count_of("ships left out in water or on dry land"), 1);
  EXPECT_GT(made.count_of("parked cars"), 40);
  EXPECT_GT(made.count_of("parked cars left out in water or on dry land"), 5);
  EXPECT_GT(made.count_of("traffic"), 10);
  EXPECT_GT(made.count_of("traffic left out where other layers are"), 0);
  std::int64_t counted = 0;
  for (const char* rule : {"power lines", "landmarks", "aircraft", "ships", "ports", "boats",
                           "street lamps", "parked cars", "traffic"})
    counted += made.count_of(rule);
  EXPECT_EQ(counted, static_cast<std::int64_t>(all.size())) << "what is counted is what stands";
}

TEST(Objects, NoTwoThingsOnTheGroundRunIntoEachOther) {
  const ScratchFolder folder;
  const PlacedWorld made(write(folder, features(), "all.geojson") +
                         "traffic = 4.0\nparked_cars = 1.0\n");
  struct Box {
    Vector2d middle, along;
    double half_length, half_width;
    double low_z, high_z;
    std::string name;
  };
  std::vector<Box> boxes;
  for (const auto& [id, instance] : made.all()) {
    const std::string name = made.name_of(instance);
    // Cranes and pylons have room between their legs, and rotors and arms above: not boxes.
    if (name.find("crane") != std::string::npos || name.find("pylon") == 0 ||
        name.find("wind") == 0 || name.find("lamp") != std::string::npos)
      continue;
    const world::Shape& shape = made.layer->prototypes()[instance.prototype].levels[0].shape;
    Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9), high = -low;
    for (const Eigen::Vector3i& vertex : shape.vertices_steps) {
      low = low.cwiseMin(vertex.cast<double>() * world::kHeightStep_m);
      high = high.cwiseMax(vertex.cast<double>() * world::kHeightStep_m);
    }
    const double turn = instance.heading * 2.0 * std::numbers::pi / 65536.0;
    const Vector2d along(std::cos(turn), std::sin(turn));
    const double z = instance.place_steps.z() * world::kHeightStep_m;
    const Eigen::Vector3d middle = 0.5 * (low + high);
    boxes.push_back(
        {place_of(instance) + middle.x() * along + middle.y() * Vector2d(-along.y(), along.x()),
         along, 0.5 * (high - low).x(), 0.5 * (high - low).y(), z + low.z(), z + high.z(), name});
  }
  ASSERT_GT(boxes.size(), 300U);
  // All pairs, by how far they reach into each other along the axes of both.
  for (std::size_t i = 0; i < boxes.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const Box& a = boxes[i];
      const Box& b = boxes[j];
      const Vector2d between = b.middle - a.middle;
      if (between.norm() > a.half_length + a.half_width + b.half_length + b.half_width) continue;
      double least = 1e9;
      for (const Vector2d& axis : {a.along, Vector2d(-a.along.y(), a.along.x()), b.along,
                                   Vector2d(-b.along.y(), b.along.x())}) {
        const auto reach = [&](const Box& box) {
          return std::abs(axis.dot(box.along)) * box.half_length +
                 std::abs(axis.dot(Vector2d(-box.along.y(), box.along.x()))) * box.half_width;
        };
        least = std::min(least, reach(a) + reach(b) - std::abs(between.dot(axis)));
      }
      const double stacked = std::min(a.high_z, b.high_z) - std::max(a.low_z, b.low_z);
      // The table's sizes hold to 1 %; piles stand on each other to the lattice.
      EXPECT_LT(std::min(least, stacked), 0.01 + 0.01 * (a.half_length + b.half_length))
          << a.name << " and " << b.name;
    }
}

TEST(Objects, EveryTileShowsTheSameThingsWholeInAnyOrder) {
  const ScratchFolder folder;
  std::vector<VectorSpec> specs = features();
  const PlacedWorld made(write(folder, specs, "all.geojson"));
  std::reverse(specs.begin(), specs.end());
  const PlacedWorld other(write(folder, specs, "reversed.geojson"));
  const auto all = made.all();
  const auto reversed = other.all();
  ASSERT_EQ(all.size(), reversed.size());
  for (const auto& [id, instance] : all) {
    ASSERT_EQ(reversed.count(id), 1U);
    EXPECT_EQ(reversed.at(id).place_steps, instance.place_steps);
    EXPECT_EQ(other.name_of(reversed.at(id)), made.name_of(instance));
  }
  // Tiles of other sizes, from the last to the first; what lies on a border is in both, the same.
  std::map<std::uint32_t, world::Solid> spans;
  std::size_t num_seen = 0;
  for (const int level : {-2, 1, 2})
    for (int y = 3; y >= -4; --y)
      for (int x = 3; x >= -4; --x) {
        const world::TileObjects objects = made.on({static_cast<std::int8_t>(level), x, y});
        for (const Instance& instance : objects.instances) {
          const auto found = all.find(instance.provenance.instance_id);
          if (found == all.end()) continue;  // seen from afar only
          EXPECT_EQ(found->second, instance);
          ++num_seen;
        }
        for (const world::Solid& solid : objects.solids) {
          const auto [entry, is_new] = spans.emplace(solid.provenance.instance_id, solid);
          if (!is_new) {
            EXPECT_EQ(entry->second, solid);
          }
        }
      }
  EXPECT_GT(num_seen, 200U);
  EXPECT_EQ(static_cast<std::int64_t>(spans.size()), made.count_of("spans of wires"));
  EXPECT_GT(spans.size(), 4U);
}

// A fence of 100 m is one of 100 m: pieces stand end to end, and where it may not stand a gap is left.
TEST(Objects, BarriersHaveThePiecesOfTheirLine) {
  const ScratchFolder folder;
  const PlacedWorld made(write(
      folder,
      {{"LINESTRING (" + line_of({{-1000.0, -1000.0}, {-900.0, -1000.0}}) + ")",
        {{"osm_id", "21"}, {"barrier", "fence"}}},
       {"LINESTRING (" + line_of({{-1000.0, -800.0}, {-970.0, -800.0}, {-970.0, -760.0}}) + ")",
        {{"osm_id", "22"}, {"barrier", "hedge"}}},
       {"LINESTRING (" + line_of({{400.0, -800.0}, {Obstacles::kShore_m + 200.0, -800.0}}) + ")",
        {{"osm_id", "23"}, {"barrier", "wall"}}},
       {"LINESTRING (" + line_of({{0.0, -800.0}, {50.0, -800.0}}) + ")",
        {{"osm_id", "24"}, {"barrier", "kerb"}}}},
      "barriers.geojson"));
  std::map<std::string, double> length_m;
  double farthest_wall_m = -1e9;
  double least_x = 1e9;
  double most_x = -1e9;
  for (const auto& [id, instance] : made.all()) {
    const std::string name = made.name_of(instance);
    const std::string kind = name.substr(0, name.find(' '));
    const double piece_m = 3.0 * instance.scale / 4096.0;
    length_m[kind] += piece_m;
    if (kind == "garden_wall") farthest_wall_m = std::max(farthest_wall_m, place_of(instance).x());
    if (kind != "board_fence") continue;
    least_x = std::min(least_x, place_of(instance).x() - 0.5 * piece_m);
    most_x = std::max(most_x, place_of(instance).x() + 0.5 * piece_m);
  }
  // Between pieces a step or three of 4096 to 3 m is left.
  EXPECT_NEAR(length_m["board_fence"], 100.0, 34 * 3.0 * 3.0 / 4096.0);
  EXPECT_NEAR(least_x, -1000.0, 0.01);
  EXPECT_NEAR(most_x, -900.0, 0.01);
  // At a corner both sides end half a hedge before it.
  EXPECT_NEAR(length_m["hedge"], 70.0 - 0.9, 24 * 3.0 * 3.0 / 4096.0);
  EXPECT_LT(farthest_wall_m, Obstacles::kShore_m);
  EXPECT_GT(made.count_of("barriers left out in water or on dry land"), 50);
  EXPECT_EQ(length_m.size(), 3U) << "a kerb is none of them";
}

TEST(Objects, NothingStandsOnGroundTooSteepForIt) {
  const ScratchFolder folder;
  const auto sloping = [](tiler::WorldOptions& options) { options.elevation[0].slope = 0.2; };
  const PlacedWorld steep(write(folder, features(), "all.geojson"), "ramp", sloping);
  EXPECT_EQ(steep.count_of("parked cars"), 0);
  EXPECT_EQ(steep.count_of("traffic"), 0);
  EXPECT_GT(steep.count_of("traffic left out on steep ground"), 10);
  EXPECT_GT(steep.count_of("power lines"), 5) << "pylons stand on slopes";
}

TEST(Objects, ListsPutThingsWhereTheySay) {
  const ScratchFolder folder;
  const geo::WorldFrame frame(
      {.lat_deg = kOriginLat_deg, .lon_deg = kOriginLon_deg, .height_m = 0.0});
  write_text(folder / "list.csv",
             "thing, x, y, heading_deg, scale, height_m\n# a comment\nhatchback, 10.5, -20.25, 90, "
             "1, 0\nairliner,500,500,0,1.5,12.5\r\n\nhatchback, 10.5, -20.25, 90, 1, 0\n");
  const PlacedWorld made(fmt::format("placements = [\"{}\"]\n", (folder / "list.csv").string()));
  const auto all = made.all();
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(made.count_of("list.csv: rows given twice"), 1);
  for (const auto& [id, instance] : all) {
    if (made.name_of(instance).find("hatchback") == 0) {
      EXPECT_EQ(place_of(instance), Vector2d(10.5, -20.25));
      EXPECT_EQ(instance.heading, 0) << "east";
      EXPECT_EQ(instance.provenance.feature, 3U) << "its line";
    } else {
      EXPECT_EQ(instance.heading, 16384) << "north";
      EXPECT_EQ(instance.scale, 6144);
      EXPECT_NEAR(
          instance.place_steps.z() * world::kHeightStep_m - made.surface->sample(500, 500).z_world,
          12.5, world::kHeightStep_m);
    }
  }
  const geo::Geodetic at = frame.geodetic_from_world({-321.0, 654.0, 0.0});
  write_text(folder / "degrees.csv",
             fmt::format("lat,lon,thing\n{:.12f},{:.12f},lighthouse\n", at.lat_deg, at.lon_deg));
  write_vectors(folder / "points.geojson", "GeoJSON",
                {{"POINT (" + text_of(-321, 654) + ")", {{"thing", "lighthouse"}}}});
  for (const char* name : {"degrees.csv", "points.geojson"}) {
    const PlacedWorld one(fmt::format("placements = [\"{}\"]\n", (folder / name).string()));
    ASSERT_EQ(one.all().size(), 1U) << name;
    // The plane's height moves a place by its share of 654 m over the Earth's radius.
    EXPECT_LT((place_of(one.all().begin()->second) - Vector2d(-321, 654)).norm(), 0.1) << name;
  }
}

/// As of a list in another place's metres.
TEST(Objects, ListsFarOutsideAreCountedAndCostLittle) {
  const ScratchFolder folder;
  constexpr int kNumOutside = 100'000;
  std::string text = "thing,x,y\nvan,10,20\n";
  for (int i = 0; i < kNumOutside; ++i)
    text += fmt::format("van,{},{}\n", 20'000 + 3 * (i % 1000), -30'000 - 7 * (i / 1000));
  write_text(folder / "list.csv", text);
  const auto start = std::chrono::steady_clock::now();
  const PlacedWorld made(fmt::format("placements = [\"{}\"]\n", (folder / "list.csv").string()));
  EXPECT_EQ(made.all().size(), 1U);
  EXPECT_EQ(made.count_of("placements left out beyond the square"), kNumOutside);
  // A second or two; hours where each were held against each.
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
}

// Seen in November 2026: a row whose latitude and longitude were swapped ended in an internal check.
TEST(Objects, PlacesAnywhereOnEarthAreCounted) {
  const ScratchFolder folder;
  write_text(folder / "list.csv",
             fmt::format("thing,lat,lon\nvan,{0},{1}\nvan,{1},{0}\nvan,{1},{0}\nvan,0,0\n"
                         "van,-90,0\nvan,90,0\nvan,{2},{3}\nvan,{0},{4}\n",
                         kOriginLat_deg, kOriginLon_deg, -kOriginLat_deg, kOriginLon_deg - 180.0,
                         kOriginLon_deg + 30.0));
  const PlacedWorld made(fmt::format("placements = [\"{}\"]\n", (folder / "list.csv").string()));
  EXPECT_EQ(made.all().size(), 1U);
  EXPECT_EQ(made.count_of("placements left out beyond the square"), 6);
  EXPECT_EQ(made.count_of("list.csv: rows given twice"), 1);
}

TEST(Objects, WhatIsNoPlaceInAFileOfFeaturesIsCounted) {
  const ScratchFolder folder;
  const auto point = [](double lat_deg, double lon_deg) {
    return fmt::format(R"({{"type":"Point","coordinates":[{},{}]}})", lon_deg, lat_deg);
  };
  std::string features;
  for (const std::string& geometry :
       {point(kOriginLat_deg, kOriginLon_deg), point(kOriginLon_deg, kOriginLat_deg),
        std::string("null"), std::string(R"({"type":"LineString","coordinates":[[0,0],[1,1]]})")})
    features += (features.empty() ? "" : ",") +
                (R"({"type":"Feature","properties":{"thing":"van"},"geometry":)" + geometry + "}");
  write_text(folder / "list.geojson",
             R"({"type":"FeatureCollection","features":[)" + features + "]}");
  const PlacedWorld made(
      fmt::format("placements = [\"{}\"]\n", (folder / "list.geojson").string()));
  EXPECT_EQ(made.all().size(), 1U);
  EXPECT_EQ(made.count_of("list.geojson: features outside the world"), 1);
  EXPECT_EQ(made.count_of("list.geojson: features without a geometry"), 1);
  EXPECT_EQ(made.count_of("list.geojson: features of no use here"), 1);
}

TEST(Objects, BadListsAreRefusedWithTheirLine) {
  const ScratchFolder folder;
  const auto refuses = [&](const std::string& text, const std::vector<std::string>& words) {
    SCOPED_TRACE(text);
    write_text(folder / "list.csv", text);
    expect_error(ErrorKind::Input, words, [&] {
      PlacedWorld(fmt::format("placements = [\"{}\"]\n", (folder / "list.csv").string()));
    });
  };
  refuses("", {"empty"});
  refuses("thing,x,y\nhatchbak,1,2\n", {"list.csv:2", "hatchbak", "hatchback"});
  refuses("thing,x,y\nvan,1\n", {"list.csv:2", "2 values"});
  refuses("thing,x,y\nvan,1,nan\n", {"list.csv:2", "y = \"nan\""});
  refuses("thing,x,y\nvan,1,1e99\n", {"outside"});
  refuses("thing,x,y,scale\nvan,1,2,900\n", {"scale"});
  refuses("thing,x,lat\nvan,1,2\n", {"header needs"});
  refuses("thing,x,y,colour\nvan,1,2,red\n", {"colour", "unknown"});
  refuses("thing,lat,lon\nvan,95,2\n", {"lat = 95"});
  expect_error(ErrorKind::Io, {"gone.csv"}, [&] { PlacedWorld("placements = [\"/gone.csv\"]\n"); });
  expect_error(ErrorKind::Config, {"placements"}, [&] { objects_of(""); });
}

TEST(Objects, VehiclesKeepToTheirSideAndFaceTheirWay) {
  const ScratchFolder folder;
  const std::string file = write(folder,
                                 {{"LINESTRING (" + line_of({{-1900, -500}, {500, -500}}) + ")",
                                   {{"osm_id", "1"}, {"highway", "primary"}}}},
                                 "road.geojson");
  for (const bool is_left : {false, true}) {
    const PlacedWorld made(file + "traffic = 4.0\nlamp_spacing_m = 0\n" +
                           (is_left ? "drives_on_left = true\n" : ""));
    const auto all = made.all();
    EXPECT_GT(all.size(), 30U);
    for (const auto& [id, instance] : all) {
      const bool goes_east = instance.heading < 16384 || instance.heading > 49152;
      const double off_m = place_of(instance).y() + 500.0;
      // The middle of a lane of 3.5 m; a line straight in degrees bows by 2400^2 / 8 R tan 43, 0.11 m.
      EXPECT_NEAR(off_m, (goes_east != is_left ? -1.0 : 1.0) * 1.75, 0.12);
    }
  }
}

}  // namespace
}  // namespace terracast::test
