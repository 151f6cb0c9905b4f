#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "core/parallel.h"
#include "tests/tiler/planted_layer.h"
#include "tiler/tile_builder.h"
#include "world/objects_file.h"

namespace terracast::test {
namespace {

using core::ErrorKind;
using Eigen::Vector2d;
using world::Cover;
using world::Instance;
using world::TileId;

TEST(Vegetation, PrototypesAreSaneAndSurviveTheirFiles) {
  for (const world::Prototype& prototype : planted().layer->prototypes()) {
    SCOPED_TRACE(prototype.name);
    std::size_t num_degenerate = 0;
    for (const world::ShapeLevel& level : prototype.levels)
      for (const world::Shape::Triangle& triangle : level.shape.triangles) {
        const auto at = [&](std::size_t k) {
          return Eigen::Vector3d(level.shape.vertices_steps.at(triangle.corners[k]).cast<double>());
        };
        if ((at(1) - at(0)).cross(at(2) - at(0)).norm() == 0.0) ++num_degenerate;
      }
    EXPECT_EQ(num_degenerate, 0U);
    EXPECT_EQ(world::decode_prototype(world::encode_prototype(prototype), "plant"), prototype);
  }
}

TEST(Vegetation, TreesKeepTheirDistanceAndAreAsManyAsInAForest) {
  const Planted& layer = planted();
  const PlantedLand land;
  std::vector<Vector2d> stems;
  for (const auto& [id, instance] : layer.shown_on({0, 0, 0}, land))
    if (layer.is_tree(instance)) stems.push_back(Planted::place_of(instance));
  double least_m = 1e9;
  for (std::size_t i = 0; i < stems.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) least_m = std::min(least_m, (stems[i] - stems[j]).norm());
  EXPECT_GE(least_m, 3.5 - 0.002);  // places are rounded to steps
  // 6.55 ha; European forests have some 200 to 800 stems a hectare.
  const double per_hectare = static_cast<double>(stems.size()) / 6.5536;
  EXPECT_GT(per_hectare, 200.0);
  EXPECT_LT(per_hectare, 800.0);
}

TEST(Vegetation, TilesOfAnySizeInAnyOrderHoldTheSame) {
  const Planted& layer = planted();
  PlantedLand land = with_things();
  land.cover_at = [](const Vector2d& at) {
    const auto cell =
        static_cast<int>(std::floor(at.x() / 90.0) + 7.0 * std::floor(at.y() / 110.0));
    constexpr Cover kCovers[] = {Cover::Forest, Cover::Crops,   Cover::Grass,   Cover::Shrubs,
                                 Cover::Land,   Cover::BuiltUp, Cover::Wetland, Cover::Bare};
    return kCovers[((cell % 8) + 8) % 8];
  };
  // One tile of level 2 against the 16 of level 0 in an order of their own, and those from threads.
  const auto whole = layer.shown_on({2, -1, -1}, land);
  ASSERT_GT(whole.size(), 5000U);
  std::vector<std::map<std::uint32_t, Instance>> parts(16);
  core::parallel_for(16, [&](std::int64_t i) {
    const int k = static_cast<int>((i * 7 + 3) % 16);
    parts[static_cast<std::size_t>(k)] = layer.shown_on({0, -4 + k % 4, -4 + k / 4}, land);
  });
  std::map<std::uint32_t, Instance> all;
  std::size_t num_parts = 0;
  for (const auto& part : parts) {
    num_parts += part.size();
    all.insert(part.begin(), part.end());
  }
  EXPECT_EQ(all.size(), num_parts);  // each id once
  std::size_t num_found = 0;
  for (const auto& [id, instance] : whole) {
    ASSERT_TRUE(all.contains(id));
    EXPECT_EQ(all.at(id), instance);
    ++num_found;
  }
  // What level 2 does not show is too small for it.
  for (const auto& [id, instance] : all)
    if (!whole.contains(id)) {
      EXPECT_EQ(layer.shape_of(instance, 2), nullptr) << layer.name_of(instance);
    }
  EXPECT_GT(num_found, 5000U);
  EXPECT_EQ(layer.on({0, -2, -2}, land), layer.on({0, -2, -2}, land));
}

TEST(Vegetation, NeighboursHoldWhatReachesIntoThem) {
  const Planted& layer = planted();
  const PlantedLand land;
  // Whatever the levels of two tiles beside each other: a crown over the border is in both.
  for (const auto& [near, beside] :
       std::vector<std::pair<TileId, TileId>>{{{0, 0, 0}, {0, 1, 0}},
                                              {{0, 1, 0}, {1, 1, 0}},
                                              {{2, 1, 0}, {3, 1, 0}},
                                              {{3, 0, 0}, {2, 2, 1}},
                                              {{3, 1, 0}, {4, 1, 0}},
                                              {{5, -1, 0}, {4, 0, 0}}}) {
    SCOPED_TRACE(near.name() + " beside " + beside.name());
    std::map<std::uint32_t, Instance> held;
    for (const Instance& instance : layer.on(near, land))
      held.emplace(instance.provenance.instance_id, instance);
    std::size_t num_reaching = 0;
    for (const auto& [id, instance] : layer.shown_on(beside, land)) {
      const Vector2d at = Planted::place_of(instance);
      const Vector2d corner = near.corner_world();
      const Vector2d outside =
          (corner - at).cwiseMax(at - corner - Vector2d::Constant(near.side_m())).cwiseMax(0.0);
      if (outside.norm() >= layer.reach_m(instance)) continue;
      ++num_reaching;
      ASSERT_TRUE(held.contains(id)) << layer.name_of(instance) << " at " << at.transpose();
      EXPECT_EQ(held.at(id), instance);
    }
    EXPECT_GT(num_reaching, 10U);
  }
}

/// Share of a square of 256 m that the shapes shown on a tile's level cover, seen from above, by a raster
/// of half metres.
double covered_share(const Planted& layer, const PlantedLand& land, const TileId& id,
                     const Vector2d& corner) {
  constexpr int kSide = 512;
  constexpr double kCell_m = 0.5;
  std::vector<std::uint8_t> is_covered(kSide * kSide, 0);
  for (const auto& [number, instance] : layer.shown_on(id, land)) {
    const world::Shape& shape = *layer.shape_of(instance, id.level);
    const double turn_rad = instance.heading * 2.0 * std::numbers::pi / 65536.0;
    const Eigen::Rotation2Dd turned(turn_rad);
    const auto at = [&](std::uint32_t vertex) {
      return Vector2d((Planted::place_of(instance) - corner +
                       turned * (shape.vertices_steps[vertex].head<2>().cast<double>() *
                                 (world::kHeightStep_m * instance.scale / 4096.0))) /
                      kCell_m);
    };
    for (const world::Shape::Triangle& triangle : shape.triangles) {
      const Vector2d a = at(triangle.corners[0]);
      const Vector2d b = at(triangle.corners[1]);
      const Vector2d c = at(triangle.corners[2]);
      const Vector2d lowest = a.cwiseMin(b).cwiseMin(c).array().floor();
      const Vector2d highest = a.cwiseMax(b).cwiseMax(c).array().ceil();
      for (int j = std::max(0, static_cast<int>(lowest.y()));
           j < std::min<double>(kSide, highest.y()); ++j)
        for (int i = std::max(0, static_cast<int>(lowest.x()));
             i < std::min<double>(kSide, highest.x()); ++i) {
          const Vector2d p(i + 0.5, j + 0.5);
          const auto side = [&](const Vector2d& u, const Vector2d& v) {
            return (v - u).x() * (p - u).y() - (v - u).y() * (p - u).x();
          };
          const double s = side(a, b);
          const double t = side(b, c);
          const double u = side(c, a);
          if ((s >= 0 && t >= 0 && u >= 0) || (s <= 0 && t <= 0 && u <= 0))
            is_covered[static_cast<std::size_t>(j * kSide + i)] = 1;
        }
    }
  }
  return static_cast<double>(std::count(is_covered.begin(), is_covered.end(), 1)) / (kSide * kSide);
}

TEST(Vegetation, ForestCoversItsGroundAtEveryLevel) {
  const Planted& layer = planted();
  const PlantedLand land;
  // The same ground on tiles of all levels; of coarse ones the part that lies there.
  const double finest = covered_share(layer, land, {0, 2, 1}, {512.0, 256.0});
  EXPECT_GT(finest, 0.5);
  EXPECT_LT(finest, 0.95);
  for (const TileId id :
       {TileId{1, 1, 0}, TileId{2, 0, 0}, TileId{3, 0, 0}, TileId{4, 0, 0}, TileId{5, 0, 0}})
    EXPECT_NEAR(covered_share(layer, land, id, {512.0, 256.0}), finest, 0.17) << id.name();
}

TEST(Vegetation, TilesHoldNoMoreThanTheyCanShow) {
  const Planted& layer = planted();
  const PlantedLand land;
  for (const TileId id : {TileId{-2, 0, 0}, TileId{0, 0, 0}, TileId{2, 0, 0}, TileId{3, 0, 0},
                          TileId{4, 0, 0}, TileId{5, 0, 0}}) {
    const std::size_t num_instances = layer.on(id, land).size();
    // A piece of forest for each cell of the terrain, and what reaches over the border.
    EXPECT_LT(num_instances, 80000U) << id.name();
    EXPECT_GT(num_instances, id.level < 0 ? 20U : 1500U) << id.name();
  }
  EXPECT_TRUE(layer.on({8, 0, 0}, land).empty());
}

TEST(Vegetation, IdsAreThoseOfTheirCellsInAllTiles) {
  const Planted& layer = planted();
  PlantedLand land;
  std::map<std::uint32_t, Instance> by_id;
  for (const Cover cover : {Cover::Forest}) {
    land.cover_at = [cover](const Vector2d&) { return cover; };
    for (const TileId id :
         {TileId{-1, 3, 5}, TileId{0, 1, 2}, TileId{2, 0, 0}, TileId{3, 0, 0}, TileId{4, 0, 0}})
      for (const Instance& instance : layer.on(id, land)) {
        const std::uint32_t number = instance.provenance.instance_id;
        EXPECT_NE(number & 0x80000000U, 0U);
        EXPECT_EQ(instance.provenance.feature, number);
        const auto [entry, is_new] = by_id.emplace(number, instance);
        ASSERT_TRUE(is_new || entry->second == instance) << layer.name_of(instance);
      }
  }
  std::set<std::array<int, 3>> places;
  for (const auto& [id, instance] : by_id) {
    if (!layer.is_tree(instance)) continue;
    const Eigen::Vector3i& at = instance.place_steps;
    EXPECT_TRUE(places.insert({at.x(), at.y(), at.z()}).second);
  }
}

TEST(Vegetation, FeetAreOnTheGround) {
  const Planted& layer = planted();
  const PlantedLand land;
  for (const TileId id : {TileId{0, 0, 0}, TileId{3, 0, 0}})
    for (const Instance& instance : layer.on(id, land)) {
      const Vector2d at = Planted::place_of(instance);
      // Half a step of height, and half a step of place on a slope of 0.02.
      EXPECT_NEAR(instance.place_steps.z() * world::kHeightStep_m, land.ground_z_world(at), 6e-4);
    }
}

TEST(Vegetation, WorldsTooLargeForItsIdsAndASecondLayerAreRefused) {
  EXPECT_NO_THROW(Planted("", 57000.0));
  expect_error(ErrorKind::Config, {"vegetation", "size_m = 80000", "km"},
               [] { Planted("", 80000.0); });
  tiler::WorldOptions options = world_of("plane", 1024.0);
  options.layers = {vegetation_of(""), vegetation_of("name = \"more\"")};
  expect_error(ErrorKind::Config, {"one layer of kind vegetation"}, [&] { prepare(options); });
}

TEST(Vegetation, TilesOfAWorldWithItAreBuiltTheSameByAnyThreads) {
  tiler::WorldOptions options = world_of("plane", 2048.0);
  options.elevation[0].height_m = 400.0;
  options.layers = {vegetation_of("seed = 3")};
  const auto one = prepare(options, 1);
  const auto two = prepare(options, 2);
  EXPECT_EQ(one->input_hash(), two->input_hash());
  const TileId id{1, 0, -1};
  const world::Tile tile = tiler::build_tile(*one, id);
  EXPECT_EQ(tile, tiler::build_tile(*two, id));
  EXPECT_GT(tile.objects.instances.size(), 100U);
  EXPECT_GT(tile.objects_top_steps, tile.height_steps.front());
  options.seed = 2;
  EXPECT_NE(prepare(options)->input_hash(), one->input_hash());
}

}  // namespace
}  // namespace terracast::test
