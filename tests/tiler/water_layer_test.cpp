#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "core/random.h"
#include "core/toml_reader.h"
#include "tests/tiler/vector_files.h"
#include "tiler/layer_stack.h"
#include "tiler/tile_builder.h"
#include "tiler/water/water_map.h"
#include "tiler/water/water_profile.h"
#include "world/tile_file.h"

namespace terracast::test {
namespace {

using Eigen::Vector2d;
using tiler::SurfaceSample;
using tiler::Waterline;
using tiler::WorldSurface;
using world::Cover;

constexpr double kSize_m = 4096.0;

/// A feature in metres about the world's origin.
struct Drawn {
  std::string type;  ///< LineString, Polygon
  std::vector<std::vector<Vector2d>> parts;
  std::string tags;  ///< as JSON
  int id = 0;
};

void write_drawn(const std::filesystem::path& file, const std::vector<Drawn>& all,
                 double height_m = 0.0) {
  const geo::WorldFrame frame(
      {.lat_deg = kOriginLat_deg, .lon_deg = kOriginLon_deg, .height_m = 0.0});
  std::string features;
  for (const Drawn& drawn : all) {
    std::string parts;
    for (const auto& part : drawn.parts) {
      std::string points;
      for (const Vector2d& point : part) {
        const geo::Geodetic at = frame.geodetic_from_world({point.x(), point.y(), height_m});
        points +=
            fmt::format("{}[{:.12f},{:.12f}]", points.empty() ? "" : ",", at.lon_deg, at.lat_deg);
      }
      parts += fmt::format("{}[{}]", parts.empty() ? "" : ",", points);
    }
    if (drawn.type == "LineString") parts = parts.substr(1, parts.size() - 2);
    features += fmt::format(
        R"({}{{"type":"Feature","id":{},"properties":{{{}}},"geometry":{{"type":"{}","coordinates":[{}]}}}})",
        features.empty() ? "" : ",\n", drawn.id, drawn.tags, drawn.type, parts);
  }
  write_text(file, R"({"type":"FeatureCollection","features":[)" + features + "]}");
}

std::vector<Vector2d> ring(const Vector2d& middle, double radius_m, int count = 64) {
  std::vector<Vector2d> points;
  for (int i = 0; i <= count; ++i) {
    const double angle = 2.0 * M_PI * (i % count) / count;
    points.push_back(middle + radius_m * Vector2d(std::cos(angle), std::sin(angle)));
  }
  return points;
}

tiler::WorldOptions world_with_water(const std::filesystem::path& file,
                                     const std::string& ground = "plane", double slope = 0.0) {
  tiler::WorldOptions options = world_of(ground, kSize_m);
  options.elevation[0].slope = slope;
  options.elevation[0].height_m = 100.0;
  tiler::LayerOptions layer;
  core::TomlDocument::parse("kind = \"water\"\nfiles = [\"" + file.string() + "\"]\n", "layer.toml")
      .read(layer);
  options.layers.push_back(layer);
  return options;
}

std::int64_t count_of(const WorldSurface& surface, const std::string& name) {
  for (const auto& [key, count] : surface.layers().infos().at(0).counts)
    if (key == name) return count;
  ADD_FAILURE() << "no count of " << name;
  return -1;
}

double height_m(const WorldSurface& surface, const Vector2d& place) {
  const SurfaceSample sample = surface.sample(place.x(), place.y());
  return surface.frame().geodetic_from_world({place.x(), place.y(), sample.z_world}).height_m;
}

TEST(WaterProfile, FallingFitIsTheLeastSquaresOne) {
  // The min-max formula of isotonic regression (Robertson, Wright and Dykstra 1988, 1.4).
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    std::vector<double> values;
    for (std::uint64_t i = 0; i < 30; ++i)
      values.push_back(core::random_between(-5.0, 5.0, seed, 1, i) - 0.1 * static_cast<double>(i));
    const std::vector<double> fit = tiler::falling_fit(values);
    for (std::size_t i = 0; i < values.size(); ++i) {
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t a = 0; a <= i; ++a) {
        double most = -std::numeric_limits<double>::infinity();
        for (std::size_t b = i; b < values.size(); ++b) {
          double sum = 0.0;
          for (std::size_t k = a; k <= b; ++k) sum += values[k];
          most = std::max(most, sum / static_cast<double>(b - a + 1));
        }
        least = std::min(least, most);
      }
      EXPECT_NEAR(fit[i], least, 1e-12);  // rounding of sums of 30 numbers below 10
    }
  }
}

