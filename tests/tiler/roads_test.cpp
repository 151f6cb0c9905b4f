// Roads over land and water: how steep they are, what they cut and fill, where they go below ground, and bridges.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>

#include "core/random.h"
#include "tests/tiler/road_worlds.h"
#include "tiler/roads/road_bed.h"
#include "tiler/roads/road_heights.h"
#include "tiler/roads/road_network.h"
#include "tiler/tile_builder.h"
#include "validate/world_check/shape_check.h"
#include "world/tile_file.h"

namespace terracast::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using world::kHeightStep_m;

TEST(Roads, AreNoSteeperThanTheirClassAllowsAndLevelAcross) {
  // Straight ways, so that the middle line is the one drawn.
  const std::vector<Drawn> drawn = {
      {.number = 1,
       .points_world = straight({-1500, -900}, {1500, -700}),
       .tags = {{"highway", "motorway"}, {"lanes", "3"}}},
      {.number = 2,
       .points_world = straight({-1500, 300}, {1500, 420}),
       .tags = {{"highway", "residential"}}},
      {.number = 3,
       .points_world = straight({-1400, 1500}, {1300, 900}),
       .tags = {{"railway", "rail"}}},
  };
  const RoadWorld world(hills(), drawn);
  const double limits[] = {0.06, 0.18, 0.03};
  const double halves_m[] = {7.0, 3.0, 2.2};
  for (std::size_t k = 0; k < drawn.size(); ++k) {
    const Vector2d from = drawn[k].points_world[0];
    const Vector2d step = (drawn[k].points_world[1] - from).normalized();
    const Vector2d left(-step.y(), step.x());
    const double length_m = (drawn[k].points_world[1] - from).norm();
    double steepest_ground = 0.0;
    for (double along_m = 20.0; along_m + 25.0 < length_m; along_m += 5.0) {
      const Vector2d at = from + along_m * step;
      const double here_m = world.height_m(at);
      const double grade = std::abs(world.height_m(at + 5.0 * step) - here_m) / 5.0;
      // 1e-4: the level that profiles are made of leans by 5e-5, heights are those of 2^-10 m.
      EXPECT_LE(grade, limits[k] + 1e-4) << k << " at " << along_m;
      const auto ground_m = [&](const Vector2d& place) {
        return world.bare->sample(place.x(), place.y()).z_world;
      };
      steepest_ground =
          std::max(steepest_ground, std::abs(ground_m(at + 5.0 * step) - ground_m(at)) / 5.0);
      for (const double side : {-1.0, 1.0})
        EXPECT_NEAR(world.height_m(at + side * halves_m[k] * left), here_m, 1e-3 * halves_m[k]);
    }
    if (k != 1) {
      EXPECT_GT(steepest_ground, limits[k]);  // there was something to cut
    }
  }
}

TEST(Roads, CarriagewaysOnTilesAreTheProfileWithinTheLatticesRounding) {
  const Vector2d from(-400, -310);
  const Vector2d to(420, 290);
  const RoadWorld world(
      hills(), {{.number = 1, .points_world = {from, to}, .tags = {{"highway", "primary"}}}});
  const Vector2d step = (to - from).normalized();
  const double length_m = (to - from).norm();
  int num_on_road = 0;
  for (const auto& [x, y] : {std::pair(0, 0), std::pair(-1, -1)}) {
    const world::Tile tile = build_tile(*world.finished, {0, x, y});
    for (int j = 0; j < world::kTileSamples; ++j)
      for (int i = 0; i < world::kTileSamples; ++i) {
        const Vector2d at = tile.id.corner_world() + Vector2d(i, j);
        const double along_m = (at - from).dot(step);
        const double beside_m = std::abs(step.x() * (at - from).y() - step.y() * (at - from).x());
        if (along_m < 10.0 || along_m > length_m - 10.0 || beside_m > 4.0 + 1.0) continue;
        ++num_on_road;
        const double middle_m = world.height_m(from + along_m * step);
        const double here_m = world.finished->frame()
                                  .geodetic_from_world({at.x(), at.y(), tile.z_world(i, j)})
                                  .height_m;
        // Half a step of the lattice, and the lean of what is level: 5e-5 over 5 m.
        EXPECT_NEAR(here_m, middle_m, 0.5 * kHeightStep_m + 2.5e-4);
      }
  }
  EXPECT_GT(num_on_road, 3000);
}

