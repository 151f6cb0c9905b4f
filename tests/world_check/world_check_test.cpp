#include "validate/world_check/world_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <set>
#include <string>

#include "core/log.h"
#include "core/parallel.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_world.h"
#include "tests/world_check/boxes.h"
#include "validate/world_check/shape_check.h"

/// Tiny worlds with what is right, and with one defect each: the check finds it and names it.
namespace terracast::world_check {
namespace {

using world::kHeightStep_m;

constexpr double kGround_m = 10.0;

constexpr std::uint8_t kBuildings = 0, kPlants = 1, kRoads = 2;

world::Solid building(std::uint32_t id, int x_m, int y_m) {
  return {.provenance = {.instance_id = id, .layer = kBuildings, .feature = id},
          .place_m = {x_m, y_m},
          .origin_steps = kSteps * Eigen::Vector3i(x_m, y_m, static_cast<int>(kGround_m)),
          .levels = {{.coarsest_level = 5, .shape = box({-8, -8, -1}, {8, 8, 6})}}};
}

world::Instance plant(std::uint32_t id, int x_m, int y_m) {
  return {.provenance = {.instance_id = id, .layer = kPlants, .feature = id},
          .prototype = 0,
          .place_steps = kSteps * Eigen::Vector3i(x_m, y_m, static_cast<int>(kGround_m))};
}

world::Strip road(int from_x_m, int to_x_m, int y_m) {
  world::Strip strip;
  strip.coating = {.layer = kRoads, .feature = 1, .order = 0, .paving = world::Paving::Asphalt};
  strip.half_width_steps = 4 * kSteps;
  strip.points_steps = {{from_x_m * kSteps, y_m * kSteps}, {to_x_m * kSteps, y_m * kSteps}};
  return strip;
}

/// Tiles of level 2, 1024 m a side, around the origin; water beyond x = 800 m; objects as `edit` leaves them.
class WorldCheck : public testing::Test {
 protected:
  using Edit = std::function<void(world::Tile& south_west, world::Tile& south_east,
                                  world::Prototype& prototype)>;

  world::TileStore make(const std::filesystem::path& folder, const Edit& edit) {
    test::TinyWorldOptions options;
    options.cover = [](double x_world, double) {
      return x_world > 800.0 ? world::Cover::Lake : world::Cover::Land;
    };
    const world::TileStore empty = test::make_tiny_world(
        folder, [](double, double) { return kGround_m; }, options);
    world::WorldManifest manifest = empty.manifest();
    for (const char* kind : {"buildings", "vegetation", "roads"}) {
      world::LayerInfo layer;
      layer.name = layer.kind = kind;
      manifest.layers.push_back(layer);
    }
    manifest.layers[0].counts = {{"rings that were repaired", 3}};
    world::Prototype prototype{
        .name = "tree", .levels = {{.coarsest_level = 5, .shape = box({-1, -1, 0}, {1, 1, 9})}}};
    world::Tile west = empty.load({2, -1, -1}), east = empty.load({2, 0, -1});
    // On the border between both, and one in each.
    for (world::Tile* tile : {&west, &east}) tile->objects.solids.push_back(building(7, 3, -500));
    west.objects.solids.push_back(building(8, -300, -300));
    west.objects.instances.push_back(plant(100, -200, -200));
    east.objects.strips.push_back(road(100, 400, -200));
    edit(west, east, prototype);
    manifest.prototypes = {world::write_prototype(folder, 0, prototype)};
    for (world::Tile* tile : {&west, &east}) {
      tile->water_depth_steps.clear();
      for (const world::Cover cover : tile->cover)
        tile->water_depth_steps.push_back(cover == world::Cover::Lake ? 12 * kSteps : 0);
      tile->objects_top_steps = 100 * kSteps;
      const auto info = std::find_if(manifest.tiles.begin(), manifest.tiles.end(),
                                     [&](const auto& one) { return one.id == tile->id; });
      *info = world::write_tile(folder, *tile);
    }
    world::write_manifest(folder, manifest);
    return world::TileStore::open(folder);
  }

