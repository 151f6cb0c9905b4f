// Airfields and yards: what is kept low beside runways, and what stands where a feature says.

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "tests/tiler/object_worlds.h"

namespace terracast::test {
namespace {

using core::ErrorKind;
using Eigen::Vector2d;

TEST(ObjectSites, StripsBesideRunwaysAndTaxiwaysAreKeptClear) {
  const ScratchFolder folder;
  const PlacedWorld made(
      write(folder,
            {{"LINESTRING (" + line_of({{-1500, 0}, {-300, 0}, {300, 0}}) + ")",
              {{"osm_id", "1"}, {"aeroway", "runway"}, {"width", "45"}}},
             {"LINESTRING (" + line_of({{-1500, 900}, {300, 900}}) + ")",
              {{"osm_id", "2"}, {"aeroway", "runway"}, {"width", "18"}}},
             {"LINESTRING (" + line_of({{700, -1500}, {700, -500}}) + ")",
              {{"osm_id", "3"}, {"aeroway", "taxiway"}}},
             {area_of(1200, -1500, 1600, -1100), {{"osm_way_id", "4"}, {"aeroway", "aerodrome"}}}},
            "airfield.geojson"));
  // A line straight in degrees bows by 1800^2 / 8 R tan 43, 0.06 m.
  for (const double x : {-1500.0, -700.0, -299.0, 299.0})
    for (const double side : {-1.0, 1.0}) {
      EXPECT_TRUE(made.layer->keeps_low({x, side * 149.8}, 0.0)) << x;
      EXPECT_FALSE(made.layer->keeps_low({x, side * 150.2}, 0.0)) << x;
      EXPECT_TRUE(made.layer->keeps_low({x, side * 153.0}, 3.5)) << x;
    }
  EXPECT_TRUE(made.layer->keeps_low({359.0, 0.0}, 0.0));
  EXPECT_FALSE(made.layer->keeps_low({361.0, 0.0}, 0.0));
  EXPECT_TRUE(made.layer->keeps_low({0.0, 974.8}, 0.0));
  EXPECT_FALSE(made.layer->keeps_low({0.0, 975.3}, 0.0));
  EXPECT_TRUE(made.layer->keeps_low({729.8, -1000.0}, 0.0));
  EXPECT_FALSE(made.layer->keeps_low({730.2, -1000.0}, 0.0));
  EXPECT_TRUE(made.layer->keeps_low({1400.0, -1300.0}, 0.0));
  EXPECT_FALSE(made.layer->keeps_low({1400.0, -1090.0}, 0.0));
  EXPECT_TRUE(made.layer->keeps_low({1400.0, -1090.0}, 10.5));
  EXPECT_FALSE(made.layer->keeps_low({1400.0, -1090.0}, 9.5));
  EXPECT_FALSE(made.layer->holds({0.0, 0.0}, 0.0)) << "other things may stand there";
  EXPECT_FALSE(made.layer->holds({1400.0, -1300.0}, 0.0));
}

TEST(ObjectSites, AerodromesAreFoundFromAnyCell) {
  const ScratchFolder folder;
  // A triangle with a hole.
  const std::string triangle =
      "POLYGON ((" + line_of({{-1900, -1900}, {1900, -1900}, {-1900, 1900}, {-1900, -1900}}) +
      "), (" +
      line_of({{-1300, -1300}, {-1300, -900}, {-900, -900}, {-900, -1300}, {-1300, -1300}}) + "))";
  const PlacedWorld made(write(
      folder, {{triangle, {{"osm_way_id", "1"}, {"aeroway", "aerodrome"}}}}, "airfield.geojson"));
  // Sides straight in degrees bow by 3800^2 / 8 R tan 43, 0.26 m.
  constexpr double kBow_m = 0.3;
  int num_inside = 0, num_outside = 0;
  for (double y = -2040.0; y < 2040.0; y += 37.0)
    for (double x = -2040.0; x < 2040.0; x += 37.0)
      for (const double radius_m : {0.0, 6.0, 150.0}) {
        const double to_edge_m = (x + y) / std::sqrt(2.0);
        const bool is_past_corner = y - x > 3800.0 || x - y > 3800.0;
        if (is_past_corner) continue;
        const double to_triangle_m = std::max({to_edge_m, -1900.0 - x, -1900.0 - y});
        const double in_hole_m = 200.0 - std::max(std::abs(x + 1100.0), std::abs(y + 1100.0));
        const double off_m = std::max(to_triangle_m, in_hole_m);
        if (std::abs(off_m - radius_m) < kBow_m) continue;
        // Beyond a corner the distance to the sides' lines is less than that to the triangle.
        if (-1900.0 - x > 0.0 && -1900.0 - y > 0.0) continue;
        const bool is_kept = off_m < radius_m;
        ++(is_kept ? num_inside : num_outside);
        ASSERT_EQ(made.layer->keeps_low({x, y}, radius_m), is_kept)
            << x << " " << y << " " << radius_m;
      }
  EXPECT_GT(num_inside, 10'000);
  EXPECT_GT(num_outside, 10'000);
}

TEST(ObjectSites, ManyAerodromesDoNotMakeTilingEndless) {
  const ScratchFolder folder;
  const auto fields = [](int count, double apart_m) {
    std::vector<VectorSpec> all;
    for (int i = 0; i < count; ++i) {
      const double x = -1900.0 + apart_m * (i % 200), y = -1900.0 + apart_m * (i / 200);
      all.push_back({area_of(x, y, x + 9.0, y + 9.0),
                     {{"osm_way_id", std::to_string(i + 1)}, {"aeroway", "aerodrome"}}});
    }
    return all;
  };
  const PlacedWorld made(write(folder, fields(20'000, 18.0), "many.geojson"));
  int num_kept = 0;
  for (int i = 0; i < 200'000; ++i)
    num_kept +=
        made.layer->keeps_low({-1895.5 + 9.0 * (i % 400), -1895.5 + 9.0 * (i / 400 % 200)}, 0.0)
            ? 1
            : 0;
  EXPECT_EQ(num_kept, 50'000);
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < 2'000'000; ++i)
    num_kept += made.layer->keeps_low({-1800.0 + 0.0018 * i, 700.0}, 2.0) ? 1 : 0;
  EXPECT_EQ(num_kept, 50'000);
  // Less than a second; minutes where each is held against all aerodromes.
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
  expect_error(ErrorKind::Input, {"aerodromes", "aeroway"},
               [&] { PlacedWorld(write(folder, fields(20'000, 0.0), "stacked.geojson")); });
}

TEST(ObjectSites, PartsOfYardsHaveThingsOfTheirOwn) {
  const ScratchFolder folder;
  const auto ring = [](double x) {
    return "((" + line_of({{x, -900}, {x + 100, -900}, {x + 100, -840}, {x, -840}, {x, -900}}) +
           "))";
  };
  const PlacedWorld made(
      write(folder,
            {{"MULTIPOLYGON (" + ring(-1500) + ", " + ring(-1300) + ")",
              {{"osm_way_id", "2"}, {"landuse", "industrial"}, {"industrial", "container_yard"}}},
             {"MULTILINESTRING ((" + line_of({{-1500, -300}, {-1300, -300}}) + "), (" +
                  line_of({{-900, -300}, {-700, -300}}) + "))",
              {{"osm_id", "1"}, {"amenity", "loading_dock"}}}},
            "yards.geojson"));
  std::map<std::pair<bool, bool>, int> counts;
  for (const auto& [id, instance] : made.all()) {
    const bool is_container = made.name_of(instance).find("container") == 0;
    const double x = place_of(instance).x();
    ++counts[{is_container, is_container ? x > -1350.0 : x > -1100.0}];
  }
  for (const bool is_second : {false, true}) {
    EXPECT_GT((counts[{true, is_second}]), 20) << is_second;
    EXPECT_GT((counts[{false, is_second}]), 10) << is_second;
  }
}

TEST(ObjectSites, BridgesReachFromWallsToAircraft) {
  const ScratchFolder folder;
  const Vector2d wall(-491.0, -300.0), door(-496.6, -316.4), stop(-500.0, -317.5);
  const PlacedWorld made(write(folder,
                               {{"LINESTRING (" + line_of({stop - Vector2d(0, 50), stop}) + ")",
                                 {{"osm_id", "1"}, {"aeroway", "parking_position"}}},
                                {"LINESTRING (" + line_of({wall, door}) + ")",
                                 {{"osm_id", "2"}, {"aeroway", "jet_bridge"}}}},
                               "stand.geojson") +
                         "aircraft = 1.0\n");
  const auto all = made.all();
  ASSERT_EQ(all.size(), 2U) << "one bridge, and the aircraft though the bridge reaches to it";
  for (const auto& [id, instance] : all) {
    const double turn = instance.heading * 2.0 * std::numbers::pi / 65536.0;
    const Vector2d ahead(std::cos(turn), std::sin(turn));
    const world::Shape& shape = made.layer->prototypes()[instance.prototype].levels[0].shape;
    double nose_m = -1e9;
    for (const Eigen::Vector3i& vertex : shape.vertices_steps)
      nose_m = std::max(nose_m, vertex.x() * world::kHeightStep_m);
    const Vector2d nose = place_of(instance) + nose_m * (instance.scale / 4096.0) * ahead;
    // The table's sizes hold to 1 %, and shapes need not lie quite about their middle.
    if (made.name_of(instance) == "jet_bridge") {
      EXPECT_LT((nose - door).norm(), 0.3);
    } else {
      EXPECT_LT((nose - stop - Vector2d(0, 6)).norm(), 0.6) << made.name_of(instance);
    }
  }
}

TEST(ObjectSites, TrucksStandWithTheirTailsToDocksAndContainersInTheirYard) {
  const ScratchFolder folder;
  const PlacedWorld made(
      write(folder,
            {{"LINESTRING (" + line_of({{-900, -300}, {-700, -300}}) + ")",
              {{"osm_id", "1"}, {"amenity", "loading_dock"}}},
             {area_of(-1500, -900, -1400, -840),
              {{"osm_way_id", "2"}, {"landuse", "industrial"}, {"industrial", "container_yard"}}}},
            "yards.geojson"));
  int num_trucks = 0, num_boxes = 0;
  for (const auto& [id, instance] : made.all()) {
    const std::string name = made.name_of(instance);
    const Vector2d at = place_of(instance);
    if (name.find("container") == 0) {
      ++num_boxes;
      EXPECT_TRUE(at.x() > -1494 && at.x() < -1406 && at.y() > -899 && at.y() < -841);
      continue;
    }
    ++num_trucks;
    // To the left of the line, nose away from it: half a truck's length of 8.8 to 16.5 m off.
    EXPECT_NEAR(instance.heading, 16384, 1) << name;
    EXPECT_GT(at.y(), -300.0 + 4.4);
    EXPECT_LT(at.y(), -300.0 + 8.75);
    EXPECT_TRUE(at.x() > -900 && at.x() < -700);
  }
  EXPECT_GT(num_trucks, 8);
  EXPECT_LT(num_trucks, 47) << "some docks are free";
  EXPECT_GT(num_boxes, 20);
  EXPECT_EQ(made.count_of("yards"), num_trucks + num_boxes);
}

}  // namespace
}  // namespace terracast::test
