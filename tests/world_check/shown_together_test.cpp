#include "validate/world_check/shown_together.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <set>
#include <vector>

#include "core/log.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_world.h"
#include "tests/world_check/boxes.h"
#include "validate/world_check/world_check.h"
#include "world/lod.h"

/// Solids that meet where tiles and levels of detail do, wrong on purpose.
namespace terracast::world_check {
namespace {

using world::TileId;

struct Level {
  int coarsest;
  world::Shape shape;
};

/// Shapes about the place, on ground at 10 m.
world::Solid solid(std::uint32_t id, int x_m, int y_m, const std::vector<Level>& levels) {
  world::Solid made{.provenance = {.instance_id = id, .layer = 0, .feature = id},
                    .place_m = {x_m, y_m},
                    .origin_steps = kSteps * Eigen::Vector3i(x_m, y_m, 10),
                    .levels = {}};
  for (const Level& level : levels)
    made.levels.push_back(
        {.coarsest_level = static_cast<std::int8_t>(level.coarsest), .shape = level.shape});
  return made;
}

/// All cuts of a square of four tiles of level 2 whose tiles may be split down to level 0 each, as the renderer makes
/// them: by splitting one and balancing.
TEST(CutsOfTiles, HoldWhatMayBeInOneAndNothingElse) {
  std::set<TileId> tiles;
  std::vector<TileId> roots;
  for (int y = -1; y <= 0; ++y)
    for (int x = -1; x <= 0; ++x) roots.push_back({2, x, y});
  const std::function<void(const TileId&)> grow = [&](const TileId& id) {
    tiles.insert(id);
    for (int k = 0; k < 4 && id.level > 0; ++k) grow(id.child(k));
  };
  for (const TileId& root : roots) grow(root);
  // The coarsest cut in which two tiles are leaves: what is not theirs is split no farther than they need.
  const auto cut_with = [&](const TileId& one, const TileId& other) {
    std::vector<TileId> leaves;
    const std::function<void(const TileId&)> split = [&](const TileId& id) {
      const bool is_above = (id != one && id.contains(one)) || (id != other && id.contains(other));
      if (!is_above) return leaves.push_back(id);
      for (int k = 0; k < 4; ++k) split(id.child(k));
    };
    for (const TileId& root : roots) split(root);
    return world::balance(leaves);
  };
  int num_apart = 0, num_together = 0;
  for (const TileId& one : tiles)
    for (const TileId& other : tiles) {
      const std::vector<TileId> cut = cut_with(one, other);
      const auto is_leaf = [&](const TileId& id) {
        return std::find(cut.begin(), cut.end(), id) != cut.end();
      };
      const bool may_be = is_leaf(one) && is_leaf(other);
      ASSERT_EQ(may_be_in_one_cut(one, other), may_be) << one.name() << " " << other.name();
      ++(may_be ? num_together : num_apart);
    }
  // Of 84 tiles, in both orders: 36 pairs in each root of which one lies in the other; and of each root with its two
  // neighbours along an edge the 8 finest tiles of either neighbour whose parents lie along it.
  EXPECT_EQ(num_apart, 2 * 4 * 36 + 2 * 4 * 2 * 8);
  EXPECT_EQ(num_apart + num_together, 84 * 84);
}

class ShownTogetherTest : public testing::Test {
 protected:
  using Solids = std::map<TileId, std::vector<world::Solid>>;

