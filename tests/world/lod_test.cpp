#include "world/lod.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>

#include "core/error.h"
#include "core/random.h"
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

/// Of a plane of 40 m x 30 m, 100 m up, that looks down or aslant; with a fan of rays where it opens.
RaySheaf sheaf_of(double tilt_rad, double half_fan) {
  const Eigen::AngleAxisd turn(tilt_rad, Eigen::Vector3d::UnitX());
  std::array<Eigen::Vector3d, 4> starts, directions;
  constexpr double kCorners[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  for (std::size_t k = 0; k < 4; ++k) {
    const double x = kCorners[k][0], y = kCorners[k][1];
    starts[k] = Eigen::Vector3d(0.0, 0.0, 100.0) +
                turn * Eigen::Vector3d(half_fan > 0.0 ? 0.0 : 20.0 * x, -15.0 * y, 0.0);
    directions[k] = turn * Eigen::Vector3d(half_fan * x, 0.0, -1.0);
  }
  return {starts, directions, 2.0};
}

TEST(RaySheaf, MeetsWhatItsRaysMeet) {
  // Straight down it is a column: in closed form.
  const RaySheaf down = sheaf_of(0.0, 0.0);
  const auto box = [](double x, double y, double z, double side) {
    return geo::Box3d(Eigen::Vector3d(x, y, z), Eigen::Vector3d(x + side, y + side, z + side));
  };
  EXPECT_TRUE(down.meets(box(19.0, 14.0, -500.0, 10.0)));
  EXPECT_FALSE(down.meets(box(21.0, 0.0, -500.0, 10.0)));
  EXPECT_FALSE(down.meets(box(0.0, 16.0, -500.0, 10.0)));
  EXPECT_FALSE(down.meets(box(0.0, 0.0, 101.0, 10.0))) << "behind where rays start";
  EXPECT_TRUE(down.meets(box(-1000.0, -1000.0, -1000.0, 2000.0)));
  // A box that a ray meets is met; one that is not has no ray that passes it within its size.
  int num_met = 0, num_missed = 0;
  for (const auto& [tilt, fan] : {std::pair{0.0, 0.0}, {0.9, 0.0}, {0.4, 0.6}, {1.2, 1.5}}) {
    const RaySheaf sheaf = sheaf_of(tilt, fan);
    const Eigen::AngleAxisd turn(tilt, Eigen::Vector3d::UnitX());
    for (std::uint64_t i = 0; i < 3000; ++i) {
      const auto draw = [&](double low, double high, std::uint64_t k) {
        return core::random_between(low, high, 3, k, i);
      };
      const geo::Box3d there =
          box(draw(-400, 400, 1), draw(-400, 400, 2), draw(-300, 150, 3), draw(1, 120, 4));
      // In the sheaf's own axes a place is met where it lies between its sides.
      const auto is_within = [&](const Eigen::Vector3d& place, double grown_m) {
        const Eigen::Vector3d own = turn.inverse() * (place - Eigen::Vector3d(0.0, 0.0, 100.0));
        const double half_x = fan > 0.0 ? -fan * own.z() : 20.0;
        return own.z() < grown_m && std::abs(own.y()) < 15.0 + grown_m &&
               std::abs(own.x()) < half_x + grown_m * (1.0 + fan);
      };
      bool is_met = false, is_nearly_met = false;
      constexpr int kParts = 12;
      const double cell_m = there.sizes().x() / kParts;
      for (int k = 0; k <= kParts; ++k)
        for (int m = 0; m <= kParts; ++m)
          for (int n = 0; n <= kParts; ++n) {
            const Eigen::Vector3d place = there.min() + cell_m * Eigen::Vector3d(k, m, n);
            is_met = is_met || is_within(place, -1e-9);
            is_nearly_met = is_nearly_met || is_within(place, 1.8 * cell_m);
          }
      if (is_met) {
        EXPECT_TRUE(sheaf.meets(there)) << i;
      }
      if (!is_nearly_met) {
        EXPECT_FALSE(sheaf.meets(there)) << i;
      }
      num_met += is_met ? 1 : 0;
      num_missed += is_nearly_met ? 0 : 1;
    }
  }
  EXPECT_GT(num_met, 500);
  EXPECT_GT(num_missed, 2000);
}

TEST(WantsRefinement, CountsPixelsAMetreAtAnyDistanceWhereRaysGo) {
  const Viewpoint viewpoint{
      .position_world = {0.0, 0.0, 100.0},
      .sheaf = std::make_shared<const RaySheaf>(sheaf_of(0.0, 0.0))};  // 2 px a metre
  const DetailOptions options{.cell_px = 4.0, .finest_spacing_m = 0.5};
  const auto wants = [&](int level, std::int32_t x, double z) {
    const TileInfo tile{.id = {level, x, 0}, .lowest_z_world = z, .highest_z_world = z + 1.0};
    return wants_refinement(tile, std::span(&viewpoint, 1), options);
  };
  // Cells of 4 m are 8 px, of 2 m 4: from near and from far.
  for (const double z : {50.0, -5000.0}) {
    EXPECT_TRUE(wants(2, 0, z));
    EXPECT_FALSE(wants(1, 0, z));
    EXPECT_FALSE(wants(2, 1, z)) << "no ray goes there";
  }
  EXPECT_FALSE(wants(2, 0, 200.0)) << "behind where rays start";
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