/// A river with two tributaries over noisy ground that falls to the east, the second one drawn upstream.
std::vector<Waterline> network() {
  const auto line = [](std::uint64_t number, int rank, double half_width_m,
                       std::vector<Vector2d> points) {
    Waterline result;
    result.number = number;
    result.rank = rank;
    result.half_width_m = half_width_m;
    result.points_world = std::move(points);
    return result;
  };
  return {line(1, 3, 8.0, {{-1500, 0}, {-600, 80}, {0, 0}, {700, -50}, {1500, 0}}),
          line(2, 1, 1.0, {{-900, 900}, {-500, 500}, {0, 0}}),
          line(3, 1, 1.0, {{700, -50}, {400, -500}, {-200, -900}})};
}
tiler::CourseGround noisy_ground(const Vector2d& place) {
  const auto at = [](double value) { return static_cast<std::uint64_t>(std::llround(value * 8)); };
  return {.height_m = 500.0 - 0.02 * place.x() + 0.02 * std::abs(place.y()) +
                      core::random_between(-4.0, 4.0, 7, at(place.x() + 1e6), at(place.y() + 1e6))};
}

TEST(WaterProfile, LevelsNeverRiseDownstreamAndMeetWhereLinesMeet) {
  const std::vector<Waterline> lines = network();
  const tiler::WaterCourses found = tiler::fit_courses(lines, noisy_ground);
  EXPECT_EQ(found.num_reversed, 1);
  EXPECT_EQ(found.courses.size(), 5u);  // the river is split at two mouths
  double misfit_m = 0.0;
  double num_points = 0.0;
  std::map<std::pair<double, double>, double> at_nodes;
  for (const tiler::WaterCourse& course : found.courses) {
    for (std::size_t i = 1; i < course.levels_m.size(); ++i) {
      EXPECT_LE(course.levels_m[i], course.levels_m[i - 1]);
      EXPECT_LE((course.points_world[i] - course.points_world[i - 1]).norm(),
                tiler::kCourseStep_m + 1e-9);
    }
    for (std::size_t i = 0; i < course.levels_m.size(); ++i) {
      const Vector2d& place = course.points_world[i];
      if (course.line != 0) continue;
      misfit_m += course.levels_m[i] - (500.0 - 0.02 * place.x() + 0.02 * std::abs(place.y()));
      ++num_points;
    }
    for (const std::size_t end : {std::size_t{0}, course.levels_m.size() - 1}) {
      const Vector2d& place = course.points_world[end];
      const auto [known, is_new] =
          at_nodes.emplace(std::pair(place.x(), place.y()), course.levels_m[end]);
      if (!is_new) {
        EXPECT_EQ(known->second, course.levels_m[end]) << place.transpose();
      }
    }
  }
  EXPECT_EQ(at_nodes.size(), 6u);
  // The lowest of three draws of 8 m about the ground lies 2 m below it in the mean, the freeboard 0.7 m more.
  EXPECT_NEAR(misfit_m / num_points, -2.7, 0.8);
}

TEST(WaterProfile, DoesNotDependOnTheOrderOfLines) {
  const std::vector<Waterline> lines = network();
  const std::vector<Waterline> turned(lines.rbegin(), lines.rend());
  const auto first = tiler::fit_courses(lines, noisy_ground);
  const auto second = tiler::fit_courses(turned, noisy_ground);
  ASSERT_EQ(first.courses.size(), second.courses.size());
  for (std::size_t k = 0; k < first.courses.size(); ++k) {
    EXPECT_EQ(lines[first.courses[k].line].number, turned[second.courses[k].line].number);
    EXPECT_EQ(first.courses[k].levels_m, second.courses[k].levels_m);
  }
}

TEST(WaterProfile, TakesTheLevelsOfLakesOnItsWay) {
  const auto ground = [](const Vector2d& place) {
    tiler::CourseGround found = noisy_ground(place);
    if (place.x() > -200.0 && place.x() < 200.0 && std::abs(place.y()) < 100.0)
      found.level_m = 497.0;
    return found;
  };
  const std::vector<Waterline> lines = {network()[0]};
  for (const tiler::WaterCourse& course : tiler::fit_courses(lines, ground).courses)
    for (std::size_t i = 0; i < course.levels_m.size(); ++i) {
      if (course.is_in_lake[i] != 0) {
        EXPECT_EQ(course.levels_m[i], 497.0);
      }
      if (course.points_world[i].x() < -200.0) {
        EXPECT_GE(course.levels_m[i], 497.0);
      }
      if (course.points_world[i].x() > 200.0) {
        EXPECT_LE(course.levels_m[i], 497.0);
      }
    }
}