  /// Coincident solids of a world of four tiles of level 2, 1024 m a side, of which those in the west are split into tiles
  /// of level 1.
  static Result coincident_in(const Solids& solids) {
    const test::ScratchFolder folder;
    test::TinyWorldOptions options;
    options.finest_level = 1;
    options.refine = [](const TileId& id) { return id.x < 0; };
    const world::TileStore empty = test::make_tiny_world(
        folder / "world", [](double, double) { return 10.0; }, options);
    world::WorldManifest manifest = empty.manifest();
    world::LayerInfo layer;
    layer.name = layer.kind = "buildings";
    manifest.layers.push_back(layer);
    for (const auto& [id, objects] : solids) {
      world::Tile tile = empty.load(id);
      tile.objects.solids = objects;
      tile.objects_top_steps = 100 * kSteps;
      *std::find_if(manifest.tiles.begin(), manifest.tiles.end(), [&](const auto& one) {
        return one.id == id;
      }) = world::write_tile(folder / "world", tile);
    }
    world::write_manifest(folder / "world", manifest);
    const core::Log log("test", core::LogLevel::Off);
    const WorldFaults faults = check_world(world::TileStore::open(folder / "world"), {.log = log});
    return *std::find_if(faults.results.begin(), faults.results.end(),
                         [](const Result& result) { return result.name == "coincident_solids"; });
  }

  const TileId west_{1, -1, 0}, coarse_west_{2, -1, 0}, east_{2, 0, 0};
};

TEST_F(ShownTogetherTest, FindsWhatOnlyMeetsWhereLevelsDo) {
  // East of x = 0 tiles are coarse: there the second one is shown by its coarse shape, and the first one, of a fine tile,
  // by its fine shape. These two have their tops in one plane, 16 m high; neither pair of one level has.
  const auto pair = [](int fine_top_m, int coarse_top_m) {
    return std::vector<world::Solid>{
        solid(1, -4, 100, {{1, box({-8, -8, -2}, {8, 8, 16})}, {5, box({-8, -8, -3}, {8, 8, 14})}}),
        solid(2, 4, 100,
              {{1, box({-7, -7, -4}, {7, 7, fine_top_m})},
               {5, box({-7, -7, -5}, {7, 7, coarse_top_m})}})};
  };
  const auto found = [&](const std::vector<world::Solid>& solids) {
    return coincident_in({{west_, solids}, {coarse_west_, solids}, {east_, solids}});
  };
  const Result wrong = found(pair(12, 16));
  EXPECT_EQ(wrong.num_faults, 1);  // though two tiles hold both
  ASSERT_FALSE(wrong.examples.empty());
  // What both cover: from 4 - 7 to -4 + 8 m, by 14 m.
  EXPECT_NE(wrong.examples[0].find("objects 1 and 2, to levels 1 and 5: 98.00 m2"),
            std::string::npos)
      << wrong.examples[0];
  EXPECT_EQ(found(pair(12, 13)).num_faults, 0);
  // In no tile is the second one shown finely, as none of level 1 holds its place.
  EXPECT_EQ(found(pair(16, 13)).num_faults, 0);
}

TEST_F(ShownTogetherTest, FindsWhatReachesOverTilesThatAreNotThere) {
  // Both stand in the fine tile; the faces that they share lie east of it, where tiles are coarse alone.
  const std::vector<world::Solid> solids = {
      solid(1, -4, 100, {{1, box({-2, -8, -2}, {20, 8, 16})}, {5, box({-2, -8, -3}, {20, 8, 14})}}),
      solid(2, -4, 100, {{1, box({8, -7, -4}, {24, 7, 16})}, {5, box({8, -7, -5}, {24, 7, 12})}})};
  EXPECT_EQ(coincident_in({{west_, solids}, {coarse_west_, solids}, {east_, solids}}).num_faults,
            1);
}

TEST_F(ShownTogetherTest, FindsWallsInTheBorderOfTiles) {
  // The wall of the first one lies in the border, which belongs to the eastern tile; that one need not hold what reaches
  // up to it alone.
  const TileId south_west{2, -1, -1}, south_east{2, 0, -1};
  const TileId fine_west{1, -1, -1};
  const world::Solid west = solid(1, -4, -100, {{5, box({-8, -8, -2}, {4, 8, 16})}});
  const world::Solid east = solid(2, 4, -100, {{5, box({-4, -8, -3}, {8, 8, 12})}});
  EXPECT_EQ(
      coincident_in({{fine_west, {west, east}}, {south_west, {west, east}}, {south_east, {east}}})
          .num_faults,
      1);
}

}  // namespace
}  // namespace terracast::world_check
