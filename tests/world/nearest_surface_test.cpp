#include "world/nearest_surface.h"

#include <gtest/gtest.h>

#include "core/random.h"
#include "tests/support/settled_world.h"
#include "tests/support/tiny_world.h"

namespace terracast::world {
namespace {

using Eigen::Vector3d;
using test::SettledWorld;

constexpr std::uint64_t kSeed = 34;

TEST(NearestSurface, IsTheNearestOfAllTriangles) {
  const SettledWorld settled;
  SurfaceFinder finder(settled.store(), settled.cut());
  constexpr double kReach_m = 12.0;
  int num_objects = 0, num_none = 0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    const auto draw = [&](double from, double to, std::uint64_t k) {
      return core::random_between(from, to, kSeed, 1, 3 * i + k);
    };
    const double x = draw(-170.0, 170.0, 0), y = draw(-170.0, 170.0, 1);
    const Vector3d point(x, y, SettledWorld::ground_m(x, y) + draw(-3.0, 22.0, 2));
    const double right_m = settled.brute_distance_m(point, kReach_m);
    const auto found = finder.find(point, kReach_m);
    ASSERT_EQ(found.has_value(), right_m < kReach_m) << point.transpose();
    num_none += found ? 0 : 1;
    if (!found) continue;
    EXPECT_NEAR(found->distance_m, right_m, 1e-9) << point.transpose();
    EXPECT_NEAR((found->place_world - point).norm(), right_m, 1e-8);
    num_objects += found->object ? 1 : 0;
  }
  EXPECT_GT(num_objects, 30);
  EXPECT_GT(num_none, 30);
}

TEST(NearestSurface, SaysWhatItBelongsTo) {
  const SettledWorld settled;
  SurfaceFinder finder(settled.store(), settled.cut());
  const double top_m = SettledWorld::ground_m(SettledWorld::kMastX_m, SettledWorld::kMastY_m) +
                       SettledWorld::kMastHeight_m;
  const auto mast =
      finder.find({SettledWorld::kMastX_m, SettledWorld::kMastY_m, top_m + 2.0}, 50.0);
  ASSERT_TRUE(mast && mast->object);
  EXPECT_EQ(mast->object->instance_id, 1U);
  EXPECT_NEAR(mast->distance_m, 2.0, 2e-3);  // heights are whole steps
  const auto ground = finder.find({400.0, 400.0, SettledWorld::ground_m(400.0, 400.0) + 1.0}, 5.0);
  ASSERT_TRUE(ground);
  EXPECT_FALSE(ground->object);
  EXPECT_FALSE(finder.find({0.0, 0.0, 5000.0}, 100.0));
  EXPECT_FALSE(finder.height_above_ground_m({1e6, 0.0, 0.0}));
  EXPECT_NEAR(*finder.height_above_ground_m({31.0, 77.0, SettledWorld::ground_m(31.0, 77.0) - 4.0}),
              -4.0, 1e-3);
}

TEST(NearestSurface, WaterCounts) {
  const test::ScratchFolder folder;
  const TileStore store = test::make_wet_world(
      folder / "world", [](double, double) { return 100.0; },
      [](double x, double) { return x > 0.0 ? 20.0 : 0.0; });
  SurfaceFinder finder(store, finest_cut(store));
  const auto water = finder.find({50.0, 3.0, 107.0}, 30.0);
  ASSERT_TRUE(water);
  EXPECT_NEAR(water->distance_m, 7.0, 1e-9);
  EXPECT_EQ(water->cover, Cover::Lake);
  EXPECT_EQ(finder.find({-50.0, 3.0, 107.0}, 30.0)->cover, Cover::Land);
}

TEST(NearestSurface, OnATriangleIsTheNearestOfManyOfItsPoints) {
  for (std::uint64_t i = 0; i < 300; ++i) {
    const auto draw = [&](std::uint64_t k) {
      return core::random_between(-1.0, 1.0, kSeed, 2, 16 * i + k);
    };
    const auto vector = [&](std::uint64_t k) {
      return Vector3d(draw(k), draw(k + 1), draw(k + 2));
    };
    std::array<Vector3d, 3> corners = {vector(0), vector(3), vector(6)};
    if (i % 5 == 1) corners[2] = corners[0] + 0.3 * (corners[1] - corners[0]);  // a line
    if (i % 5 == 2) corners[1] = corners[0];
    if (i % 5 == 3) corners[2] = corners[1] + 1e-7 * corners[2];  // a sliver
    const Vector3d point = 3.0 * vector(9);
    const Vector3d nearest = nearest_on_triangle(point, corners);
    double least_m = 1e9, from_triangle_m = 1e9;
    constexpr int kParts = 200;
    for (int a = 0; a <= kParts; ++a)
      for (int b = 0; a + b <= kParts; ++b) {
        const Vector3d place =
            corners[0] + (a * (corners[1] - corners[0]) + b * (corners[2] - corners[0])) / kParts;
        least_m = std::min(least_m, (place - point).norm());
        from_triangle_m = std::min(from_triangle_m, (place - nearest).norm());
      }
    EXPECT_LE((nearest - point).norm(), least_m + 1e-12) << i;
    EXPECT_LT(from_triangle_m, 0.02) << i;  // it is one of the triangle
  }
}

}  // namespace
}  // namespace terracast::world