TEST(WaterMap, FindsInsidesAndDistancesAsAllEdgesDo) {
  tiler::WaterArea area;
  area.rings_world = {ring({100, 50}, 300.0, 37), ring({150, 60}, 80.0, 11)};
  area.rings_world[0].pop_back();
  area.rings_world[1].pop_back();
  const tiler::WaterMap map({area}, {}, 1024.0);
  std::vector<tiler::WaterMap::Near> near;
  int num_near = 0;
  for (std::uint64_t i = 0; i < 4000; ++i) {
    const Vector2d place(core::random_between(-400, 600, 1, 1, i),
                         core::random_between(-400, 500, 1, 2, i));
    // Winding by angles, distances to all edges.
    double turns = 0.0;
    double distance_m = std::numeric_limits<double>::infinity();
    for (std::size_t r = 0; r < 2; ++r) {
      const auto& points = area.rings_world[r];
      double own = 0.0;
      for (std::size_t k = 0; k < points.size(); ++k) {
        const Vector2d a = points[k] - place;
        const Vector2d b = points[(k + 1) % points.size()] - place;
        own += std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
        for (int part = 0; part <= 400; ++part)
          distance_m = std::min(distance_m, (a + (b - a) * part / 400.0).norm());
      }
      turns += r == 0 ? own : -own;
    }
    const bool is_in = turns > M_PI;
    map.find(place, near);
    if (!is_in && distance_m > tiler::WaterMap::kReach_m + 0.2) {
      EXPECT_TRUE(near.empty());
      continue;
    }
    if (near.empty()) {
      EXPECT_GT(distance_m, tiler::WaterMap::kReach_m - 0.2);
      continue;
    }
    ++num_near;
    EXPECT_EQ(near[0].distance_m <= 0.0, is_in) << place.transpose();
    // Edges of 50 m in 400 parts: places between them are half a part off at most.
    EXPECT_NEAR(std::abs(near[0].distance_m), std::min(distance_m, tiler::WaterMap::kReach_m), 0.1);
    EXPECT_EQ(map.touches(place, distance_m + 0.2), true);
    if (!is_in && distance_m > 1.0) {
      EXPECT_FALSE(map.touches(place, distance_m - 0.2));
    }
  }
  EXPECT_GT(num_near, 1000);
}

TEST(Water, LakesAreLevelHaveABedAndLeaveTheirIslands) {
  const ScratchFolder folder;
  write_drawn(folder / "water.geojson", {{.type = "Polygon",
                                          .parts = {ring({0, 0}, 300.0), ring({60, 40}, 70.0)},
                                          .tags = R"("natural":"water")",
                                          .id = 5}});
  const auto surface = prepare(world_with_water(folder / "water.geojson", "ramp", 0.02));
  EXPECT_EQ(count_of(*surface, "areas"), 1);
  double lowest_m = 1e9;
  double highest_m = -1e9;
  double deepest_m = 0.0;
  for (std::uint64_t i = 0; i < 3000; ++i) {
    const Vector2d place(core::random_between(-400, 400, 1, 1, i),
                         core::random_between(-400, 400, 1, 2, i));
    const SurfaceSample sample = surface->sample(place.x(), place.y());
    // The rings are polygons of 64 sides, 0.1 % within their circles.
    const bool is_water = place.norm() < 299.0 && (place - Vector2d(60, 40)).norm() > 70.5;
    const bool is_land = place.norm() > 300.5 || (place - Vector2d(60, 40)).norm() < 69.5;
    if (is_water) {
      EXPECT_EQ(sample.cover, Cover::Lake);
      EXPECT_GT(sample.water_depth_m, 0.0);
      lowest_m = std::min(lowest_m, height_m(*surface, place));
      highest_m = std::max(highest_m, height_m(*surface, place));
      deepest_m = std::max(deepest_m, sample.water_depth_m);
    } else if (is_land) {
      EXPECT_NE(sample.cover, Cover::Lake);
      EXPECT_EQ(sample.water_depth_m, 0.0);
    }
  }
  EXPECT_LT(highest_m - lowest_m, 1e-3);  // lifts count along z, which leans by 1e-4 at 400 m
  EXPECT_GT(deepest_m, 3.0);
  // Between the lowest shore, 6 m below the middle, and the middle.
  EXPECT_GT(lowest_m, 94.0);
  EXPECT_LT(lowest_m, 100.0);
  // Away from the lake nothing is touched; at its shore the ground comes down to it without a step.
  const auto bare = prepare([] {
    tiler::WorldOptions options = world_of("ramp", kSize_m);
    options.elevation[0].slope = 0.02;
    options.elevation[0].height_m = 100.0;
    return options;
  }());
  EXPECT_EQ(height_m(*surface, {0, 600}), height_m(*bare, {0, 600}));
  for (double from_m = 299.0; from_m < 380.0; from_m += 0.5)
    EXPECT_LT(std::abs(height_m(*surface, {0.0, from_m + 0.5}) - height_m(*surface, {0.0, from_m})),
              0.5);
}

