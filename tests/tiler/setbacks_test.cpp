#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <GeographicLib/LocalCartesian.hpp>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <map>
#include <numbers>
#include <string>
#include <tuple>
#include <vector>

#include "geo/units.h"
#include "tests/support/peak_memory.h"
#include "tests/tiler/building_facts.h"
#include "tests/tiler/building_layers.h"
#include "tests/tiler/vector_files.h"
#include "tiler/buildings/footprint.h"
#include "tiler/buildings/setback.h"
#include "tiler/buildings/town.h"
#include "validate/world_check/coincident_solids.h"

namespace terracast::test {
namespace {

using Eigen::Vector2d;
using world::kHeightStep_m;

// Seen in November 2026: of parts with height=20 and min_height=20 on one outline the top and the bottom lay in one plane,
// as the walls of each seventh such pair did.
TEST(Setbacks, WhatLiesOverEachOtherHasNoFacesInOnePlane) {
  ScratchFolder folder;
  // The first upon the ground, the second upon it, one along a side of both, from the ground; and one upon all.
  struct Part {
    double from_x_m, length_m, width_m;
    const char *low, *high;
  };
  constexpr std::array<Part, 4> kParts = {{{0, 30, 20, "0", "20"},
                                           {0, 30, 20, "20", "40"},
                                           {0, 12, 20, "0", "37"},
                                           {4, 12, 9, "40", "50"}}};
  constexpr std::uint64_t kNumbers = 10;  // of one group
  std::vector<VectorSpec> specs;
  std::map<std::pair<std::uint64_t, std::size_t>, std::uint64_t> number_of;  // of group and part
  std::array<std::size_t, 4> order = {0, 1, 2, 3};
  std::uint64_t group = 0;
  do {  // each of the 24 orders in which they are given ranks
    const double x = 60.0 * static_cast<double>(group % 6) - 180.0;
    const double y = 50.0 * static_cast<double>(group / 6) - 100.0;
    std::uint64_t number = kNumbers * group;
    const auto add = [&](const std::string& area,
                         std::vector<std::pair<std::string, std::string>> tags) {
      tags.emplace_back("osm_way_id", std::to_string(++number));
      specs.push_back({area, std::move(tags)});
    };
    const std::vector<std::pair<std::string, std::string>> low = {{"building", "yes"},
                                                                  {"height", "10"}};
    add(wkt(x, y, 30, 20), {{"building", "yes"}, {"height", "50"}});
    for (const std::size_t k : order) {
      const Part& part = kParts[k];
      add(wkt(x + part.from_x_m, y, part.length_m, part.width_m), {{"building:part", "yes"},
                                                                   {"min_height", part.low},
                                                                   {"height", part.high},
                                                                   {"building", ""}});
      number_of[{group, k}] = number;
    }
    // A neighbour and what lies across it, equally high.
    add(wkt(x + 30, y, 10, 20), low);
    add(wkt(x + 36, y + 5, 12, 15), low);
    ++group;
  } while (std::next_permutation(order.begin(), order.end()));
  ASSERT_EQ(group, 24U);
  write_vectors(folder / "a.gpkg", "GPKG", specs, "EPSG:32631");
  const Built built(files_key(folder / "a.gpkg") + "number_field = \"osm_way_id\"\n");
  ASSERT_EQ(built.count("buildings"), 6 * 24);
  EXPECT_EQ(built.count("footprints without a free setback"), 0);
  for (const int level : {0, 3}) {
    const auto solids = built.all({}, level);
    ASSERT_EQ(solids.size(), 6U * 24U);
    std::vector<world_check::ShownSolid> shown;
    std::map<std::uint64_t, std::pair<double, double>> span_m;  // of each number
    for (const auto& [id, solid] : solids) {
      const world::Shape& shape = *world::shape_at(solid.levels, level);
      shown.push_back({id, solid.origin_steps, &shape});
      constexpr std::uint64_t kId =
          (std::uint64_t{1} << 60) - 1;  // without the kind of OpenStreetMap
      span_m[solid.provenance.feature & kId] = {box_of(shape).first.z(), box_of(shape).second.z()};
    }
    ASSERT_EQ(span_m.size(), 6U * 24U);
    for (group = 0; group < 24; ++group)
      for (const auto& [part, carrier, low_m] : {std::tuple(1U, 0U, 20.0), {3U, 1U, 40.0}}) {
        const double bottom_m = span_m.at(number_of.at({group, part})).first;
        // By 99 mm and a few setbacks, of 15: less than anyone sees; below the floor behind a parapet, 0.4 to 0.9 m.
        EXPECT_LT(bottom_m, low_m - 0.4 - 0.098) << group;
        EXPECT_GT(bottom_m, low_m - 0.9 - 0.190) << group;
        // Roofs are flat there, without plant: the highest is the lowest top.
        if (level == 3) {
          EXPECT_LT(bottom_m, span_m.at(number_of.at({group, carrier})).second - 0.007) << group;
        }
      }
    for (const world_check::Coincident& pair : world_check::find_coincident(shown))
      ADD_FAILURE() << "level " << level << ": " << shown[pair.first].instance_id << " and "
                    << shown[pair.second].instance_id << ", " << pair.area_m2 << " m2 at "
                    << (pair.place_steps * kHeightStep_m).transpose();
  }
}

/// Bottoms of what stands on the ground, of all its shapes, and tops of blocks: multiples of kLevels_m
/// above the ellipsoid, by GeographicLib alone, and lower by a setback for each rank.
TEST(Setbacks, BottomsAndTopsOfBlocksLieOnLevels) {
  ScratchFolder folder;
  std::vector<VectorSpec> specs;
  std::uint64_t number = 0;
  // Three by three groups of three that cross each other: the first is given rank 0, the second 1,
  // the third 2.
  for (const double y : {-380.0, 0.0, 350.0})
    for (const double x : {-400.0, 0.0, 370.0})
      for (int k = 0; k < 3; ++k)
        specs.push_back(
            {wkt(x + 8.0 * k, y + 3.0 * k, 26.0, 16.0),
             {{"building", "yes"},
              {"height", fmt::format("{:.2f}", 6.0 + 0.83 * static_cast<double>(number))},
              {"roof:shape", number % 2 == 0 ? "flat" : "gabled"},
              {"osm_way_id", std::to_string(++number)}}});
  write_vectors(folder / "a.gpkg", "GPKG", specs, "EPSG:32631");
  const Built built(files_key(folder / "a.gpkg") + "number_field = \"osm_way_id\"\n",
                    world_of("plane", 1024.0));
  Land land;
  land.slope = 0.03;
  const geo::Geodetic& origin = built.surface->frame().origin();
  const GeographicLib::LocalCartesian local(origin.lat_deg, origin.lon_deg, origin.height_m);
  // Of the place and of the vertex half a step each, over half the length of the footprint's diagonal
  // the Earth's curvature.
  constexpr double kRounding_m = kHeightStep_m + 30.0 * 30.0 / (2 * 6.37e6);
  const auto off_level_m = [&](double height_m, std::uint64_t rank) {
    return std::remainder(height_m + tiler::kSetback_m * static_cast<double>(rank),
                          tiler::kLevels_m);
  };
  const auto solids = built.all(land);
  ASSERT_EQ(solids.size(), 27U);
  for (const auto& [id, solid] : solids) {
    constexpr std::uint64_t kId = (std::uint64_t{1} << 60) - 1;  // without the kind
    const std::uint64_t rank = ((solid.provenance.feature & kId) - 1) % 3;
    ASSERT_EQ(solid.levels.size(), 3U);
    for (const world::ShapeLevel& level : solid.levels) {
      SCOPED_TRACE(fmt::format("feature {} to level {}", solid.provenance.feature & kId,
                               level.coarsest_level));
      double low_m = 1e9;
      double high_m = -1e9;
      for (const Eigen::Vector3i& vertex : level.shape.vertices_steps) {
        const Eigen::Vector3d at = kHeightStep_m * (solid.origin_steps + vertex).cast<double>();
        double lat_deg = 0.0, lon_deg = 0.0, height_m = 0.0;
        local.Reverse(at.x(), at.y(), at.z(), lat_deg, lon_deg, height_m);
        low_m = std::min(low_m, height_m);
        high_m = std::max(high_m, height_m);
      }
      EXPECT_LE(std::abs(off_level_m(low_m, rank)), kRounding_m);
      const bool is_block = &level == &solid.levels.back();
      EXPECT_LE(is_block ? std::abs(off_level_m(high_m, rank)) : 0.0, kRounding_m);
    }
  }
}

/// Rectangles at one place of a world.
struct Stack {
  std::vector<tiler::Building> buildings;

