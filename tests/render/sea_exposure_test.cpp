#include "render/sea_exposure.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/test_data.h"
#include "tests/support/tiny_world.h"

namespace terracast::render {
namespace {

using Eigen::Vector2d;

/// The open sea west of a coast, and an estuary of 100 m that leads 4 km inland, to the east.
bool is_sea(double x_world, double y_world) {
  return x_world < -1500.0 || (std::abs(y_world) < 50.0 && x_world < 2500.0);
}

/// A world of that, 8 km wide, of samples 16 m apart.
world::TileStore coast(const test::ScratchFolder& folder) {
  test::TinyWorldOptions options;
  options.coarsest_level = 4;
  options.finest_level = 4;
  options.cover = [](double x, double y) {
    return is_sea(x, y) ? world::Cover::Sea : world::Cover::Land;
  };
  return test::make_tiny_world(
      folder / "coast", [](double x, double y) { return is_sea(x, y) ? 0.0 : 5.0; }, options);
}

TEST(SeaExposure, IsTheShareOfSeaRoundAPlace) {
  const test::ScratchFolder folder;
  const world::TileStore store = coast(folder);
  const auto exposure = SeaExposure::of(store);
  // By counting samples, at places of samples.
  for (const Vector2d& place : {Vector2d(-1504.0, 800.0), Vector2d(-1200.0, -400.0),
                                Vector2d(0.0, 0.0), Vector2d(-2000.0, 1600.0)}) {
    int num_sea = 0, num_known = 0;
    for (double y = place.y() - 800.0; y <= place.y() + 800.0; y += 16.0)
      for (double x = place.x() - 800.0; x <= place.x() + 800.0; x += 16.0) {
        ++num_known;
        num_sea += is_sea(x, y) ? 1 : 0;
      }
    EXPECT_NEAR(exposure->sea_share(place), num_sea / static_cast<double>(num_known), 1e-12)
        << place.transpose();
  }
  // At the world's border only what is known counts: all of it sea.
  EXPECT_EQ(exposure->sea_share({-4000.0, 0.0}), 1.0);
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
}  // namespace terracast::render