TEST(Roads, AWayUpARampCutsTheVolumeOfTheClosedForm) {
  // The ramp rises by 0.12, a primary road by 0.09 at most: planned with 0.98 of it, through the middle.
  tiler::WorldOptions options = world_of("ramp", 4096.0);
  options.elevation[0].slope = 0.12;
  const RoadWorld world(options, {{.number = 1,
                                   .points_world = straight({-300, 0}, {300, 0}),
                                   .tags = {{"highway", "primary"}, {"lanes", "2"}}}});
  double cut_m3 = 0.0;
  double fill_m3 = 0.0;
  constexpr double kFrom_m = 40.0;
  constexpr double kTo_m = 260.0;
  for (double x = kFrom_m; x < kTo_m; x += 2.0)
    for (double y = -40.25; y < 40.5; y += 0.5) {
      const auto lift_m = [&](const Vector2d& at) {
        return world.finished->sample(at.x(), at.y()).z_world -
               world.bare->sample(at.x(), at.y()).z_world;
      };
      cut_m3 -= lift_m({x + 1.0, y}) * 2.0 * 0.5;
      fill_m3 += lift_m({-x - 1.0, y}) * 2.0 * 0.5;
    }
  // Depth k x; as wide as the road and its shoulders, (7 + 1) m + 2 x 1.8 m, and banks of 1 : 1.5.
  const double k = 0.12 - 0.98 * 0.09;
  const double width_m = 8.0 + 2.0 * 1.8;
  const auto integral = [&](double x) {
    return k * width_m * x * x / 2.0 + k * k * 1.5 * x * x * x / 3.0;
  };
  const double truth_m3 = integral(kTo_m) - integral(kFrom_m);
  // The grid of 0.5 m at banks' feet, and the ends' smoothed ground.
  EXPECT_NEAR(cut_m3, truth_m3, 0.02 * truth_m3);
  EXPECT_NEAR(fill_m3, truth_m3, 0.02 * truth_m3);
}

TEST(Roads, WaysGoBelowMountainsThatTheyWouldCutTooDeep) {
  // A railway can follow little of such relief, and what is said to be a bridge from end to end nothing.
  const Vector2d from(-1700, -900);
  const Vector2d to(1700, -700);
  const Vector2d step = (to - from).normalized();
  for (const char* bridge : {"no", "yes"}) {
    const RoadWorld world(hills(1500.0), {{.number = 1,
                                           .points_world = straight(from, to),
                                           .tags = {{"railway", "rail"}, {"bridge", bridge}}}});
    EXPECT_GT(world.count("parts of ways in cuttings so deep that they run below ground"), 0);
    int num_below = 0;
    int num_on_ground = 0;
    for (double along_m = 20.0; along_m < (to - from).norm() - 20.0; along_m += 2.0) {
      const Vector2d at = from + along_m * step;
      const double cut_m = world.bare->sample(at.x(), at.y()).z_world -
                           world.finished->sample(at.x(), at.y()).z_world;
      // No deeper than is allowed: from a station to the next, 8 m on, the ground rises by 2 in 1 at most.
      EXPECT_LT(cut_m, 20.0 + 16.0) << bridge << " at " << along_m;
      ++(std::abs(cut_m) > 1e-3 ? num_on_ground : num_below);
    }
    EXPECT_GT(num_below, 100) << bridge;  // mountains stand as they were
    if (bridge == std::string("no")) {
      EXPECT_GT(num_on_ground, 100);  // and between them the railway lies
    }
  }
}

