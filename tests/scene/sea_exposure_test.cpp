#include "scene/water/sea_exposure.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "scene/ground/ground.h"
#include "tests/support/test_data.h"
#include "tests/support/tiny_world.h"

namespace terracast::scene {
namespace {

using Eigen::Vector2d;

/// The open sea west of a coast, and an estuary of 100 m that leads 4 km inland, to the east.
bool is_sea(double x_world, double y_world) {
  return x_world < -1500.0 || (std::abs(y_world) < 50.0 && x_world < 2500.0);
}

/// A world of that, whose samples are 256 m apart, and 16 m in its middle: those of 64 m, which
/// count, reach 32 km.
world::TileStore coast(const test::ScratchFolder& folder) {
  test::TinyWorldOptions options;
  options.coarsest_level = 8;
  options.finest_level = 4;
  options.refine = [](const world::TileId& id) {
    const Vector2d corner = id.corner_world();
    return corner.minCoeff() + id.side_m() >= 0.0 && corner.maxCoeff() <= 0.0;
  };
  options.cover = [](double x, double y) {
    return is_sea(x, y) ? world::Cover::Sea : world::Cover::Land;
  };
  return test::make_tiny_world(
      folder / "coast", [](double x, double y) { return is_sea(x, y) ? 0.0 : 5.0; }, options);
}

/// By counting samples, at a place of one.
double counted_share(const Vector2d& place, double spacing_m) {
  const double reach_m = std::floor(800.0 / spacing_m) * spacing_m;
  int num_sea = 0, num_known = 0;
  for (double y = place.y() - reach_m; y <= place.y() + reach_m; y += spacing_m)
    for (double x = place.x() - reach_m; x <= place.x() + reach_m; x += spacing_m) {
      ++num_known;
      num_sea += is_sea(x, y) ? 1 : 0;
    }
  return num_sea / static_cast<double>(num_known);
}

TEST(SeaExposure, IsTheShareOfSeaRoundAPlace) {
  const test::ScratchFolder folder;
  const world::TileStore store = coast(folder);
  const auto exposure = SeaExposure::of(store);
  EXPECT_EQ(exposure->spacing_m(), 64.0);
  for (const Vector2d& place : {Vector2d(-1536.0, 832.0), Vector2d(-1216.0, -384.0),
                                Vector2d(0.0, 0.0), Vector2d(-1984.0, 1600.0)})
    EXPECT_NEAR(exposure->sea_share(place), counted_share(place, 64.0), 1e-12) << place.transpose();
  // A quarter of the way from x = -1536, round which 13 of 25 columns are sea (-2304 … -1536), to
  // -1472, where 12 are.
  EXPECT_NEAR(exposure->sea_share({-1520.0, 2000.0}), 12.75 / 25.0, 1e-12);
  // A quarter of the way from y = 768, where the estuary's one row of samples is the last of 25, to
  // 832.
  EXPECT_NEAR(exposure->sea_share({5.0, 784.0}), 0.75 / 25.0, 1e-12);
  // At the border of what is known only that counts: all of it sea.
  EXPECT_EQ(exposure->sea_share({-32768.0, 0.0}), 1.0);
}

TEST(SeaExposure, CountsEverySecondSampleAndFewerWhereThereWouldBeTooMany) {
  const test::ScratchFolder folder;
  const world::TileStore store = coast(folder);
  // 1025 samples along a side; 513, 257 and 129 of every second, fourth and eighth.
  const auto all = SeaExposure::of(store, 1025 * 1025);
  EXPECT_EQ(all->content_hash(), SeaExposure::of(store)->content_hash());
  for (const auto& [max_nodes, spacing_m] :
       {std::pair(1025 * 1025 - 1, 128.0), std::pair(257 * 257, 256.0), std::pair(20000, 512.0)}) {
    const auto exposure = SeaExposure::of(store, max_nodes);
    EXPECT_EQ(exposure->spacing_m(), spacing_m);
    EXPECT_NE(exposure->content_hash(), all->content_hash());
    for (const Vector2d& place :
         {Vector2d(-1536.0, 1024.0), Vector2d(0.0, 0.0), Vector2d(-2048.0, -512.0)})
      EXPECT_NEAR(exposure->sea_share(place), counted_share(place, spacing_m), 1e-12)
          << spacing_m << ": " << place.transpose();
  }
}

TEST(SeaExposure, IsOnlyLookedForWhereThereIsASea) {
  const test::ScratchFolder folder;
  EXPECT_NE(climate_of(coast(folder), 1).exposure, nullptr);
  const world::TileStore dry =
      test::make_tiny_world(folder / "dry", [](double, double) { return 5.0; });
  EXPECT_EQ(climate_of(dry, 1).exposure, nullptr);
}

TEST(SeaExposure, SurfBelongsToTheOpenCoast) {
  const test::ScratchFolder folder;
  const world::TileStore store = coast(folder);
  const auto exposure = SeaExposure::of(store);
  for (const double y : {-1500.0, -900.0, 700.0, 1500.0}) {
    EXPECT_EQ(exposure->surf({-1490.0, y}), 1.0);
    EXPECT_EQ(exposure->surf({-3000.0, y}), 1.0);
  }
  // 100 of 1600 m; the sea itself counts up to 800 m from the mouth.
  for (const double x : {-600.0, 0.0, 1000.0, 2400.0}) EXPECT_EQ(exposure->surf({x, 45.0}), 0.0);
}

}  // namespace
}  // namespace terracast::scene
