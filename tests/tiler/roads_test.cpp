#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <set>

#include "core/random.h"
#include "core/toml_reader.h"
#include "tests/tiler/raster_files.h"
#include "tests/tiler/vector_files.h"
#include "tiler/instance_ids.h"
#include "tiler/layer_stack.h"
#include "tiler/roads/road_bed.h"
#include "tiler/roads/road_heights.h"
#include "tiler/roads/road_network.h"
#include "tiler/roads/road_paint.h"
#include "tiler/tile_builder.h"
#include "validate/world_check/shape_check.h"
#include "world/tile_file.h"

namespace terracast::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using tiler::WorldSurface;
using world::Cover;
using world::kHeightStep_m;
using world::Marking;

/// A way or an area, in world x and y.
struct Drawn {
  std::uint64_t number;
  std::string kind = "LineString";  ///< or Polygon, Point
  std::vector<Vector2d> points_world;
  std::vector<std::pair<std::string, std::string>> tags;
};

/// GeoJSON of places that lie where they are drawn once they are put on the ground.
std::string geojson(const WorldSurface& ground, const std::vector<Drawn>& drawn) {
  std::string text = "{\"type\":\"FeatureCollection\",\"features\":[";
  for (const Drawn& feature : drawn) {
    text += feature.number == drawn.front().number ? "" : ",";
    std::string places;
    for (const Vector2d& at : feature.points_world) {
      const geo::Geodetic place = ground.frame().geodetic_from_world(
          {at.x(), at.y(), ground.sample(at.x(), at.y()).z_world});
      places += fmt::format("{}[{:.11f},{:.11f}]", places.empty() ? "" : ",", place.lon_deg,
                            place.lat_deg);
    }
    if (feature.kind == "LineString") places = "[" + places + "]";
    if (feature.kind == "Polygon") places = "[[" + places + "]]";
    text += fmt::format("{{\"type\":\"Feature\",\"properties\":{{\"number\":{}", feature.number);
    for (const auto& [key, value] : feature.tags) text += fmt::format(",\"{}\":\"{}\"", key, value);
    text += fmt::format("}},\"geometry\":{{\"type\":\"{}\",\"coordinates\":{}}}}}", feature.kind,
                        places);
  }
  return text + "]}";
}

struct RoadWorld {
  RoadWorld(const tiler::WorldOptions& bare_options, const std::vector<Drawn>& drawn,
            const std::string& toml = "") {
    bare = prepare(bare_options);
    write_text(folder / "roads.geojson", geojson(*bare, drawn));
    tiler::WorldOptions options = bare_options;
    tiler::LayerOptions layer;
    core::TomlDocument::parse("kind = \"roads\"\nnumber_field = \"number\"\nfiles = [\"" +
                                  (folder / "roads.geojson").string() + "\"]\n" + toml,
                              "layer.toml")
        .read(layer);
    options.layers.push_back(layer);
    finished = prepare(options);
  }

  double height_m(const Vector2d& at) const {
    const double z = finished->sample(at.x(), at.y()).z_world;
    return finished->frame().geodetic_from_world({at.x(), at.y(), z}).height_m;
  }
  std::int64_t count(const std::string& name) const {
    for (const auto& [key, count] : finished->layers().infos().at(0).counts)
      if (key == name) return count;
    ADD_FAILURE() << "no count " << name;
    return -1;
  }

  ScratchFolder folder;
  std::shared_ptr<const WorldSurface> bare;
  std::shared_ptr<const WorldSurface> finished;
};

tiler::WorldOptions hills(double relief_m = 500.0) {
  tiler::WorldOptions options = world_of("fractal", 4096.0);
  options.elevation[0].relief_m = relief_m;
  return options;
}

std::vector<Vector2d> straight(const Vector2d& from, const Vector2d& to) { return {from, to}; }

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

/// Whether each side of a triangle is one other's, the other way; and how many bodies there are.
int count_bodies(const world::Shape& shape) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  std::vector<std::uint32_t> body(shape.vertices_steps.size());
  for (std::uint32_t v = 0; v < body.size(); ++v) body[v] = v;
  const auto root = [&](std::uint32_t v) {
    while (body[v] != v) v = body[v] = body[body[v]];
    return v;
  };
  for (const auto& triangle : shape.triangles)
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = triangle.corners[static_cast<std::size_t>(k)];
      const std::uint32_t b = triangle.corners[static_cast<std::size_t>((k + 1) % 3)];
      ++sides[{a, b}];
      body[root(a)] = root(b);
    }
  for (const auto& [side, count] : sides) {
    EXPECT_EQ(count, 1);
    EXPECT_EQ(sides.count({side.second, side.first}), 1u);
  }
  std::map<std::uint32_t, double> volumes;
  for (const auto& triangle : shape.triangles) {
    const auto at = [&](int k) {
      return Vector3d(
          shape.vertices_steps[triangle.corners[static_cast<std::size_t>(k)]].cast<double>());
    };
    EXPECT_GT((at(1) - at(0)).cross(at(2) - at(0)).norm(), 0.0);
    volumes[root(triangle.corners[0])] += at(0).dot(at(1).cross(at(2))) / 6.0;
  }
  for (const auto& [first, volume] : volumes) EXPECT_GT(volume, 0.0);
  return static_cast<int>(volumes.size());
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
      {.number = 7, .points_world = {{-640, -30}, {-700, -30}}, .tags = {{"railway", "rail"}}}};
  const RoadWorld world(hills(60.0), drawn);
  const world::WayNetwork ways = world.finished->layers().ways();
  EXPECT_EQ(ways.parts.size(), 7u);  // the first way is two parts; rails are none
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

TEST(RoadNetwork, PlacesThatAreNoneAndWaysOfAMillionPointsAreBounded) {
  const double nan = std::nan("");
  tiler::Way way;
  way.style = *[] {
    std::int64_t num_repaired = 0;
    const std::vector<std::pair<std::string, std::string>> tags = {{"highway", "residential"}};
    return tiler::way_style(tiler::FeatureTags(tags), num_repaired);
  }();
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
  const core::Log log("tile", core::LogLevel::Off);
  tiler::InstanceIds ids;
  layers.push_back(options.kind_options().make({.frame = world.bare->frame(),
                                                .size_m = 4096.0,
                                                .seed = 1,
                                                .surface = *world.bare,
                                                .earlier = layers,
                                                .ids = ids,
                                                .country = {},
                                                .licence = {},
                                                .accuracy = {},
                                                .context = {.log = log, .num_threads = 0}}));
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
