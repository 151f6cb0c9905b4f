#include "validate/world_check/solid_contact.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/world_check/boxes.h"

/// Bottoms of boxes and discs, whose places and middles are known.
namespace terracast::world_check {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Longest way from points of a grid over the rectangle [0, x] x [0, y] to the nearest place.
double farthest_m(const Bottom& bottom, double x_m, double y_m) {
  double farthest = 0.0;
  for (int i = 0; i <= 60; ++i)
    for (int j = 0; j <= 60; ++j) {
      const Vector2d at(x_m * i / 60, y_m * j / 60);
      double nearest = 1e9;
      for (const Vector3d& place : bottom.places_world)
        nearest = std::min(nearest, (place.head<2>() - at).norm());
      farthest = std::max(farthest, nearest);
    }
  return farthest;
}

bool has_none_twice(const Bottom& bottom) {
  for (std::size_t i = 0; i < bottom.places_world.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if ((bottom.places_world[i] - bottom.places_world[k]).norm() < 1e-6) return false;
  return true;
}

TEST(SolidContact, BottomsBearAPlaceEachMetre) {
  const world::Shape shape = box({0, 0, 0}, {12, 9, 4});
  const Bottom bottom = bottom_of({.origin_steps = {0, 0, 5 * kSteps}, .shape = &shape}, 0.5);
  ASSERT_TRUE(bottom.middle_world);
  EXPECT_LT((*bottom.middle_world - Vector3d(6.0, 4.5, 5.0)).norm(), 1e-9);
  EXPECT_LE(farthest_m(bottom, 12.0, 9.0), 0.8);  // half a diagonal of a square metre, and rows end
  EXPECT_TRUE(has_none_twice(bottom));
  for (const Vector3d& corner : {Vector3d(0, 0, 5), {12, 0, 5}, {0, 9, 5}, {12, 9, 5}})
    EXPECT_EQ(std::count(bottom.places_world.begin(), bottom.places_world.end(), corner), 1);
  for (const Vector3d& place : bottom.places_world) EXPECT_EQ(place.z(), 5.0);
}

TEST(SolidContact, WideBottomsBearNoMoreThanAThousandPlaces) {
  const world::Shape shape = box({0, 0, 0}, {700, 500, 4});
  const Bottom bottom = bottom_of({.shape = &shape}, 0.5);
  EXPECT_LE(bottom.places_world.size(), 1000U);
  EXPECT_GT(bottom.places_world.size(), 500U);
  // A thousand of 350 000 m2 stand for 350 m2 each: 19 m apart.
  EXPECT_LE(farthest_m(bottom, 700.0, 500.0), 19.0);
  EXPECT_TRUE(has_none_twice(bottom));
}

TEST(SolidContact, BottomsOfThousandsOfFacesBearNoMoreEither) {
  // A fan of slivers below a disc of 30 m, up to a point that is no corner of the others.
  constexpr int kFaces = 4000;
  world::Shape shape;
  shape.vertices_steps.push_back({0, 0, 0});
  for (int k = 0; k < kFaces; ++k) {
    const double angle_rad = 2.0 * std::numbers::pi * k / kFaces;
    shape.vertices_steps.push_back(
        {static_cast<int>(std::lround(30.0 * kSteps * std::cos(angle_rad))),
         static_cast<int>(std::lround(30.0 * kSteps * std::sin(angle_rad))), 0});
    const auto next = static_cast<std::uint32_t>(k + 1 < kFaces ? k + 2 : 1);
    shape.triangles.push_back({.corners = {0, next, static_cast<std::uint32_t>(k + 1)}});
  }
  const Bottom bottom = bottom_of({.shape = &shape}, 0.5);
  EXPECT_LE(bottom.places_world.size(), 1000U);
  EXPECT_GT(bottom.places_world.size(), 500U);
  ASSERT_TRUE(bottom.middle_world);
  EXPECT_LT(bottom.middle_world->norm(), 1e-3);
}

TEST(SolidContact, WhatHasNoFaceThatLooksDownHasNoBottom) {
  world::Shape shape = box({0, 0, 0}, {12, 9, 4});
  for (world::Shape::Triangle& triangle : shape.triangles)
    std::swap(triangle.corners[0], triangle.corners[1]);
  // What looks down now is its top, 4 m above its lowest corners.
  const Bottom bottom = bottom_of({.shape = &shape}, 0.5);
  EXPECT_FALSE(bottom.middle_world);
  EXPECT_TRUE(bottom.places_world.empty());
}

}  // namespace
}  // namespace terracast::world_check
