#include "world/lod.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

#include "core/error.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_world.h"
#include "tests/world/mountains.h"

namespace terracast::world {
namespace {

/// Leaves of a random quadtree over 3 x 3 roots of level 6.
std::vector<TileId> random_leaves(unsigned seed) {
  std::mt19937 random(seed);
  std::vector<TileId> leaves;
  const std::function<void(const TileId&)> grow = [&](const TileId& id) {
    if (id.level == 0 || random() % 100 < 62) {
      leaves.push_back(id);
      return;
    }
    for (int quadrant = 0; quadrant < 4; ++quadrant) grow(id.child(quadrant));
  };
  for (int y = -1; y < 2; ++y)
    for (int x = -1; x < 2; ++x) grow({6, x, y});
  return leaves;
}

struct Square {
  double x0, y0, x1, y1;
};
Square square_of(const TileId& id) {
  const double side = 256.0 * std::pow(2.0, id.level);
  return {id.x * side, id.y * side, (id.x + 1) * side, (id.y + 1) * side};
}
/// Whether two tiles share more than a point of a side, and which side of `a` it is.
int shared_side(const TileId& a, const TileId& b) {
  const Square p = square_of(a);
  const Square q = square_of(b);
  const bool beside_y = std::min(p.y1, q.y1) > std::max(p.y0, q.y0);
  const bool beside_x = std::min(p.x1, q.x1) > std::max(p.x0, q.x0);
  if (beside_y && p.x0 == q.x1) return kWest;
  if (beside_y && p.x1 == q.x0) return kEast;
  if (beside_x && p.y0 == q.y1) return kSouth;
  if (beside_x && p.y1 == q.y0) return kNorth;
  return 0;
}

TEST(Balance, NeighboursDifferByOneLevelAndNothingIsSplitWithoutNeed) {
  for (unsigned seed = 1; seed <= 8; ++seed) {
    const std::vector<TileId> leaves = random_leaves(seed);
    const std::vector<TileId> balanced = balance(leaves);
    EXPECT_TRUE(std::is_sorted(balanced.begin(), balanced.end()));
    double area = 0.0;
    for (const TileId& a : balanced) {
      area += a.side_m() * a.side_m();
      // Each is a leaf or part of one, so that nothing is coarser than asked.
      EXPECT_TRUE(std::any_of(leaves.begin(), leaves.end(),
                              [&](const TileId& leaf) { return leaf.contains(a); }));
      for (const TileId& b : balanced)
        if (shared_side(a, b) != 0) {
          EXPECT_LE(std::abs(a.level - b.level), 1) << a.name() << " and " << b.name();
        }
    }
    EXPECT_EQ(area, 9.0 * std::pow(256.0 * 64.0, 2));
    EXPECT_EQ(balance(balanced), balanced);
    // Minimal: a leaf that was split has, beside one of its parts, a tile two levels finer than
    // itself.
    const std::set<TileId> set(balanced.begin(), balanced.end());
    for (const TileId& leaf : leaves) {
      if (set.count(leaf) > 0) continue;
      EXPECT_TRUE(std::any_of(balanced.begin(), balanced.end(), [&](const TileId& other) {
        return !leaf.contains(other) && other.level <= leaf.level - 2 &&
               shared_side(leaf, other) != 0;
      })) << leaf.name();
    }
  }
}

TEST(Balance, MasksNameTheCoarserSides) {
  const std::vector<TileId> balanced = balance(random_leaves(3));
  const std::vector<CutTile> cut = with_coarser_sides(balanced);
  ASSERT_EQ(cut.size(), balanced.size());
  for (const CutTile& tile : cut) {
    int expected = 0;
    for (const TileId& other : balanced)
      if (other.level > tile.id.level) expected |= shared_side(tile.id, other);
    EXPECT_EQ(tile.coarser_sides, expected) << tile.id.name();
  }
}

TEST(WantsRefinement, ComparesACellWithPixelsAtTheNearestPointOfTheBox) {
  TileInfo tile{.id = {2, 0, 0}, .lowest_z_world = 0.0, .highest_z_world = 100.0};
  const DetailOptions options{.cell_px = 2.0, .finest_spacing_m = 1.0};
  const auto wants = [&](const Eigen::Vector3d& at) {
    const Viewpoint viewpoint{.position_world = at, .pixels_per_radian = 500.0};
    return wants_refinement(tile, {&viewpoint, 1}, options);
  };
  // 4 m span 2 px of 1/500 rad at 1000 m.
  EXPECT_TRUE(wants({512.0, 512.0, 1099.0}));
  EXPECT_FALSE(wants({512.0, 512.0, 1101.0}));
  EXPECT_TRUE(wants({-600.0, 512.0, 899.0}));  // 3-4-5: 999 m away
  EXPECT_FALSE(wants({-600.0, 512.0, 901.0}));
  EXPECT_TRUE(wants({512.0, 512.0, 50.0}));
  EXPECT_FALSE(wants_refinement(tile, {}, options));
  tile.id.level = 0;
  EXPECT_FALSE(wants({5.0, 5.0, 50.0}));
}

TEST(DetailOptions, SpacingIsAPowerOfTwo) {
  DetailOptions{.finest_spacing_m = 0.25}.validate();
  EXPECT_EQ(DetailOptions{.finest_spacing_m = 0.25}.finest_level(), -2);
  EXPECT_EQ(DetailOptions{.finest_spacing_m = 8.0}.finest_level(), 3);
  EXPECT_THROW(DetailOptions{.finest_spacing_m = 3.0}.validate(), core::Error);
}

TEST(Cut, RefinesNearTheCamerasAndCoversEverything) {
  const test::ScratchFolder folder;
  test::TinyWorldOptions options = test::mountain_options(3);
  const TileStore store = test::make_tiny_world(
      folder / "world", [](double x, double) { return 0.1 * x; }, options);
  const std::vector<Viewpoint> viewpoints = {
      {.position_world = {200.0, 100.0, 150.0}, .pixels_per_radian = 700.0},
      {.position_world = {-900.0, 100.0, 900.0}, .pixels_per_radian = 700.0}};
  const DetailOptions detail{.cell_px = 20.0, .finest_spacing_m = 1.0};
  const std::vector<CutTile> cut = choose_cut(store, viewpoints, detail);
  double area = 0.0;
  for (const CutTile& tile : cut) {
    ASSERT_NE(store.find(tile.id), nullptr);
    area += tile.id.side_m() * tile.id.side_m();
    bool has_children = true;
    for (int quadrant = 0; quadrant < 4; ++quadrant)
      has_children &= store.find(tile.id.child(quadrant)) != nullptr;
    EXPECT_FALSE(has_children && wants_refinement(*store.find(tile.id), viewpoints, detail))
        << tile.id.name();
  }
  EXPECT_EQ(area, 4.0 * 2048.0 * 2048.0);
  EXPECT_LT(cut.size(), finest_cut(store).size());
  // The whole sequence counts, in any order.
  const std::vector<Viewpoint> reversed(viewpoints.rbegin(), viewpoints.rend());
  EXPECT_EQ(choose_cut(store, reversed, detail), cut);
  EXPECT_EQ(choose_cut(store, {}, detail).size(), 4U);
}

TEST(MissingDetail, NamesATileThatIsWantedFinerThanItIsThere) {
  const test::ScratchFolder folder;
  const TileStore store = test::make_tiny_world(
      folder / "world", [](double x, double) { return 0.1 * x; }, test::mountain_options(3));
  const auto missing = [&](const DetailOptions& detail) {
    // 50 m above cells of 1 m near the origin, 16 m at the rim.
    const Viewpoint viewpoint{.position_world = {100.0, 100.0, 60.0}, .pixels_per_radian = 700.0};
    return missing_detail(store, {&viewpoint, 1}, detail);
  };
  EXPECT_FALSE(missing({.cell_px = 700.0, .finest_spacing_m = 1.0}));
  const auto tile = missing({.cell_px = 1.0, .finest_spacing_m = 0.5});
  ASSERT_TRUE(tile);
  EXPECT_NE(store.find(*tile), nullptr);
  EXPECT_EQ(store.find(tile->child(0)), nullptr);
}

/// The border of a stitched tile as world z at every half sample of its own spacing, by the true
/// (piecewise linear) edge.
double border_z(const Tile& tile, const std::vector<std::int32_t>& half_steps, int side,
                double at) {
  const double cells = at / tile.id.spacing_m();
  const int k = std::min(static_cast<int>(std::floor(cells)), kTileCells - 1);
  const auto z = [&](int n) {
    const int i = side == kWest ? 0 : side == kEast ? kTileCells : n;
    const int j = side == kSouth ? 0 : side == kNorth ? kTileCells : n;
    return tile.center_z_m + half_steps[Tile::sample(i, j)] * (kHeightStep_m / 2);
  };
  return z(k) + (z(k + 1) - z(k)) * (cells - k);
}

TEST(TileSeams, SharedBordersAreEqualBitForBitAcrossLevels) {
  const test::ScratchFolder folder;
  const TileStore store =
      test::make_tiny_world(folder / "world", test::mountain_height_m, test::mountain_options(3));
  const std::vector<CutTile> cut = finest_cut(store);
  struct Loaded {
    Tile tile;
    std::vector<std::int32_t> half_steps;
  };
  std::vector<Loaded> tiles;
  for (const CutTile& tile : cut) {
    Tile read = store.load(tile.id);
    tiles.push_back({read, stitched_half_steps(read, tile.coarser_sides)});
  }
  std::int64_t num_compared = 0;
  std::int64_t num_level_changes = 0;
  for (const Loaded& a : tiles) {
    for (const Loaded& b : tiles) {
      const int side = shared_side(a.tile.id, b.tile.id);
      if (side == 0 || a.tile.id.level > b.tile.id.level) continue;
      const int other = side == kWest    ? kEast
                        : side == kEast  ? kWest
                        : side == kSouth ? kNorth
                                         : kSouth;
      const bool runs_north = side == kWest || side == kEast;
      const double shift = runs_north ? square_of(a.tile.id).y0 - square_of(b.tile.id).y0
                                      : square_of(a.tile.id).x0 - square_of(b.tile.id).x0;
      num_level_changes += a.tile.id.level != b.tile.id.level ? 1 : 0;
      for (int k = 0; k <= kTileCells; ++k) {
        const double at = k * a.tile.id.spacing_m();
        EXPECT_EQ(border_z(a.tile, a.half_steps, side, at),
                  border_z(b.tile, b.half_steps, other, at + shift));
        ++num_compared;
      }
    }
  }
  EXPECT_GT(num_level_changes, 20);
  EXPECT_GT(num_compared, 10'000);
}

}  // namespace
}  // namespace terracast::world