  void add(double low_x_m, double low_y_m, double length_m, double width_m) {
    add({{low_x_m, low_y_m},
         {low_x_m + length_m, low_y_m},
         {low_x_m + length_m, low_y_m + width_m},
         {low_x_m, low_y_m + width_m}});
  }
  /// Anticlockwise.
  void add(const std::vector<Vector2d>& ring) {
    tiler::Building& building = buildings.emplace_back();
    building.footprint.rings = {{}};
    building.lowest_world = building.highest_world = ring.front();
    for (const Vector2d& corner : ring) {
      building.footprint.rings[0].emplace_back(steps(corner.x()), steps(corner.y()));
      building.lowest_world = building.lowest_world.cwiseMin(corner);
      building.highest_world = building.highest_world.cwiseMax(corner);
    }
  }
  std::int64_t num_pairs = 0;  ///< that were looked at
  /// Ranks, and how many are crowded and without a rank of their own.
  std::tuple<std::vector<int>, std::int64_t, std::int64_t> ranks() {
    const tiler::Setbacks setbacks = tiler::setback_ranks(buildings);
    num_pairs = setbacks.num_pairs;
    const std::map<std::string, std::int64_t> counts(setbacks.counts.begin(),
                                                     setbacks.counts.end());
    const auto count = [&](const char* name) {
      const auto found = counts.find(name);
      return found == counts.end() ? 0 : found->second;
    };
    return {setbacks.ranks, count("footprints over more others than are looked at"),
            count("footprints without a free setback")};
  }
};

TEST(Setbacks, EachStandsBackByTheLeastThatIsFree) {
  Stack stack;
  stack.add(0, 0, 10, 10);
  stack.add(8, 2, 10, 3);   // across the first
  stack.add(17, 1, 10, 3);  // across the second
  stack.add(40, 0, 10, 10);
  stack.add(50, 0, 10, 10);  // touches it alone
  for (int k = 0; k < 20; ++k) stack.add(80, 0, 10, 10);
  const auto [ranks, num_crowded, num_without] = stack.ranks();
  std::vector<int> expected = {0, 1, 0, 0, 0};
  for (int k = 0; k < 20; ++k) expected.push_back(k % 16);  // as few as can be on each
  EXPECT_EQ(ranks, expected);
  EXPECT_EQ(num_crowded, 0);
  EXPECT_EQ(num_without, 4);
}

// Seen in November 2026 in Monaco (ways 690021774 and 690021777): where walls meet at an angle that is not right, convex
// and reflex, the lines of neighbouring edges cross, and all ranks were taken for blocked: 220 of 1203 buildings stood back
// by the most, two of them on one outline with 221 m2 of walls in one plane.
TEST(Setbacks, SlantedCornersLeaveRanksFree) {
  const std::vector<Vector2d> arrow = {{0, 0}, {20, 6}, {40, 0}, {26, 20}, {14, 20}};
  Stack stack;
  for (int k = 0; k < 4; ++k) stack.add(arrow);
  stack.add({{14, 15}, {26, 15}, {26, 20}, {14, 20}});  // along one wall of all of them
  // A wall that leaves another at 30 in 100 is within some millimetres of it for some centimetres.
  stack.add(100, 0, 20, 10);
  stack.add({{102, 2}, {118, 2}, {118, 10}, {102, 10 + 0.3 * 16}});
  // One that goes from 60 mm inside another to 4 mm outside is so for metres: of rank 1 from 66 to 2 mm, of rank 2 not.
  stack.add(200, 0, 20, 10);
  stack.add({{202, 2}, {218, 2}, {218, 9.94}, {202, 9.94 + 0.004 * 16}});
  const auto [ranks, num_crowded, num_without] = stack.ranks();
  EXPECT_EQ(ranks, (std::vector<int>{0, 1, 2, 3, 4, 0, 1, 0, 2}));
  EXPECT_EQ(num_crowded, 0);
  EXPECT_EQ(num_without, 0);
}

// Neighbours that are drawn a little into each other face each other: each stands back by 10 mm and its rank, so that
// 31.25 mm are used up where both ranks together are 2 (32 mm), within roundings.
TEST(Setbacks, NeighboursDrawnIntoEachOtherStayApart) {
  Stack stack;
  stack.add(0, 0, 10, 10);
  stack.add(0, 0, 10, 10);
  stack.add(10 - 0.03125, 2, 10, 5);  // not 0 and 1, of tops in one plane; nor 2 against the first
  stack.add(20 - 0.03125, 2, 10, 5);  // only touches
  const auto [ranks, num_crowded, num_without] = stack.ranks();
  EXPECT_EQ(ranks, (std::vector<int>{0, 1, 3, 0}));
  EXPECT_EQ(num_without, 0);
}

// Seen in November 2026 in Bilbao: coarse tiles show what has more than six corners as a rectangle, which reaches into its
// neighbours, with bottoms and roofs in one plane.
TEST(Setbacks, WhatLiesOverEachOtherAsBlocksAloneStandsApart) {
  // Two L of one size, each in the other's elbow, 2 m apart, of seven corners.
  Stack stack;
  stack.add({{0, 0}, {30, 0}, {30, 10}, {10, 10}, {10, 30}, {5, 30.5}, {0, 30}});
  stack.add({{40, 40}, {12, 40}, {12, 32}, {32, 32}, {32, 12}, {36, 11.5}, {40, 12}});
  stack.add(80, 0, 10, 10);
  const auto [ranks, num_crowded, num_without] = stack.ranks();
  EXPECT_EQ(ranks, (std::vector<int>{0, 1, 0}));
  EXPECT_EQ(num_without, 0);
}

// Seen in November 2026 in Monaco: walls of two rectangles that stand for houses lay in one plane, on a coarse tile; and
// where they cross at a tenth of a degree two triangles of them did.
TEST(Setbacks, WallsOfBlocksAreNotInOnePlane) {
  // Pairs of L of one size as above, the second one farther from pair to pair, and turned: somewhere
  // the rectangles of the pair's areas, 22.4 m wide and 30 m apart in y, have walls in one plane.
  const std::vector<Vector2d> one = {{0, 0},   {30, 0},   {30, 10}, {10, 10},
                                     {10, 30}, {5, 30.5}, {0, 30}};
  constexpr int kNumPairs = 60;
  for (const double turned_deg : {0.0, 0.03, 0.1, 0.3}) {
    SCOPED_TRACE(turned_deg);
    ScratchFolder folder;
    std::vector<VectorSpec> specs;
    const auto add = [&](const Vector2d& at, double turned_rad) {
      const Vector2d origin = utm31(kOriginLat_deg, kOriginLon_deg) + at;
      std::string text = "POLYGON((";
      for (std::size_t k = 0; k <= one.size(); ++k) {
        const Vector2d corner = origin + Eigen::Rotation2Dd(turned_rad) * one[k % one.size()];
        text += fmt::format("{}{:.4f} {:.4f}", k == 0 ? "" : ",", corner.x(), corner.y());
      }
      specs.push_back({text + "))",
                       {{"building", "yes"},
                        {"height", "10"},
                        {"roof:shape", "flat"},
                        {"osm_way_id", std::to_string(specs.size() + 1)}}});
    };
    for (int k = 0; k < kNumPairs; ++k) {
      const Vector2d at(80.0 * (k % 10) - 400.0, 80.0 * (k / 10) - 240.0);
      add(at, 0.0);
      add(at + Vector2d(52.2 + 0.005 * k, 30.0), geo::radians_from_degrees(180.0 + turned_deg));
    }
    write_vectors(folder / "a.gpkg", "GPKG", specs, "EPSG:32631");
    const Built built(files_key(folder / "a.gpkg") + "number_field = \"osm_way_id\"\n",
                      world_of("plane", 1024.0));
    ASSERT_EQ(built.count("buildings"), 2 * kNumPairs);
    EXPECT_EQ(built.count("footprints without a free setback"), 0);
    std::vector<world_check::ShownSolid> shown;
    const auto solids = built.all({});
    for (const auto& [id, solid] : solids)
      shown.push_back({id, solid.origin_steps, &solid.levels.back().shape});
    for (const world_check::Coincident& pair : world_check::find_coincident(shown))
      ADD_FAILURE() << shown[pair.first].instance_id << " and " << shown[pair.second].instance_id
                    << ", " << pair.area_m2 << " m2";
  }
}

// Seen in November 2026 in Bilbao: walls of blocks that cross at a few degrees were taken to lie in one plane at all
// ranks, and so both of two such neighbours stood back by the most, with their bottoms in one plane.
TEST(Setbacks, BlocksWhoseWallsCrossFindARankOfTheirOwn) {
  // Bars with an elbow, of seven corners, fanned out about one place by 3 degrees: each one's rectangle crosses the others'.
  constexpr int kNum = 6;
  Stack stack;
  for (int k = 0; k < kNum; ++k) {
    const Eigen::Rotation2Dd turn(k * 3.0 * std::numbers::pi / 180.0);
    std::vector<Vector2d> ring = {{0, 0}, {40, 0}, {40, 9}, {12, 9}, {12, 12}, {6, 12.3}, {0, 12}};
    for (Vector2d& corner : ring) corner = turn * (corner - Vector2d(20, 5));
    stack.add(ring);
  }
  const auto [ranks, num_crowded, num_without] = stack.ranks();
  EXPECT_EQ(ranks, (std::vector<int>{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(num_crowded, 0);
  EXPECT_EQ(num_without, 0);
}

// A few megabytes of parts on one place are 200 million pairs.
TEST(Setbacks, ManyOnOnePlaceCostLittle) {
  constexpr int kNum = 20000;
  Stack stack;
  for (int k = 0; k < kNum; ++k) stack.add(-5, -5, 12, 10);  // in four cells of the index
  const PeakMemory peak;
  const auto begin = std::chrono::steady_clock::now();
  const auto [ranks, num_crowded, num_without] = stack.ranks();
  EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(), 40.0);
  EXPECT_LT(peak.more_mb(), 100.0);
  for (int k = 0; k < kNum; ++k)
    // The first 64 are looked at.
    ASSERT_EQ(ranks[static_cast<std::size_t>(k)], k < 64 ? k % 16 : 0) << k;
  EXPECT_EQ(num_crowded, kNum - 65);  // the first with more than 64 before it is the 66th
  EXPECT_LE(stack.num_pairs, kNum * 65);
  EXPECT_EQ(num_without, kNum - 16);
}

}  // namespace
}  // namespace terracast::test
