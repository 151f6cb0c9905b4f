#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "tests/tiler/building_facts.h"
#include "tests/tiler/building_layers.h"
#include "tests/tiler/vector_files.h"

namespace terracast::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using world::kHeightStep_m;

using Tags = std::vector<std::pair<std::string, std::string>>;

/// Solids by their features' numbers.
std::map<std::uint64_t, world::Solid> by_number(const Built& built, int level) {
  constexpr std::uint64_t kId = (std::uint64_t{1} << 60) - 1;  // without the kind of OpenStreetMap
  std::map<std::uint64_t, world::Solid> solids;
  for (const auto& [id, solid] : built.all({}, level))
    solids[solid.provenance.feature & kId] = solid;
  return solids;
}

std::vector<Vector3d> corners_of(const world::Solid& solid, int level) {
  std::vector<Vector3d> corners;
  for (const auto& vertex : world::shape_at(solid.levels, level)->vertices_steps)
    corners.push_back((solid.origin_steps + vertex).cast<double>() * kHeightStep_m);
  return corners;
}

double lowest_z(const world::Solid& solid, int level) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const Vector3d& corner : corners_of(solid, level)) lowest = std::min(lowest, corner.z());
  return lowest;
}

/// World z of a solid's highest face over a place; -inf: there is none.
double roof_z(const world::Solid& solid, int level, const Vector2d& place) {
  const world::Shape& shape = *world::shape_at(solid.levels, level);
  const std::vector<Vector3d> corners = corners_of(solid, level);
  double highest = -std::numeric_limits<double>::infinity();
  for (const auto& triangle : shape.triangles) {
    const Vector3d &a = corners[triangle.corners[0]], &b = corners[triangle.corners[1]],
                   &c = corners[triangle.corners[2]];
    Eigen::Matrix2d sides;
    sides << (b - a).head<2>(), (c - a).head<2>();
    if (std::abs(sides.determinant()) < 1e-9) continue;  // upright
    const Vector2d at = sides.inverse() * (place - a.head<2>());
    if (at.minCoeff() < 0.0 || at.sum() > 1.0) continue;
    highest = std::max(highest, a.z() + at.x() * (b - a).z() + at.y() * (c - a).z());
  }
  return highest;
}

/// Places all over a solid; its box is turned against it by a degree or so.
std::vector<Vector2d> places_under(const world::Solid& solid, int level) {
  const auto [low, high] = box_of(*world::shape_at(solid.levels, level));
  const Vector2d origin = solid.origin_steps.head<2>().cast<double>() * kHeightStep_m;
  std::vector<Vector2d> places;
  for (const double u : {0.1, 0.3, 0.5, 0.7, 0.9})
    for (const double v : {0.1, 0.3, 0.5, 0.7, 0.9})
      places.push_back(origin + low.head<2>() +
                       Vector2d(u, v).cwiseProduct((high - low).head<2>()));
  return places;
}

Tags part(std::uint64_t number, const char* low, const char* high) {
  return {{"osm_way_id", std::to_string(number)},
          {"building:part", "yes"},
          {"building", ""},
          {"roof:shape", "flat"},
          {"min_height", low},
          {"height", high}};
}

// Seen in November 2026: what stood on some of a flat roof hung 0.4 to 0.9 m above it, in the height of the parapet round
// it, and what stood beside a ridge by metres.
TEST(RaisedBodies, StandOnTheRoofsBelowThem) {
  ScratchFolder folder;
  constexpr int kGroups = 12;  // whose parapets differ
  std::vector<VectorSpec> specs;
  for (int k = 0; k < kGroups; ++k) {
    const auto number = static_cast<std::uint64_t>(10 * k);
    const double x = 60.0 * (k % 4) - 120.0, y = 60.0 * (k / 4) - 90.0;
    specs.push_back({wkt(x, y, 30, 20), part(number + 1, "0", "20")});
    specs.push_back({wkt(x + 8, y + 6, 12, 7), part(number + 2, "20", "26")});  // amid it
    specs.push_back({wkt(x, y + 12, 5, 8), part(number + 3, "20", "24")});      // at a corner
    Tags gabled = part(number + 4, "0", "20");
    gabled[3].second = "gabled";
    gabled.emplace_back("roof:height", "6");
    specs.push_back({wkt(x, y + 25, 30, 14), gabled});
    specs.push_back({wkt(x + 6, y + 26, 5, 4), part(number + 5, "18", "25")});  // by its eaves
  }
  write_vectors(folder / "a.gpkg", "GPKG", specs, "EPSG:32631");
  const Built built(files_key(folder / "a.gpkg") + "number_field = \"osm_way_id\"\n");
  ASSERT_EQ(built.count("buildings"), 5 * kGroups);
  EXPECT_EQ(built.count("raised bodies that nothing carries"), 0);
  for (const int level : {0, 3}) {
    const auto solids = by_number(built, level);
    ASSERT_EQ(solids.size(), 5U * kGroups);
    for (std::uint64_t group = 0; group < 10 * kGroups; group += 10)
      for (const auto& [upper, carrier] : {std::pair(2, 1), {3, 1}, {5, 4}}) {
        const world::Solid& body = solids.at(group + static_cast<std::uint64_t>(upper));
        const world::Solid& below = solids.at(group + static_cast<std::uint64_t>(carrier));
        const double bottom = lowest_z(body, level);
        for (const Vector2d& place : places_under(body, level))
          EXPECT_LT(bottom, roof_z(below, level, place))
              << level << " " << group + static_cast<std::uint64_t>(upper);
        // Not deeper than the lowest that its roof may lie: a parapet, a gable and its eaves, and what setbacks sink.
        EXPECT_GT(bottom - 300.0, (upper == 5 ? 20.0 - 6.0 - 0.3 : 20.0 - 0.9) - 0.19) << level;
      }
  }
}