  WorldFaults check(const Edit& edit, int num_threads = 1) {
    const test::ScratchFolder folder;
    const world::TileStore store = make(folder / "world", edit);
    const core::Log log("test", core::LogLevel::Off);
    const core::ThreadLimit threads(num_threads);
    table_ = table_of(check_world(store, {.log = log}), store.manifest());
    return check_world(store, {.log = log});
  }

  /// The kinds that are found.
  std::set<std::string> found(const Edit& edit) {
    std::set<std::string> kinds;
    for (const Result& result : check(edit).results)
      if (result.num_faults > 0) {
        kinds.insert(std::string(result.name));
        EXPECT_FALSE(result.examples.empty()) << result.name;
      }
    return kinds;
  }
  world::Shape& walls(world::Tile& tile, std::size_t solid) {
    return tile.objects.solids[solid].levels[0].shape;
  }

  std::string table_;
};

using Kinds = std::set<std::string>;

TEST_F(WorldCheck, FindsNothingInAWorldThatIsRight) {
  const WorldFaults faults = check([](auto&, auto&, auto&) {});
  EXPECT_TRUE(faults.is_right());
  for (const Result& result : faults.results) {
    EXPECT_EQ(result.num_faults, 0)
        << result.name << ": " << (result.examples.empty() ? "" : result.examples.front());
    // Only of seagrass it is asked whether it is out of the water, and none grows here.
    EXPECT_EQ(result.num_asked > 0, result.name != "seagrass_out_of_water") << result.name;
  }
  EXPECT_NE(table_.find("rings that were repaired"), std::string::npos) << table_;
}

TEST_F(WorldCheck, FindsWhatIsWrongWithMeshes) {
  EXPECT_EQ(found([&](auto& west, auto&, auto&) { walls(west, 1).triangles.pop_back(); }),
            Kinds{"open_mesh"});
  EXPECT_EQ(found([&](auto& west, auto&, auto&) {
              auto& corners = walls(west, 1).triangles[3].corners;
              std::swap(corners[0], corners[1]);
            }),
            Kinds{"turned_face"});
  EXPECT_EQ(found([&](auto& west, auto&, auto&) {
              for (auto& triangle : walls(west, 1).triangles)
                std::swap(triangle.corners[0], triangle.corners[1]);
            }),
            Kinds{"inside_out"});
  EXPECT_EQ(found([&](auto& west, auto&, auto&) {
              walls(west, 1).triangles.push_back({.corners = {0, 1, 1}, .finish = 0});
            }),
            Kinds{"degenerate_face"});
  EXPECT_EQ(found([&](auto&, auto&, auto& prototype) {
              auto& triangles = prototype.levels[0].shape.triangles;
              auto twice = triangles[0];
              std::swap(twice.corners[0], twice.corners[1]);
              triangles.push_back(triangles[0]);
              triangles.push_back(twice);
            }),
            Kinds{"coincident_face"});
}

TEST_F(WorldCheck, FindsBodiesThatMeetThemselves) {
  // A corner of the roof goes through the floor: closed and outward still.
  EXPECT_EQ(found([&](auto& west, auto&, auto&) {
              walls(west, 1).vertices_steps[7] += kSteps * Eigen::Vector3i(-4, -4, -9);
            }),
            Kinds{"self_crossing"});
}

// What stands on building 8, from 6 m up: some metres to the east and the north, its bottom some millimetres above the top.
world::Solid upon(int east_m, int north_m, double above_m) {
  world::Solid solid = building(9, -300, -300);
  solid.levels[0].shape = box({east_m - 8, north_m - 8, 6}, {east_m + 8, north_m + 8, 12});
  solid.origin_steps.z() += static_cast<int>(std::lround(above_m * kSteps));
  return solid;
}

TEST_F(WorldCheck, FindsSolidsThatShareAPlane) {
  const auto with = [&](const world::Solid& solid) {
    return found([&](auto& west, auto&, auto&) { west.objects.solids.push_back(solid); });
  };
  const std::string kind = "coincident_solids";
  const auto has = [&](const world::Solid& solid) { return with(solid).contains(kind); };
  // Opposed, all of it, and a corner of 1 m2 of it.
  EXPECT_TRUE(has(upon(0, 0, 0.0)));
  EXPECT_TRUE(has(upon(15, 15, 0.0)));
  EXPECT_TRUE(has(upon(0, 0, 0.001)));  // as roundings put it
  // Corners and edges alone are no area; sunk by more than roundings, and beside it.
  EXPECT_FALSE(has(upon(16, 0, 0.0)));
  EXPECT_FALSE(has(upon(0, 0, 0.01)));
  EXPECT_FALSE(has(upon(3, 3, -0.01)));
  // Walls that face the same way, over 10 mm of their height.
  EXPECT_TRUE(has(upon(0, 3, -0.01)));
  // The wall of one against that of another, 16 m east of it; and 2 mm apart.
  world::Solid beside = building(9, -284, -300);
  EXPECT_TRUE(has(beside));
  beside.origin_steps.x() += 2;
  EXPECT_FALSE(has(beside));
  // A wall that is turned to it by 1 in 100 comes through it along a line; roofs and other walls are metres apart.
  beside.origin_steps += Eigen::Vector3i(-2, 3 * kSteps, kSteps);
  for (auto& vertex : beside.levels[0].shape.vertices_steps)
    vertex.x() -= (vertex.y() - 8 * kSteps / 3) / 100;
  EXPECT_FALSE(has(beside));
}

TEST_F(WorldCheck, LetsLeavesBeSheets) {
  EXPECT_EQ(found([&](auto&, auto&, auto& prototype) {
              auto& shape = prototype.levels[0].shape;
              shape.finishes.push_back({.material = world::Material::Leaves});
              shape.triangles.push_back({.corners = {0, 3, 7}, .finish = 1});
            }),
            Kinds{});
  EXPECT_EQ(found([&](auto&, auto&, auto& prototype) {
              auto& shape = prototype.levels[0].shape;
              shape.finishes.push_back({.material = world::Material::Textured});
              shape.triangles.push_back({.corners = {0, 3, 7}, .finish = 1});
            }),
            Kinds{"open_mesh"});
}

// Seen in November 2026: a plane of a user's file made a world wrong.
TEST_F(WorldCheck, TellsOfUsersModelsWhatIsWrongInOwnShapes) {
  using Change = std::function<void(world::Shape&)>;
  // Open models and uneven ones, in a world that is right.
  const auto told = [&](const Change& change, bool is_model = true) {
    const WorldFaults faults = check([&](auto&, auto&, world::Prototype& prototype) {
      prototype.is_model = is_model;
      prototype.levels.push_back(prototype.levels[0]);
      prototype.levels[1].coarsest_level = 6;
      for (world::ShapeLevel& level : prototype.levels) change(level.shape);
    });
    EXPECT_EQ(faults.is_right(), is_model);
    EXPECT_EQ(faults.information.at(0).name, "open_model");
    EXPECT_EQ(faults.information.at(1).name, "uneven_model");
    for (const Result& one : faults.information) {
      EXPECT_EQ(one.num_asked, is_model ? 1 : 0);
      EXPECT_EQ(one.examples.size(), static_cast<std::size_t>(one.num_faults));
    }
    return std::pair(faults.information[0].num_faults, faults.information[1].num_faults);
  };
  const auto is = [](int num_open, int num_uneven) {
    return std::pair(std::int64_t{num_open}, std::int64_t{num_uneven});
  };
  const Change make_plane = [](world::Shape& shape) { shape.triangles.resize(2); };
  const Change turn_one = [](world::Shape& shape) {
    std::swap(shape.triangles[3].corners[0], shape.triangles[3].corners[1]);
  };
  const Change add_twice = [](world::Shape& shape) {
    for (int side = 0; side < 2; ++side) {
      shape.triangles.push_back(shape.triangles[0]);
      if (side == 1)
        std::swap(shape.triangles.back().corners[0], shape.triangles.back().corners[1]);
    }
  };
  EXPECT_EQ(told([](world::Shape&) {}), is(0, 0));
  EXPECT_EQ(told(make_plane), is(1, 0));
  EXPECT_NE(table_.find("model tree: 4 open edges"), std::string::npos) << table_;
  EXPECT_EQ(told([&](world::Shape& shape) {
              make_plane(shape);
              shape.finishes[0].material = world::Material::Textured;
            }),
            is(1, 0));
  EXPECT_EQ(told(turn_one), is(0, 1));
  EXPECT_EQ(told(add_twice), is(0, 1));
  EXPECT_EQ(told([](world::Shape& shape) {
              for (auto& triangle : shape.triangles)
                std::swap(triangle.corners[0], triangle.corners[1]);
            }),
            is(0, 1));
  // A corner of the roof goes through the floor.
  EXPECT_EQ(told([](world::Shape& shape) {
              shape.vertices_steps[7] += kSteps * Eigen::Vector3i(-1, -1, -12);
            }),
            is(0, 0));
  for (const Change& change : {make_plane, turn_one, add_twice}) told(change, false);
  // What is left out as models are read must not be there.
  EXPECT_EQ(found([](auto&, auto&, auto& prototype) {
              prototype.is_model = true;
              prototype.levels[0].shape.triangles.push_back({.corners = {0, 1, 1}, .finish = 0});
            }),
            Kinds{"degenerate_face"});
}

TEST_F(WorldCheck, FindsWhatTilesDoNotShare) {
  EXPECT_EQ(found([&](auto&, auto& east, auto&) { east.objects.solids.clear(); }),
            Kinds{"missing_in_tile"});
  EXPECT_EQ(found([&](auto& west, auto&, auto&) { walls(west, 0).vertices_steps[7].z() += 1; }),
            Kinds{"unlike_in_tiles"});
  EXPECT_EQ(found([&](auto& west, auto&, auto&) {
              west.objects.instances.push_back(west.objects.instances[0]);
            }),
            Kinds{"twice_in_tile"});
}

TEST_F(WorldCheck, FindsWhatDoesNotStandOnTheGround) {
  EXPECT_EQ(found([&](auto& west, auto&, auto&) {
              west.objects.instances[0].place_steps.z() += 3 * kSteps;
            }),
            Kinds{"floating_instance"});
  EXPECT_EQ(found([&](auto& west, auto&, auto&) {
              west.objects.solids[1].origin_steps.z() += 4 * kSteps;
            }),
            Kinds{"floating_building"});
}

TEST_F(WorldCheck, LetsRoomsHangBetweenHousesOnBothSidesOfAStreet) {
  const auto found_with = [&](bool is_on_both_sides) {
    return found([&](auto& west, auto&, auto&) {
      // Building 8 is 16 m wide; rooms from 4 m up reach from 2 cm beside it to 2 cm beside the next one.
      world::Solid rooms = building(9, -286, -300);
      rooms.levels[0].shape = box({-6, -4, 4}, {6, 5, 5});
      for (auto& vertex : rooms.levels[0].shape.vertices_steps)
        vertex.x() += vertex.x() > 0 ? -20 : 20;
      west.objects.solids.push_back(rooms);
      if (!is_on_both_sides) return;
      west.objects.solids.push_back(building(10, -272, -308));  // not up to the fourth corner
    });
  };
  EXPECT_EQ(found_with(true), Kinds{});
  EXPECT_EQ(found_with(false), Kinds{"floating_building"});
}

// A body, and building 8 beside or below it, whose box in the plan holds the body's.
TEST_F(WorldCheck, LetsBodiesBeHeldByWhatMeetsThemAlone) {
  const auto found_with = [&](const Eigen::Vector3i& low_m, const Eigen::Vector3i& high_m,
                              bool is_turned, int up_mm = 0) {
    return found([&](auto& west, auto&, auto&) {
      if (is_turned)  // by an eighth: its walls are where x and y about its middle add up to 8 m
        for (auto& vertex : walls(west, 1).vertices_steps)
          vertex = {(vertex.x() - vertex.y()) / 2, (vertex.x() + vertex.y()) / 2, vertex.z()};
      world::Solid body = building(9, -300, -300);
      body.levels[0].shape = box(low_m, high_m);
      body.origin_steps.z() += up_mm * kSteps / 1000;
      west.objects.solids.push_back(body);
    });
  };
  // Building 8 is 6 m high: upon it, within a seam above it, and higher.
  EXPECT_EQ(found_with({-4, -4, 6}, {4, 4, 9}, false, 40), Kinds{});
  EXPECT_EQ(found_with({-4, -4, 6}, {4, 4, 9}, false, 100), Kinds{"floating_building"});
  EXPECT_EQ(found_with({-4, -4, 10}, {4, 4, 12}, false), Kinds{"floating_building"});
  // At a corner of its box where it is not, and in it; the body's own bottom lies 4 m above the ground.
  EXPECT_EQ(found_with({5, 5, 4}, {7, 7, 5}, true), Kinds{"floating_building"});
  EXPECT_EQ(found_with({-3, -3, 4}, {3, 3, 5}, true), Kinds{});
  // Its corners reach over all walls, its middle is in the house; and it reaches out of one wall by more than it is in it.
  EXPECT_EQ(found_with({-7, -7, 4}, {7, 7, 5}, true), Kinds{});
  EXPECT_EQ(found_with({-1, -1, 4}, {20, 1, 5}, true), Kinds{"floating_building"});
}

// The place of a solid is the middle of the polygon of which it may be one piece of many.
TEST_F(WorldCheck, HoldsABodyByItsOwnMiddle) {
  const auto found_with = [&](int north_m) {
    return found([&](auto& west, auto&, auto&) {
      // Rooms 12 m long between building 8 and a house 12 m east of it, about their place; and a wing to the north of them.
      west.objects.solids.push_back(building(10, -272, -300));
      world::Solid rooms = building(9, -286, -300);
      world::Shape& shape = rooms.levels[0].shape = box({-6, -4, 4}, {6, 4, 5});
      for (auto& vertex : shape.vertices_steps) vertex.x() += vertex.x() > 0 ? -20 : 20;
      const world::Shape wing = box({-5, 3, 4}, {5, north_m, 5});
      for (world::Shape::Triangle triangle : wing.triangles) {
        for (auto& corner : triangle.corners) corner += 8;  // after those of the rooms
        shape.triangles.push_back(triangle);
      }
      shape.vertices_steps.insert(shape.vertices_steps.end(), wing.vertices_steps.begin(),
                                  wing.vertices_steps.end());
      west.objects.solids.push_back(rooms);
    });
  };
  // Of areas of 96 and 20 m2 the middle lies between the houses, of 96 and 570 m2 far north of them.
  EXPECT_EQ(found_with(5), Kinds{});
  EXPECT_EQ(found_with(60), Kinds{"floating_building"});
}

TEST_F(WorldCheck, JudgesTheShapesThatATileMayShow) {
  // Over the western tile, of level 2, the building of the eastern one is shown as by level 1 at the finest.
  const auto with_floating = [](int level) {
    return [level](world::Tile& west, world::Tile& east, auto&) {
      for (world::Tile* tile : {&west, &east}) {
        world::Solid& solid = tile->objects.solids[0];
        solid.levels.insert(solid.levels.begin(),
                            {.coarsest_level = static_cast<std::int8_t>(level),
                             .shape = box({-8, -8, 5}, {8, 8, 9})});
      }
    };
  };
  EXPECT_EQ(found(with_floating(0)), Kinds{});
  EXPECT_EQ(found(with_floating(1)), Kinds{"floating_building"});
}

TEST_F(WorldCheck, LetsBodiesStandOnWhatIsWideOnCoarseTilesAlone) {
  // Building 8 is a tower of 8 m, up to some level, and a block of 16 m beyond. The western tile is of
  // level 2.
  const auto found_with = [&](int tower_level) {
    return found([&](auto& west, auto&, auto&) {
      auto& levels = west.objects.solids[1].levels;
      levels.insert(levels.begin(), {.coarsest_level = static_cast<std::int8_t>(tower_level),
                                     .shape = box({-4, -4, -1}, {4, 4, 6})});
      world::Solid body = building(9, -300, -300);
      body.levels[0].shape = box({5, 5, 6}, {7, 7, 9});
      body.origin_steps.z() += 40 * kSteps / 1000;
      west.objects.solids.push_back(body);
    });
  };
  EXPECT_EQ(found_with(1), Kinds{});
  EXPECT_EQ(found_with(2), Kinds{"floating_building"});
}

TEST_F(WorldCheck, LetsThingsStandUponEachOtherButNotInTheAir) {
  const auto stack = [&](world::Tile& tile, double gap_m) {
    world::Instance below = plant(201, 300, -300), above = plant(202, 300, -300);
    below.provenance.layer = above.provenance.layer = kRoads;
    above.place_steps.z() += kSteps * 9 + static_cast<int>(gap_m * kSteps);
    tile.objects.instances.push_back(below);
    tile.objects.instances.push_back(above);
  };
  EXPECT_EQ(found([&](auto&, auto& east, auto&) { stack(east, 0.0); }), Kinds{});
  EXPECT_EQ(found([&](auto&, auto& east, auto&) { stack(east, 1.0); }), Kinds{"floating_instance"});
}

TEST_F(WorldCheck, FindsWhatStandsWhereItMayNot) {
  EXPECT_EQ(found([&](auto&, auto& east, auto&) {
              east.objects.instances.push_back(plant(101, 900, -300));
            }),
            Kinds{"plant_in_water"});
  EXPECT_EQ(found([&](auto&, auto& east, auto&) {
              east.objects.instances.push_back(plant(101, 250, -203));
            }),
            Kinds{"plant_on_paint"});
  EXPECT_EQ(found([&](auto& west, auto&, auto&) {
              west.objects.instances.push_back(plant(101, -303, -298));
            }),
            Kinds{"plant_in_wall"});
  EXPECT_EQ(
      found([&](auto&, auto& east, auto&) { east.objects.strips.push_back(road(600, 950, -100)); }),
      Kinds{"paint_under_water"});
}

TEST_F(WorldCheck, FindsSeagrassOnLandAndOutOfTheWater) {
  // 12 m of water beyond x = 800 m; the prototype is 9 m high.
  constexpr int kBed_m = static_cast<int>(kGround_m) - 12;
  const auto found_at = [&](const char* name, core::SemanticClass semantic_class, int x_m,
                            int z_m) {
    return found([&](auto&, auto& east, auto& prototype) {
      prototype.name = name;
      for (world::ShapeLevel& level : prototype.levels)
        for (world::Finish& finish : level.shape.finishes) finish.semantic_class = semantic_class;
      world::Instance instance = plant(101, x_m, -300);
      instance.place_steps.z() = z_m * kSteps;
      east.objects.instances.push_back(instance);
    });
  };
  // Without the plant that all these worlds have on land, which would be seagrass, too.
  const auto seagrass_found = [&](int x_m, int z_m) {
    return found([&](auto& west, auto& east, auto& prototype) {
      prototype.name = "seagrass_0";
      west.objects.instances.clear();
      world::Instance instance = plant(101, x_m, -300);
      instance.place_steps.z() = z_m * kSteps;
      east.objects.instances.push_back(instance);
    });
  };
  EXPECT_EQ(seagrass_found(900, kBed_m), Kinds{});
  EXPECT_EQ(seagrass_found(900, kBed_m + 2), Kinds{"floating_instance"});
  EXPECT_EQ(seagrass_found(900, static_cast<int>(kGround_m)),
            (Kinds{"floating_instance", "seagrass_out_of_water"}));
  EXPECT_EQ(seagrass_found(250, static_cast<int>(kGround_m)), Kinds{"seagrass_out_of_water"});
  // Stones lie where they like, but do not float; trees do not stand on the bed either.
  EXPECT_EQ(found_at("boulder_0", core::SemanticClass::Stone, 900, kBed_m), Kinds{});
  EXPECT_EQ(found_at("boulder_0", core::SemanticClass::Stone, 900, kBed_m + 2),
            Kinds{"floating_instance"});
  EXPECT_EQ(found_at("boulder_0", core::SemanticClass::Stone, 250, static_cast<int>(kGround_m)),
            Kinds{});
  EXPECT_EQ(found_at("oak_0", core::SemanticClass::Tree, 900, kBed_m), Kinds{"plant_in_water"});
  // What has no surface at all is no stone.
  EXPECT_EQ(found([&](auto&, auto& east, auto& prototype) {
              prototype.levels.clear();
              world::Instance instance = plant(101, 900, -300);
              instance.place_steps.z() = kBed_m * kSteps;
              east.objects.instances.push_back(instance);
            }),
            Kinds{"plant_in_water"});
}

TEST_F(WorldCheck, FindsAreasPaintedOnWaterButNotPiers) {
  // Of water beyond x = 800 m the middle of a cell of four samples; no corner of the area lies near it.
  const auto square = [](int east_m, core::SemanticClass semantic_class, bool has_hole) {
    world::Area area;
    area.coating = {.layer = kRoads, .feature = 1, .paving = world::Paving::Cobbles};
    area.coating.semantic_class = semantic_class;
    const auto ring = [](int west_m, int side_east_m, int south_m, int north_m) {
      return std::vector<Eigen::Vector2i>{{west_m * kSteps, south_m * kSteps},
                                          {side_east_m * kSteps, south_m * kSteps},
                                          {side_east_m * kSteps, north_m * kSteps},
                                          {west_m * kSteps, north_m * kSteps}};
    };
    area.rings_steps = {ring(700, east_m, -500, -100)};
    if (has_hole) area.rings_steps.push_back(ring(790, 1000, -450, -150));
    return area;
  };
  using core::SemanticClass;
  const auto found_with = [&](const world::Area& area) {
    return found([&](auto&, auto& east, auto&) { east.objects.areas.push_back(area); });
  };
  // Samples are 4 m apart: the first cell of water is that from 804 to 808 m.
  EXPECT_EQ(found_with(square(805, SemanticClass::Path, false)), Kinds{});
  EXPECT_EQ(found_with(square(807, SemanticClass::Path, false)), Kinds{"paint_under_water"});
  EXPECT_EQ(found_with(square(1010, SemanticClass::Path, true)), Kinds{"paint_under_water"});
  EXPECT_EQ(found_with(square(807, SemanticClass::Pier, false)), Kinds{});
}

TEST_F(WorldCheck, SaysTheSameWithAnyNumberOfThreads) {
  const Edit edit = [](auto& west, auto&, auto&) {
    west.objects.solids[1].origin_steps.z() += 9000;
  };
  check(edit, 1);
  const std::string one = table_;
  check(edit, 2);
  EXPECT_EQ(table_, one);
}

/// That this process has read so far; nothing where the system does not tell.
std::optional<std::uint64_t> num_bytes_read() {
  std::ifstream file("/proc/self/io");
  std::string name;
  std::uint64_t value = 0;
  while (file >> name >> value)
    if (name == "rchar:") return value;
  return std::nullopt;
}

TEST_F(WorldCheck, ReadsEachFileOnce) {
  if (!num_bytes_read()) GTEST_SKIP() << "/proc/self/io does not tell what is read";
  const test::ScratchFolder folder;
  const world::TileStore store = make(folder / "world", [](auto&, auto&, auto&) {});
  std::uint64_t num_bytes = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder / "world"))
    if (entry.is_regular_file()) num_bytes += entry.file_size();
  const core::Log log("test", core::LogLevel::Off);
  const std::uint64_t before = *num_bytes_read();
  check_world(store, {.log = log});
  // The store's manifest was read before; counting reads some hundred bytes itself.
  EXPECT_LE(*num_bytes_read() - before, num_bytes);
}

}  // namespace
}  // namespace terracast::world_check