TEST(Roads, NothingElseStandsOnHighWallsBesideThem) {
  // A way along a hillside: what lies up the slope is cut, in steep land by a wall.
  for (const double slope : {0.15, 0.8}) {
    const tiler::RoadGroundFunction ground = [&](const Vector2d& at) {
      return tiler::RoadGround{.level_m = slope * at.y()};
    };
    tiler::WayStyle style;
    style.half_width_m = 4.0;
    style.shoulder_m = 2.0;
    const tiler::RoadNetwork network(
        {{.feature = 1, .style = style, .points_world = {{-300, 0}, {300, 0}}}}, 2048.0);
    const tiler::RoadHeights heights(network, ground);
    const tiler::RoadBed bed(network, heights, ground, {{}}, {});
    // Up the slope the wall 1.3 * 0.8 + 0.25 = 1.29 meets the ground (6 + x) 0.8 above at x = 9.8 m, 12.6 m
    // high; it is looked for in steps of 4 m.
    const bool is_steep = slope == 0.8;
    EXPECT_TRUE(bed.holds({0, 5}, 0.0));
    for (const double y : {8.0, 15.5, -8.0, -15.5})
      EXPECT_EQ(bed.holds({0, y}, 0.0), is_steep) << y;
    for (const double y : {30.0, -30.0}) EXPECT_FALSE(bed.holds({0, y}, 0.0)) << y;
  }
}

TEST(RoadNetwork, AllLinksBelowGroundAreTunnelsWhereCornersLieOnStations) {
  // Ways of many bends: some of their points come to lie within a centimetre of a station, which then has none of
  // its own.
  int num_without_point = 0;
  for (int k = 0; k < 400; ++k) {
    std::vector<Vector2d> points;
    const auto draw = [&](int i) {
      return core::random_unit(3, static_cast<std::uint64_t>(k), static_cast<std::uint64_t>(i));
    };
    for (int i = 0; i <= 24; ++i)
      points.emplace_back(13.0 * i + 7.0 * draw(2 * i), 3.0 * draw(2 * i + 1));
    tiler::RoadNetwork network({{.feature = 1, .style = {}, .points_world = points}}, 2048.0);
    const tiler::Line& line = network.lines().at(0);
    const auto last = static_cast<std::uint32_t>(line.points.size() - 1);
    std::set<std::uint32_t> stations;
    for (const tiler::Line::Point& point : line.points)
      if (point.is_at_station()) stations.insert(point.station_here());
    num_without_point += stations.size() < network.stations().size() ? 1 : 0;
    network.run_below_ground({{.first_point = 0, .last_point = last}});
    for (const tiler::Link& link : network.links())
      EXPECT_TRUE(network.ways()[link.way].style.is_tunnel) << k;
  }
  EXPECT_GT(num_without_point, 0);
}

TEST(RoadNetwork, WhatGoesBelowGroundIsSpansOfItsOwn) {
  const tiler::RoadNetwork plain(
      {{.feature = 1, .style = {}, .points_world = {{-400, 0}, {400, 100}}}}, 4096.0);
  tiler::RoadNetwork network = plain;
  const tiler::Line& line = network.lines().at(0);
  const auto middle = static_cast<std::uint32_t>(line.points.size() / 2);
  network.run_below_ground({{.first_point = 3, .last_point = middle},
                            {.first_point = middle + 4, .last_point = middle + 9}});
  ASSERT_EQ(line.spans.size(), 5u);
  const bool is_tunnel[] = {false, true, false, true, false};
  for (std::size_t k = 0; k < 5; ++k) {
    const tiler::Span& span = line.spans[k];
    EXPECT_EQ(network.style(span).is_tunnel, is_tunnel[k]);
    EXPECT_EQ(network.ways()[span.way].feature, 1u);
    if (k == 0) continue;
    EXPECT_EQ(span.first_point, line.spans[k - 1].last_point);
    EXPECT_EQ(span.from_junction, line.spans[k - 1].to_junction);
    EXPECT_EQ(network.junctions()[span.from_junction].at_world,
              line.points[span.first_point].at_world);
  }
  EXPECT_EQ(line.spans.back().last_point, line.points.size() - 1);
  const auto num_of_tunnels = [&](const tiler::RoadNetwork& of) {
    return std::count_if(of.links().begin(), of.links().end(), [&](const tiler::Link& link) {
      return of.ways()[link.way].style.is_tunnel;
    });
  };
  EXPECT_EQ(num_of_tunnels(plain), 0);
  EXPECT_EQ(num_of_tunnels(network), middle - 3 + 5);  // a straight line has a point a station
}