TEST(Water, RiversHaveBanksABedAndASurfaceThatFalls) {
  const ScratchFolder folder;
  std::vector<Vector2d> line;
  for (int k = 0; k <= 60; ++k)
    line.emplace_back(1500.0 - 50.0 * k, 120.0 * std::sin(0.2 * k));  // down the ramp, to the west
  write_drawn(folder / "water.geojson", {{.type = "LineString",
                                          .parts = {line},
                                          .tags = R"("waterway":"river","width":"20 m")",
                                          .id = 9}});
  const auto surface = prepare(world_with_water(folder / "water.geojson", "ramp", 0.01));
  EXPECT_EQ(count_of(*surface, "lines"), 1);
  EXPECT_EQ(count_of(*surface, "lines that run the other way"), 0);
  double previous_m = 1e9;
  for (std::size_t k = 1; k + 1 < line.size(); ++k) {
    const SurfaceSample middle = surface->sample(line[k].x(), line[k].y());
    EXPECT_EQ(middle.cover, Cover::River);
    EXPECT_NEAR(middle.water_depth_m, 0.25 * std::pow(20.0, 0.75), 0.2);
    const double here_m = height_m(*surface, line[k]);
    EXPECT_LE(here_m, previous_m + 1e-6);
    previous_m = here_m;
    const Vector2d left =
        Vector2d(line[k + 1].y() - line[k - 1].y(), line[k - 1].x() - line[k + 1].x()).normalized();
    for (const double side : {-1.0, 1.0}) {
      const Vector2d shore = line[k] + side * 9.0 * left;
      EXPECT_EQ(surface->sample(shore.x(), shore.y()).cover, Cover::River);
      EXPECT_NEAR(height_m(*surface, shore), here_m, 0.1);  // level across, but for the bend
      const Vector2d land = line[k] + side * 40.0 * left;
      EXPECT_NE(surface->sample(land.x(), land.y()).cover, Cover::River);
      EXPECT_GT(height_m(*surface, land), here_m);
    }
  }
}

TEST(Water, RunsBelowGroundWhereItsLevelIsFarFromIt) {
  // Up a slope of a tenth by 80 m and down again: a level that never rises lies 40 m below the ground at the top.
  const ScratchFolder scratch;
  write_drawn(scratch / "water.geojson",
              {{"LineString", {{{-800, -500}, {0, 0}, {-800, 500}}}, R"("waterway":"river")", 1}});
  tiler::WorldOptions bare = world_with_water(scratch / "water.geojson", "ramp", 0.1);
  bare.layers.clear();
  const auto without = prepare(bare);
  const auto surface = prepare(world_with_water(scratch / "water.geojson", "ramp", 0.1));
  const auto cover_at = [&](const Vector2d& place) {
    return surface->sample(place.x(), place.y()).cover;
  };
  int num_water = 0;
  for (double share = 0.0; share <= 1.0; share += 1.0 / 64.0) {
    const Vector2d place(-800.0 + 800.0 * share, -500.0 + 500.0 * share);
    const double cut_m = height_m(*without, place) - height_m(*surface, place);
    EXPECT_LT(std::abs(cut_m), 16.5) << share;  // half of 64 m at a slope of a half, and the bed's
    if (cover_at(place) == Cover::River) ++num_water;
  }
  EXPECT_GT(num_water, 5);
  EXPECT_LT(num_water, 50);
  EXPECT_EQ(cover_at({0.0, 0.0}), Cover::Land);
  EXPECT_NEAR(height_m(*surface, {0.0, 0.0}), height_m(*without, {0.0, 0.0}), 1e-6);
  EXPECT_GT(count_of(*surface, "stretches of rivers too far from the ground"), 0);
}

