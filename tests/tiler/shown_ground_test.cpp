#include "tiler/shown_ground.h"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "core/random.h"
#include "tests/tiler/raster_files.h"
#include "tiler/layer.h"
#include "tiler/tile_builder.h"

namespace terracast::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

TEST(ShownGround, IsTheTrianglesOfTiles) {
  tiler::WorldOptions options = world_of("fractal", 16384.0);
  options.elevation[0].relief_m = 800.0;
  const auto surface = prepare(options);
  const auto z_at = [&](const Vector2d& at) { return surface->sample(at.x(), at.y()).z_world; };
  for (const int level : {0, 2, 5}) {
    const world::Tile tile = build_tile(*surface, {level, level == 5 ? 0 : -2, level == 5 ? 0 : 1});
    for (std::uint64_t k = 0; k < 500; ++k) {
      const Vector2d at =
          tile.id.corner_world() +
          tile.id.side_m() * Vector2d(core::random_unit(7, k, 0), core::random_unit(7, k, 1));
      // The plane through the three samples of its triangle, in the tile.
      const Vector2d cell = (at - tile.id.corner_world()) / tile.id.spacing_m();
      const int i = static_cast<int>(cell.x());
      const int j = static_cast<int>(cell.y());
      const bool is_north_east = cell.x() - i > 1.0 - (cell.y() - j);
      Eigen::Matrix3d samples;
      Vector3d heights;
      const int corner = is_north_east ? 1 : 0;
      const int places[3][2] = {{i + 1, j}, {i, j + 1}, {i + corner, j + corner}};
      for (int row = 0; row < 3; ++row) {
        samples.row(row) << places[row][0], places[row][1], 1.0;
        heights[row] = tile.z_world(places[row][0], places[row][1]);
      }
      const Vector3d plane = samples.fullPivLu().solve(heights);
      // Tiles round to steps.
      EXPECT_NEAR(tiler::shown_z_world(z_at, at, level),
                  plane.dot(Vector3d(cell.x(), cell.y(), 1.0)), 0.51 * world::kHeightStep_m);
    }
  }
}

/// A cliff 10 m high: samples 8 m apart miss its edge by 4 m.
struct Cliff final : tiler::LayerSite {
  double ground_z_world(const Vector2d& place) const override {
    return place.x() < 4.0 ? 0.0 : 10.0;
  }
  world::Cover cover(const Vector2d& place) const override {
    return place.x() < 4.0 ? world::Cover::Lake : world::Cover::Land;
  }
  bool is_free(const Vector2d&, double) const override { return true; }
  bool has_walls_near(const Vector2d&, double) const override { return has_walls; }
  bool has_walls = false;
};

TEST(ShownGround, EndsWithTheLevelBeforeOneThatLacksIt) {
  Cliff cliff;
  cliff.has_walls = true;
  // 0.5 m beyond the edge samples of 4 m show all; of 8 m 4.4 m less, of 2.6 m that are allowed.
  EXPECT_EQ(last_level_with_ground(cliff, {4.5, 1.0}, 10.0, 0, 5), 2);
  EXPECT_EQ(last_level_with_ground(cliff, {4.5, 1.0}, 10.0, 0, 1), 1);
  EXPECT_EQ(last_level_with_ground(cliff, {4.5, 1.0}, 10.0, 3, 5), 2);
  // At 7 m 1.25 m less.
  EXPECT_EQ(last_level_with_ground(cliff, {7.0, 1.0}, 10.0, 0, 3), 3);
  // 0.6 m above the ground, of 0.5 m that samples 1 m apart allow.
  EXPECT_EQ(last_level_with_ground(cliff, {100.5, 1.0}, 10.6, 0, 5), -1);
  EXPECT_EQ(last_level_with_ground(cliff, {100.5, 1.0}, 10.6, 1, 5), 5);
  // Where there are no walls nothing is looked at.
  cliff.has_walls = false;
  EXPECT_EQ(last_level_with_ground(cliff, {4.5, 1.0}, 10.0, 0, 5), 5);
}

TEST(ShownGround, IsAmidWaterWhereAllFourSamplesAre) {
  const Cliff cliff;
  EXPECT_TRUE(is_amid_water(cliff, {-1.0, 1.0}, 2));
  EXPECT_FALSE(is_amid_water(cliff, {1.0, 1.0}, 2));  // it goes to 4 m
  EXPECT_TRUE(is_amid_water(cliff, {1.0, 1.0}, 1));
}

}  // namespace
}  // namespace terracast::test