TEST(Roads, WhereWaysMeetOrRunBesideEachOtherThereIsNoStep) {
  const RoadWorld world(
      hills(),
      {{.number = 1,
        .points_world = {{-600, 0}, {0, 0}, {600, 30}},
        .tags = {{"highway", "primary"}}},
       {.number = 2, .points_world = {{0, 0}, {20, 300}}, .tags = {{"highway", "residential"}}},
       {.number = 3, .points_world = {{0, 0}, {-60, -300}}, .tags = {{"highway", "service"}}},
       {.number = 4, .points_world = {{-600, 14}, {600, 52}}, .tags = {{"highway", "tertiary"}}},
       {.number = 5,
        .points_world = {{300, 200}, {420, 210}, {430, 222}, {300, 226}},
        .tags = {{"highway", "unclassified"}}}});
  double steepest = 0.0;
  Vector2d where = Vector2d::Zero();
  constexpr double kStep_m = 0.25;
  const auto look = [&](const Vector2d& low, const Vector2d& high) {
    for (double y = low.y(); y < high.y(); y += kStep_m)
      for (double x = low.x(); x < high.x(); x += kStep_m) {
        const double here = world.finished->sample(x, y).z_world;
        const double east = world.finished->sample(x + kStep_m, y).z_world;
        const double slope = std::abs(east - here) / kStep_m;
        if (slope > steepest) {
          steepest = slope;
          where = {x, y};
        }
      }
  };
  look({-30, -30}, {30, 30});
  look({390, 195}, {445, 235});
  look({-120, -8}, {-80, 25});
  // Banks of 2/3, on this ground up to three times as steep; a step of 0.2 m would be a slope of 0.8 more.
  EXPECT_LT(steepest, 3.0) << where.transpose();
}

TEST(Roads, BridgesAreClosedTurnedOutwardAndLeaveRoomForWhatTheyCross) {
  // On a plane: the upper way must rise by itself, on ramps on either side.
  const RoadWorld world(
      world_of("plane"),
      {{.number = 1, .points_world = {{-900, 3}, {900, 3}}, .tags = {{"highway", "primary"}}},
       {.number = 2, .points_world = {{3, -700}, {3, -40}}, .tags = {{"highway", "secondary"}}},
       {.number = 3,
        .points_world = {{3, -40}, {9, 0}, {3, 40}},
        .tags = {{"highway", "secondary"}, {"bridge", "yes"}, {"layer", "1"}}},
       {.number = 4, .points_world = {{3, 40}, {3, 700}}, .tags = {{"highway", "secondary"}}}});
  EXPECT_EQ(world.count("bridges"), 1);
  EXPECT_EQ(world.count("crossings of bridges"), 1);
  EXPECT_EQ(world.count("crossings of bridges with less room than stated"), 0);
  const world::Tile tile = build_tile(*world.finished, {1, 0, 0});
  ASSERT_EQ(tile.objects.solids.size(), 1u);
  const world::Solid& bridge = tile.objects.solids[0];
  EXPECT_EQ(bridge.provenance.feature, 3u);
  for (const world::ShapeLevel& level : bridge.levels) EXPECT_GE(count_bodies(level.shape), 3);

  // Over the lower carriageway, 8 m wide, no triangle is lower than 5 m above it, by points all over it.
  const world::Shape& shape = bridge.levels.front().shape;
  double least_m = 1e9;
  for (const auto& triangle : shape.triangles) {
    const auto at = [&](std::size_t k) {
      return Vector3d(
          (bridge.origin_steps + shape.vertices_steps[triangle.corners[k]]).cast<double>() *
          kHeightStep_m);
    };
    for (int i = 0; i <= 20; ++i)
      for (int j = 0; i + j <= 20; ++j) {
        const Vector3d p = at(0) + (at(1) - at(0)) * i / 20.0 + (at(2) - at(0)) * j / 20.0;
        if (std::abs(p.y() - 3.0) > 4.0) continue;
        least_m = std::min(least_m, p.z() - world.finished->sample(p.x(), p.y()).z_world);
      }
  }
  EXPECT_GE(least_m, 5.0);
  EXPECT_LE(least_m, 6.5);  // and not much more than it needs
  // The deck is as high as the roads that it joins, but for the centimetre that it lies above them.
  for (const double y : {-40.0, 40.0}) {
    double top_m = -1e9;
    for (const auto& triangle : shape.triangles) {
      if (shape.finishes[triangle.finish].material != world::Material::Asphalt) continue;
      for (const std::uint32_t corner : triangle.corners) {
        const Vector3d p =
            (bridge.origin_steps + shape.vertices_steps[corner]).cast<double>() * kHeightStep_m;
        if (std::abs(p.y() - y) < 1.0) top_m = std::max(top_m, p.z());
      }
    }
    const double road_m = world.finished->sample(3.0, y + (y > 0 ? 0.5 : -0.5)).z_world;
    EXPECT_NEAR(top_m, road_m, 0.01 + 0.1 * 0.8 + 0.002);
  }
}