TEST(Water, TilesAreTheSameForAnyOrderOfFeatures) {
  const ScratchFolder folder;
  std::vector<Drawn> all = {
      {.type = "Polygon", .parts = {ring({40, 30}, 60.0)}, .tags = R"("natural":"water")", .id = 3},
      {.type = "LineString",
       .parts = {{{-200, 20}, {-20, 30}, {20, 30}}},
       .tags = R"("waterway":"river")",
       .id = 4},
      {.type = "LineString",
       .parts = {{{0, 240}, {-30, 200}, {-100, 25}}},
       .tags = R"("waterway":"stream")",
       .id = 1}};
  write_drawn(folder / "a.geojson", all);
  std::reverse(all.begin(), all.end());
  write_drawn(folder / "b.geojson", all);
  const auto a = prepare(world_with_water(folder / "a.geojson", "fractal"), 1);
  const auto b = prepare(world_with_water(folder / "b.geojson", "fractal"), 4);
  for (const world::TileId id : {world::TileId{0, 0, 0}, {0, -1, 0}, {2, -1, 0}}) {
    const world::Tile tile = build_tile(*a, id);
    EXPECT_EQ(tile, build_tile(*b, id)) << id.name();
    EXPECT_FALSE(tile.water_depth_steps.empty());
    for (std::size_t i = 0; i < tile.cover.size(); ++i)
      EXPECT_EQ(tile.water_depth_steps[i] > 0,
                tile.cover[i] == Cover::Lake || tile.cover[i] == Cover::River);
    const auto bytes = world::encode_tile(tile);
    EXPECT_EQ(world::decode_tile(bytes, id, "a.tile", world::WaterDepth::Read), tile);
  }
  // The stream is too narrow for the terrain: it is painted.
  const world::Tile tile = build_tile(*a, {0, -1, 0});
  ASSERT_FALSE(tile.objects.strips.empty());
  EXPECT_EQ(tile.objects.strips[0].coating.paving, world::Paving::Water);
}

TEST(Water, BadShapesAreLeftOutAndCounted) {
  const ScratchFolder folder;
  write_drawn(folder / "water.geojson",
              {{.type = "Polygon",
                .parts = {{{0, 0}, {100, 100}, {100, 0}, {0, 100}, {0, 0}}},  // crosses itself
                .tags = R"("natural":"water")",
                .id = 1},
               {.type = "Polygon",
                .parts = {{{300, 0}, {301, 0}, {302, 0}, {300, 0}}},
                .tags = R"("natural":"water")",
                .id = 2},
               {.type = "LineString",
                .parts = {{{-500, 0}, {-500, 0}, {-300, 0}}},
                .tags = R"("waterway":"river","width":"-7")",
                .id = 3},
               {.type = "LineString",
                .parts = {{{-500, 300}, {-300, 300}}},
                .tags = R"("waterway":"river","width":"wide","tunnel":"culvert")",
                .id = 4}});
  const auto surface = prepare(world_with_water(folder / "water.geojson"));
  EXPECT_EQ(count_of(*surface, "areas that are none"), 1);
  // Of the one that crosses itself the halves turn opposite ways: two lakes.
  EXPECT_EQ(count_of(*surface, "areas repaired"), 1);
  EXPECT_EQ(count_of(*surface, "areas"), 2);
  for (const Vector2d& at : {Vector2d(80, 50), Vector2d(20, 50)})
    EXPECT_EQ(surface->sample(at.x(), at.y()).cover, Cover::Lake) << at.transpose();
  for (const Vector2d& at : {Vector2d(50, 80), Vector2d(50, 20)})
    EXPECT_EQ(surface->sample(at.x(), at.y()).cover, Cover::Land) << at.transpose();
  EXPECT_EQ(count_of(*surface, "widths that are none"), 2);
  EXPECT_EQ(count_of(*surface, "lines"), 2);
  EXPECT_EQ(count_of(*surface, "lines below ground"), 1);
  EXPECT_EQ(surface->sample(-400, 300).cover, Cover::Land);
  EXPECT_EQ(surface->sample(-400, 0).cover, Cover::River);
}

}  // namespace
}  // namespace terracast::test