TEST(RaisedBodies, ComeDownToWhatIsBelowThem) {
  ScratchFolder folder;
  write_vectors(
      folder / "a.gpkg", "GPKG",
      {// 5 m above a house of 10 m, and beside nothing.
       {wkt(0, 0, 30, 20), part(1, "0", "10")},
       {wkt(5, 5, 10, 8), part(2, "15", "25")},
       // As high above a house, but between two towers, which it joins; over a third of it there is no house.
       {wkt(100, 0, 30, 20), part(11, "0", "10")},
       {wkt(90, 0, 10, 20), part(12, "0", "40")},
       {wkt(140, 0, 10, 20), part(13, "0", "40")},
       {wkt(100, 5, 40, 8), part(14, "20", "25")},
       // Beside what does not reach up to it.
       {wkt(200, 0, 20, 20), part(21, "0", "10")},
       {wkt(220, 0, 10, 20), part(22, "15", "25")}},
      "EPSG:32631");
  const Built built(files_key(folder / "a.gpkg") + "number_field = \"osm_way_id\"\n");
  ASSERT_EQ(built.count("buildings"), 8);
  EXPECT_EQ(built.count("raised bodies brought down to what is below them"), 1);
  EXPECT_EQ(built.count("raised bodies that nothing carries"), 1);
  const auto solids = by_number(built, 0);
  const auto bottom_m = [&](std::uint64_t number) {
    return lowest_z(solids.at(number), 0) - 300.0;
  };
  EXPECT_LT(bottom_m(2), roof_z(solids.at(1), 0, places_under(solids.at(2), 0)[12]) - 300.0);
  EXPECT_GT(bottom_m(2), 10.0 - 0.9 - 0.19);
  EXPECT_NEAR(bottom_m(14), 20.0 - 0.099, 0.1);  // and less than all setbacks
  EXPECT_LT(bottom_m(22), -1.0);
}

// Seen in November 2026 in Monaco (way 687577849): rooms over a street, between two houses, with a corner amid the street
// on either side. They were taken for what nothing carries, and closed the street.
TEST(RaisedBodies, HangBetweenHousesOnBothSidesOfAStreet) {
  ScratchFolder folder;
  const Vector2d at = utm31(kOriginLat_deg, kOriginLon_deg);
  const auto house = [](const char* height) {
    return Tags{{"building", "yes"}, {"height", height}, {"roof:shape", "flat"}};
  };
  Tags rooms = house("9");
  rooms.emplace_back("min_height", "4");
  const auto rooms_at = [&](double x, double width) {
    return fmt::format("POLYGON(({0} {4},{1} {4},{2} {5},{1} {6},{0} {6},{3} {5},{0} {4}))",
                       at.x() + x, at.x() + x + width, at.x() + x + width + 0.3, at.x() + x - 0.3,
                       at.y(), at.y() + 4.0, at.y() + 7.0);
  };
  write_vectors(folder / "a.gpkg", "GPKG",
                {{wkt(-5, -10, 20, 10), house("12")},
                 {wkt(-5, 7, 20, 10), house("12")},
                 {rooms_at(0, 6), rooms},
                 // Houses on one side only.
                 {wkt(95, -10, 20, 10), house("12")},
                 {rooms_at(100, 6), rooms},
                 // Houses on both sides that do not reach up to it.
                 {wkt(195, -10, 20, 10), house("3")},
                 {wkt(195, 7, 20, 10), house("3")},
                 {rooms_at(200, 6), rooms}},
                "EPSG:32631");
  const Built built(files_key(folder / "a.gpkg"));
  ASSERT_EQ(built.count("buildings"), 8);
  EXPECT_EQ(built.count("raised bodies that nothing carries"), 2);
  int num_raised = 0;
  for (const auto& [id, solid] : built.all({})) {
    const double bottom_m = lowest_z(solid, 0) - 300.0;
    if (bottom_m < 0.0) continue;
    ++num_raised;
    EXPECT_NEAR(bottom_m, 4.0 - 0.099, 0.01);
    EXPECT_LT(solid.place_m.x(), 50);
  }
  EXPECT_EQ(num_raised, 1);
}

}  // namespace
}  // namespace terracast::test