TEST(Roads, DecksInBendsSharperThanTheyAreWideDoNotFold) {
  // A ramp that winds about a point 2 m beside its middle, and a zigzag.
  std::vector<Vector2d> hairpin = {{-60, 0}, {-4, 0}}, zigzag;
  for (int i = 1; i < 12; ++i)
    hairpin.emplace_back(-4.0 + 2.0 * std::sin(i * EIGEN_PI / 12.0),
                         2.0 - 2.0 * std::cos(i * EIGEN_PI / 12.0));
  hairpin.emplace_back(-4, 4);
  hairpin.emplace_back(-60, 30);
  for (int i = 0; i < 20; ++i) zigzag.emplace_back(100.0 + 3.0 * i, i % 2 == 0 ? 100.0 : 102.5);
  const RoadWorld world(world_of("plane"),
                        {{.number = 1,
                          .points_world = hairpin,
                          .tags = {{"highway", "secondary"}, {"bridge", "yes"}, {"layer", "1"}}},
                         {.number = 2,
                          .points_world = zigzag,
                          .tags = {{"highway", "primary"}, {"bridge", "yes"}, {"layer", "1"}}}});
  EXPECT_EQ(world.count("bridges"), 2);
  std::set<std::uint32_t> seen;
  for (const world::TileId& id : {world::TileId{1, 0, 0}, world::TileId{1, -1, 0}})
    for (const world::Solid& bridge : build_tile(*world.finished, id).objects.solids) {
      seen.insert(bridge.provenance.instance_id);
      for (const world::ShapeLevel& level : bridge.levels) {
        const world_check::ShapeFaults faults = world_check::find_shape_faults(level.shape);
        EXPECT_EQ(faults.num_meeting_themselves, 0)
            << bridge.provenance.feature << ", to level " << int{level.coarsest_level};
        EXPECT_EQ(faults.num_open + faults.num_turned + faults.num_inside_out, 0);
        EXPECT_GT(faults.num_bodies, 0);
      }
    }
  EXPECT_EQ(seen.size(), 2u);
}

TEST(Roads, TheOrderOfFeaturesAndOfTilesDoesNotMatter) {
  std::vector<Drawn> drawn;
  for (std::uint64_t k = 0; k < 40; ++k) {
    const auto draw = [&](std::uint64_t index) {
      return 128.0 * std::round(core::random_between(-8.0, 8.0, 5, k, index));
    };
    drawn.push_back({.number = k + 1,
                     .points_world = {{draw(0), draw(1)}, {draw(2), draw(3)}, {draw(4), draw(5)}},
                     .tags = {{"highway", k % 3 == 0 ? "primary" : "residential"},
                              {"bridge", k % 7 == 0 ? "yes" : "no"}}});
  }
  const RoadWorld world(hills(200.0), drawn);
  std::reverse(drawn.begin(), drawn.end());
  const RoadWorld reversed(hills(200.0), drawn);
  EXPECT_EQ(world.count("bridges"), reversed.count("bridges"));
  EXPECT_GT(world.count("bridges"), 2);
  for (const auto& [x, y] : {std::pair(0, 0), std::pair(-1, 1), std::pair(1, -2)})
    EXPECT_EQ(encode_tile(build_tile(*world.finished, {1, x, y})),
              encode_tile(build_tile(*reversed.finished, {1, x, y})));
  EXPECT_EQ(encode_tile(build_tile(*world.finished, {1, 0, 0})),
            encode_tile(build_tile(*world.finished, {1, 0, 0})));
}

}  // namespace
}  // namespace terracast::test
