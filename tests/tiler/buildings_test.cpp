#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <tuple>

#include "core/parallel.h"
#include "core/random.h"
#include "core/toml_reader.h"
#include "tests/tiler/building_facts.h"
#include "tests/tiler/building_layers.h"
#include "tests/tiler/raster_files.h"
#include "tests/tiler/vector_files.h"
#include "tiler/buildings/footprint.h"
#include "tiler/buildings/town.h"
#include "tiler/layer_stack.h"
#include "tiler/tile_builder.h"
#include "world/facade.h"
#include "world/tile_id.h"

namespace terracast::test {
namespace {

using core::ErrorKind;
using Eigen::Vector2d;
using Eigen::Vector2i;
using Eigen::Vector3d;
using world::kHeightStep_m;
using world::Solid;
using world::TileId;

/// Above the ground of the slope, of the shape for a level.
double height_of(const Solid& solid, int level = 0) {
  const world::Shape& shape = *world::shape_at(solid.levels, level);
  int top = -1 << 30;
  for (const auto& vertex : shape.vertices_steps) top = std::max(top, vertex.z());
  return top * kHeightStep_m;
}

TEST(Buildings, HeightsComeFromTagsAndAreCounted) {
  ScratchFolder folder;
  write_vectors(folder / "a.gpkg", "GPKG",
                {{wkt(0, 0, 12, 9), {{"building", "house"}, {"height", "9.5"}}},
                 {wkt(40, 0, 12, 9),
                  {{"building", "apartments"}, {"building:levels", "5"}, {"roof:shape", "flat"}}},
                 {wkt(80, 0, 12, 9), {{"building", "yes"}, {"height", "1e9"}}},
                 {wkt(120, 0, 12, 9), {{"building", "yes"}, {"height", "nan"}}},
                 {wkt(160, 0, 12, 9), {{"building", "no"}}}},
                "EPSG:32631");
  const Built built(files_key(folder / "a.gpkg"));
  EXPECT_EQ(built.count("buildings"), 4);
  EXPECT_EQ(built.count("heights from height"), 2);
  EXPECT_EQ(built.count("heights from levels"), 1);
  EXPECT_EQ(built.count("heights guessed"), 1);
  EXPECT_EQ(built.count("absurd heights clamped"), 1);
  int num_seen = 0;
  for (const auto& [id, solid] : built.all({})) {
    for (const auto& level : solid.levels)
      sound_facts(level.shape, "building " + std::to_string(id));
    const double height = height_of(solid, 2);
    if (solid.place_m.x() < 20) {
      EXPECT_NEAR(height, 9.5, 2 * kHeightStep_m);
      ++num_seen;
    } else if (solid.place_m.x() < 60) {
      // Storeys of flats are 2.9 to 3.1 m high; the parapet ends 0.4 m above the last.
      EXPECT_GT(height, 5 * 2.9 + 0.39);
      EXPECT_LT(height, 5 * 3.1 + 0.41);
      ++num_seen;
    }
  }
  EXPECT_EQ(num_seen, 2);
}

TEST(Buildings, PiersAreLeftToALayerOfRoadsAndTold) {
  ScratchFolder folder;
  const auto area = [](double x, const char* man_made) {
    return VectorSpec{wkt(x, 0, 12, 9), {{"building", "yes"}, {"man_made", man_made}}};
  };
  write_vectors(folder / "a.gpkg", "GPKG",
                {area(0, "pier"),
                 area(40, "breakwater"),
                 area(80, "quay"),
                 area(120, "storage_tank"),
                 {wkt(160, 0, 12, 9), {{"man_made", "pier"}}}},
                "EPSG:32631");
  const auto build = [&](const std::string& keys, tiler::WorldOptions options) {
    testing::internal::CaptureStderr();
    const Built built(files_key(folder / "a.gpkg") + keys, std::move(options),
                      core::LogLevel::Warn);
    return std::tuple(built.count("buildings"),
                      built.count("piers, breakwaters and quays left to a layer of roads"),
                      testing::internal::GetCapturedStderr());
  };
  const auto [num_alone, num_left, told] = build("", world_of("plane"));
  EXPECT_EQ(num_alone, 1);
  EXPECT_EQ(num_left, 3);
  EXPECT_NE(told.find("3 areas tagged building are piers"), std::string::npos) << told;
  tiler::WorldOptions with_roads = world_of("plane");
  core::TomlDocument::parse("kind = \"roads\"\n" + files_key(folder / "a.gpkg"), "layer.toml")
      .read(with_roads.layers.emplace_back());
  const auto [num_built, num_left_to_roads, quiet] = build("", with_roads);
  EXPECT_EQ(num_built, 1);
  EXPECT_EQ(num_left_to_roads, 3);
  EXPECT_EQ(quiet, "");
  const auto [num_all, num_none, of_all] = build("every_area = true\n", world_of("plane"));
  EXPECT_EQ(num_all, 5);
  EXPECT_EQ(num_none, 0);
  EXPECT_EQ(of_all, "");
}

TEST(Buildings, TerminalsStandOnAirfieldsInAnyOrderOfLayers) {
  const ScratchFolder folder;
  const Vector2d at = utm31(kOriginLat_deg, kOriginLon_deg);
  write_vectors(
      folder / "a.gpkg", "GPKG",
      {{wkt(-400, -300, 800, 600), {{"aeroway", "aerodrome"}}},
       {fmt::format("LINESTRING ({0} {1}, {2} {1})", at.x() - 300.0, at.y(), at.x() + 300.0),
        {{"aeroway", "runway"}, {"width", "45"}}},
       {wkt(40, 60, 60, 30), {{"building", "yes"}, {"aeroway", "terminal"}}},
       {wkt(120, 90, 40, 30), {{"building", "hangar"}}}},
      "EPSG:32631");
  const std::string files = files_key(folder / "a.gpkg");
  const auto check = [&](const std::vector<std::string>& kinds) {
    tiler::WorldOptions options = world_of("plane");
    options.elevation[0].height_m = 300.0;
    std::size_t buildings = 0;
    for (std::size_t k = 0; k < kinds.size(); ++k) {
      if (kinds[k] == "buildings") buildings = k;
      core::TomlDocument::parse(
          fmt::format("name = \"layer{}\"\nkind = \"{}\"\n{}", k, kinds[k], files), "layer.toml")
          .read(options.layers.emplace_back());
    }
    const auto surface = prepare(options);
    std::map<std::string, std::int64_t> counts;
    for (const auto& [name, count] : surface->layers().infos()[buildings].counts)
      counts[name] = count;
    EXPECT_EQ(counts.at("buildings"), 2);
    EXPECT_EQ(counts["footprints on roads"], 0);
    EXPECT_EQ(tiler::build_tile(*surface, {0, 0, 0}).objects.solids.size(), 2U);
  };
  check({"objects", "buildings"});
  check({"buildings", "objects"});
}

TEST(Buildings, WallsReachIntoTheGroundAndStandAlongUp) {
  ScratchFolder folder;
  write_vectors(
      folder / "a.gpkg", "GPKG",
      {{wkt(12000, -9000, 30, 12), {{"building", "yes"}, {"height", "9"}, {"roof:shape", "flat"}}}},
      "EPSG:32631");
  const Built built(files_key(folder / "a.gpkg"), world_of("plane", 32768.0));
  Land land;
  land.slope = 0.2;
  const auto solids = built.all(land, 5);
  ASSERT_EQ(solids.size(), 1u);
  const Solid& block = solids.begin()->second;
  const auto fine_on = built.on(world::tile_at(0, block.place_m.x(), block.place_m.y()), land);
  ASSERT_EQ(fine_on.size(), 1u);
  const Solid& solid = fine_on[0];
  const world::Shape& shape = solid.levels.front().shape;
  const Vector3d origin = solid.origin_steps.cast<double>() * kHeightStep_m;
  const Vector3d up = built.surface->frame().up_world(origin);
  EXPECT_GT(std::abs(up.x()), 1e-3);
  double lowest = 1e9;
  double highest = -1e9;
  for (const auto& triangle : shape.triangles) {
    std::array<Vector3d, 3> at;
    for (std::size_t k = 0; k < 3; ++k)
      at[k] = origin + shape.vertices_steps[triangle.corners[k]].cast<double>() * kHeightStep_m;
    const Vector3d normal = (at[1] - at[0]).cross(at[2] - at[0]).normalized();
    // Level or upright; a rounded corner turns a wall of 8 m by 0.1 mrad, a parapet of 0.3 m by 3.
    const double leaning = normal.dot(up);
    EXPECT_LT(std::min(std::abs(leaning), 1.0 - std::abs(leaning)), 4e-3);
    for (const Vector3d& corner : at) {
      const double above = corner.z() - land.ground_z_world(corner.head<2>());
      lowest = std::min(lowest, above);
      highest = std::max(highest, above);
      if (leaning < -0.9) {
        EXPECT_LT(above, -1.0) << "the bottom comes out of the ground";
      }
    }
  }
  // 9 m above the lowest of the ground, which is 6 m below the highest.
  EXPECT_NEAR(highest, 9.0, 0.1);
}

/// A ring of places in the world, in degrees.
std::string polygon(const std::vector<Vector2d>& ring) {
  const geo::WorldFrame frame(
      {.lat_deg = kOriginLat_deg, .lon_deg = kOriginLon_deg, .height_m = 0.0});
  std::string text;
  for (std::size_t i = 0; i <= ring.size(); ++i) {
    const Vector2d& place = ring[i % ring.size()];
    const geo::Geodetic at = frame.geodetic_from_world({place.x(), place.y(), 0.0});
    text += fmt::format("{}{:.11f} {:.11f}", i == 0 ? "" : ",", at.lon_deg, at.lat_deg);
  }
  return "POLYGON((" + text + "))";
}

/// Cuttings 7 m wide and 30 m deep towards the north, 512 m apart.
struct Cutting final : tiler::LayerSite {
  double ground_z_world(const Vector2d& place) const override {
    return std::abs(std::remainder(place.x(), 512.0)) < 3.5 ? 270.0 : 300.0;
  }
  world::Cover cover(const Vector2d&) const override { return world::Cover::Land; }
  bool is_free(const Vector2d&, double) const override { return true; }
};

TEST(Buildings, ReachDownToTheGroundThatCoarseTilesShowBesideCuttings) {
  // Seen in Andorra in November 2026: on tiles of 16 m the ground falls from a house to a cutting 10 m away.
  ScratchFolder folder;
  std::vector<VectorSpec> specs;
  for (int k = 0; k < 16; ++k) {
    const Vector2d low(512.0 * (k % 4) - 1024.0 + 4.0 + k, 100.0 * k - 800.0);
    const Vector2d high = low + Vector2d(14.0 + 3.0 * k, 12.0);
    specs.push_back({polygon({low, {high.x(), low.y()}, high, {low.x(), high.y()}}),
                     {{"building", "apartments"}}});
  }
  write_vectors(folder / "a.gpkg", "GPKG", specs);
  const Built built(files_key(folder / "a.gpkg"));
  world::TileObjects objects;
  for (const int x : {-1, 0})
    for (const int y : {-1, 0}) built.layer->add_objects({4, x, y}, Cutting(), objects);
  int num_deep = 0;
  for (const Solid& solid : objects.solids)
    for (const int level : {3, 4, 5}) {
      const world::Shape* shape = world::shape_at(solid.levels, level);
      if (shape == nullptr) continue;
      int low = 0;
      for (const auto& vertex : shape->vertices_steps) low = std::min(low, vertex.z());
      for (const auto& vertex : shape->vertices_steps) {
        if (vertex.z() > low + 512) continue;
        const Eigen::Vector3d foot = (solid.origin_steps + vertex).cast<double>() * kHeightStep_m;
        // Samples in the cutting's middle alone are low: ground falls evenly from those beside them.
        const double spacing_m = std::exp2(level);
        const double from_m = std::abs(std::remainder(foot.x(), 512.0));
        const double shown_z = 300.0 - 30.0 * std::max(1.0 - from_m / spacing_m, 0.0);
        EXPECT_LT(foot.z(), shown_z) << "level " << level << " at " << foot.transpose();
        num_deep += shown_z < 290.0 ? 1 : 0;
      }
    }
  EXPECT_GT(num_deep, 20);
}

TEST(Buildings, AreInAllTilesIntoWhichTheirBlocksReach) {
  // Seen in Archipelago in November 2026. A block is a rectangle of its building's area, about the middle of the one
  // round it: it reaches into the corner that stairs leave free.
  ScratchFolder folder;
  std::vector<VectorSpec> specs;
  const std::vector<Vector2d> stairs = {{0, 0},     {3, 0},   {3, 1}, {1.5, 1},
                                        {1.5, 1.5}, {1, 1.5}, {1, 3}, {0, 3}};
  for (int k = 0; k < 24; ++k) {
    // Steps look west: they end 10 / sqrt(2) = 7.1 m from the middle, the block of 525 m2 sqrt(525 / 2) m = 16.2 m.
    const Vector2d middle(6.0 + 0.45 * k, 70.0 * k - 800.0);
    std::vector<Vector2d> ring;
    for (const Vector2d& at : stairs) {
      const Vector2d from_middle = 10.0 * (at - Vector2d(1.5, 1.5));
      ring.emplace_back(middle + std::sqrt(0.5) * Vector2d(-from_middle.x() - from_middle.y(),
                                                           from_middle.x() - from_middle.y()));
    }
    specs.push_back({polygon(ring), {{"building", "apartments"}}});
  }
  write_vectors(folder / "a.gpkg", "GPKG", specs);
  const Built built(files_key(folder / "a.gpkg"));
  for (const int level : {2, 4, 5}) {
    std::map<int, std::set<std::uint32_t>> held;  // by the tile's column
    std::map<std::uint32_t, double> low_x;
    for (const int x : {-1, 0})
      for (int y = -4; y < 4; ++y) {
        const TileId id{level, x, y};
        for (const Solid& solid : built.on(id, Land())) {
          held[x].insert(solid.provenance.instance_id);
          const world::Shape* shape = world::shape_at(solid.levels, level);
          if (shape == nullptr) continue;
          for (const auto& vertex : shape->vertices_steps) {
            const double at = (solid.origin_steps + vertex).x() * kHeightStep_m;
            double& low = low_x.try_emplace(solid.provenance.instance_id, at).first->second;
            low = std::min(low, at);
          }
        }
      }
    int num_over = 0;
    for (const auto& [id, low] : low_x)
      if (low < 0.0) {
        ++num_over;
        EXPECT_TRUE(held[-1].contains(id)) << "level " << level << ", " << low << " m";
      }
    EXPECT_GE(num_over, level == 2 ? 2 : 21) << level;  // 0.45 m from each to the next
    EXPECT_LT(num_over, 24) << level;
  }
}

TEST(Buildings, WhatStandsInTheSeaIsNoBlockOfFlats) {
  // Seen in Monaco in November 2026: the dike of its harbour, building=yes and no more, was eight storeys high.
  const auto design_beside = [](double shore_x, const std::string& building) {
    tiler::VectorFeature dike;
    dike.number = 1;
    dike.kind = tiler::FeatureKind::Area;
    dike.tags = tiler::FeatureTags({{"building", building}});
    tiler::PointsWorld ring = {{0, 0}, {350, 0}};  // of too many corners for a hall by its shape
    for (int k = 0; k < 8; ++k) {
      ring.emplace_back(350.0 - 40.0 * k, k % 2 == 0 ? 28.0 : 24.0);
      ring.emplace_back(320.0 - 40.0 * k, k % 2 == 0 ? 28.0 : 24.0);
    }
    ring.emplace_back(0, 24);
    dike.parts_world = {{ring}};
    const auto is_land = [&](const Vector2d& at) {
      return at.x() < shore_x || (at.x() > -5 && at.x() < 355 && at.y() > -5 && at.y() < 33);
    };
    const tiler::Town town =
        tiler::build_town({dike}, nullptr,
                          {.is_water = [](const Vector2d&) { return false; },
                           .is_sea = [&](const Vector2d& at) { return !is_land(at); },
                           .is_taken = [](const Vector2d&) { return false; },
                           .height_m = [](const Vector2d&) { return 50.0; }},
                          4096.0, 1);
    return town.buildings.at(0).design;
  };
  EXPECT_EQ(design_beside(50.0, "yes").kind, tiler::BuildingKind::Hall);
  EXPECT_LT(design_beside(50.0, "yes").top_m, 8.0);  // one storey of a hall
  EXPECT_EQ(design_beside(400.0, "yes").kind, tiler::BuildingKind::Apartments);
  EXPECT_EQ(design_beside(50.0, "apartments").kind, tiler::BuildingKind::Apartments);
}

TEST(Buildings, PartsReplaceTheirOutlineAndTwinsStandOnce) {
  ScratchFolder folder;
  write_vectors(
      folder / "a.gpkg", "GPKG",
      {{wkt(0, 0, 40, 20), {{"building", "yes"}, {"height", "10"}}},
       {wkt(0, 0, 20, 20), {{"building:part", "yes"}, {"height", "30"}, {"building", ""}}},
       {wkt(20, 0, 20, 20), {{"building:part", "yes"}, {"height", "12"}, {"min_height", "6"}}},
       {wkt(100, 0, 20, 20), {{"building", "yes"}, {"height", "10"}}},
       {wkt(100, 0, 20, 20), {{"building", "yes"}, {"height", "10"}}},
       {wkt(105, 5, 5, 5), {{"building", "yes"}, {"height", "10"}}},
       {wkt(119, 10, 20, 20), {{"building", "yes"}, {"height", "10"}}},
       {wkt(118, 40, 20, 20), {{"building", "yes"}, {"height", "10"}}},
       {wkt(130, 40, 20, 20), {{"building", "yes"}, {"height", "10"}}}},
      "EPSG:32631");
  const Built built(files_key(folder / "a.gpkg"));
  EXPECT_EQ(built.count("outlines replaced by parts"), 1);
  EXPECT_EQ(built.count("footprints in others left out"), 2);
  EXPECT_EQ(built.count("footprints across others"), 1);
  EXPECT_EQ(built.count("buildings"), 6);
  const auto solids = built.all({});
  ASSERT_EQ(solids.size(), 6u);
  bool has_raised = false;
  std::string bottoms;
  for (const auto& [id, solid] : solids) {
    int lowest = 1 << 30;
    for (const auto& vertex : solid.levels.front().shape.vertices_steps)
      lowest = std::min(lowest, vertex.z());
    // Sunk into what might carry it by 99 mm and a few setbacks.
    has_raised = has_raised || (lowest > steps(6.0 - 0.140) && lowest < steps(6.0 - 0.098));
    bottoms += fmt::format(" {}", lowest);
  }
  EXPECT_TRUE(has_raised) << bottoms;
}

TEST(Buildings, WhatBeginsAboveTheGroundIsCarriedOrComesDown) {
  ScratchFolder folder;
  const std::vector<std::pair<std::string, std::string>> raised = {
      {"building", "yes"}, {"height", "8"}, {"min_height", "4"}, {"roof:shape", "flat"}};
  write_vectors(folder / "a.gpkg", "GPKG",
                {{wkt(0, 0, 10, 10), raised},
                 {wkt(100, 0, 10, 10), raised},  // between two others
                 {wkt(90, 0, 10, 10), {{"building", "yes"}, {"height", "8"}}},
                 {wkt(110, 0, 10, 10), {{"building", "yes"}, {"height", "8"}}}},
                "EPSG:32631");
  const Built built(files_key(folder / "a.gpkg"));
  EXPECT_EQ(built.count("raised bodies that nothing carries"), 1);
  for (const auto& [id, solid] : built.all({})) {
    const double low_m = box_of(solid.levels.front().shape).first.z();
    if (solid.place_m.x() >= 100 && solid.place_m.x() < 110) {
      EXPECT_NEAR(low_m, 4.0 - 0.099, 2 * kHeightStep_m);
    } else {
      EXPECT_LT(low_m, -1.0) << solid.place_m.x();
    }
  }
}

TEST(Buildings, HoldTheirFootprintsAndCourtyardsAreFree) {
  ScratchFolder folder;
  const Vector2d at = utm31(kOriginLat_deg, kOriginLon_deg);
  write_vectors(folder / "a.gpkg", "GPKG",
                {{fmt::format("POLYGON(({0} {1},{2} {1},{2} {3},{0} {3},{0} {1}),({4} {5},{6} "
                              "{5},{6} {7},{4} {7},{4} {5}))",
                              at.x(), at.y(), at.x() + 40, at.y() + 40, at.x() + 10, at.y() + 10,
                              at.x() + 30, at.y() + 30),
                  {{"building", "apartments"}}}},
                "EPSG:32631");
  const Built built(files_key(folder / "a.gpkg"));
  // The grid is turned by a degree against the world here: 0.35 m over 20 m.
  EXPECT_TRUE(built.layer->holds({5, 5}, 0.0));
  EXPECT_FALSE(built.layer->holds({20, 20}, 9.5));
  EXPECT_TRUE(built.layer->holds({20, 20}, 10.5));
  EXPECT_FALSE(built.layer->holds({-3, 20}, 2.5));
  EXPECT_TRUE(built.layer->holds({-3, 20}, 3.5));
  EXPECT_FALSE(built.layer->holds({-3, -4}, 4.8));
  EXPECT_TRUE(built.layer->holds({-3, -4}, 5.2));
  const auto solids = built.all({});
  ASSERT_EQ(solids.size(), 1u);
  // Less its inset.
  EXPECT_NEAR(area_from_above_m2(*world::shape_at(solids.begin()->second.levels, 2)), 1200.0, 4.5);
}

TEST(Buildings, TheOrderOfTheSourceAndOfTilesDoesNotMatter) {
  ScratchFolder folder;
  std::vector<VectorSpec> specs;
  for (int j = 0; j < 12; ++j)
    for (int i = 0; i < 12; ++i) {
      const auto key = static_cast<std::uint64_t>(12 * j + i);
      specs.push_back(
          {wkt(core::random_between(-500, 500, 7, key, 0),
               core::random_between(-500, 500, 7, key, 1), core::random_between(4, 40, 7, key, 2),
               core::random_between(4, 25, 7, key, 3)),
           {{"building", "yes"}, {"osm_way_id", std::to_string(1000 + key)}}});
    }
  write_vectors(folder / "a.geojson", "GeoJSON", specs, "EPSG:32631");
  std::reverse(specs.begin(), specs.end());
  write_vectors(folder / "b.geojson", "GeoJSON", specs, "EPSG:32631");
  const Built one(files_key(folder / "a.geojson") + "number_field = \"osm_way_id\"\n");
  const Built other(files_key(folder / "b.geojson") + "number_field = \"osm_way_id\"\n");
  EXPECT_GT(one.count("buildings"), 90);
  Land land;
  land.slope = 0.05;
  std::vector<TileId> tiles;
  for (int level : {-1, 0, 1, 2, 4})
    for (int k = 0; k < 4; ++k)
      tiles.push_back(
          world::tile_at(level, (k & 1) != 0 ? 60.0 : -60.0, (k & 2) != 0 ? 60.0 : -60.0));
  const auto sorted = [&](const Built& built, const TileId& id) {
    std::vector<Solid> solids = built.on(id, land);
    std::sort(solids.begin(), solids.end(), [](const Solid& a, const Solid& b) {
      return a.provenance.instance_id < b.provenance.instance_id;
    });
    return solids;
  };
  std::vector<std::vector<Solid>> at_once(tiles.size());
  core::parallel_for(static_cast<std::int64_t>(tiles.size()), [&](std::int64_t k) {
    at_once[static_cast<std::size_t>(k)] = sorted(one, tiles[static_cast<std::size_t>(k)]);
  });
  std::map<std::pair<std::uint32_t, int>, world::Shape> known;
  for (std::size_t k = tiles.size(); k-- > 0;) {
    EXPECT_EQ(at_once[k], sorted(other, tiles[k])) << tiles[k].name();
    // Each level of a building is the same from any tile.
    for (const Solid& solid : at_once[k])
      for (const auto& level : solid.levels) {
        const auto [found, is_new] =
            known.try_emplace({solid.provenance.instance_id, level.coarsest_level}, level.shape);
        EXPECT_EQ(found->second, level.shape);
      }
  }
}

}  // namespace
}  // namespace terracast::test
