#include "tiler/sound_areas.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/random.h"

namespace terracast::test {
namespace {

using Eigen::Vector2d;
using tiler::PointsWorld;

const PointsWorld kSquare = {{0, 0}, {30, 0}, {30, 30}, {0, 30}};

TEST(SoundAreas, WhatIsSoundIsLeft) {
  EXPECT_FALSE(tiler::repaired_area({kSquare}));
  const PointsWorld hole = {{5, 5}, {5, 10}, {10, 10}, {10, 5}};
  EXPECT_FALSE(tiler::repaired_area({kSquare, hole}));
  EXPECT_NEAR(tiler::enclosed_m2({kSquare, hole}), 900.0 - 25.0, 1e-9);
}

TEST(SoundAreas, OfWhatCrossesItselfTheInsideIsLeft) {
  const PointsWorld bow_tie = {{0, 0}, {30, 30}, {30, 0}, {0, 30}};
  const auto halves = tiler::repaired_area({bow_tie});
  ASSERT_TRUE(halves);
  EXPECT_EQ(halves->size(), 2U);
  EXPECT_NEAR(tiler::enclosed_m2({bow_tie}), 450.0, 0.1);
  // Holes beside the outline and across it.
  EXPECT_NEAR(tiler::enclosed_m2({kSquare, {{50, 0}, {70, 0}, {70, 20}, {50, 20}}}), 900.0, 0.1);
  EXPECT_NEAR(tiler::enclosed_m2({kSquare, {{20, 10}, {45, 10}, {45, 20}, {20, 20}}}), 800.0, 0.1);
  // A ring that goes round twice over leaves nothing; one without a width neither.
  EXPECT_NEAR(tiler::enclosed_m2({{{0, 0}, {30, 0}, {30, 30}, {0, 0}, {30, 0}, {30, 30}}}), 0.0,
              0.1);
  EXPECT_EQ(tiler::enclosed_m2({{{0, 0}, {20, 10}, {40, 20}, {20, 10}}}), 0.0);
  // A hole that touches the outline in a corner stays.
  const PointsWorld island = {{30, 15}, {20, 20}, {20, 10}};
  EXPECT_NEAR(tiler::enclosed_m2({kSquare, island}), 850.0, 0.1);

  // The five points of a star round its pentagon, which is gone round twice: of circumradius 1 the star is
  // 1.12257 in all (10 tan(pi / 10) / (3 - tan^2(pi / 10))), its pentagon (5 / 2) r^2 sin(2 pi / 5) of r = 0.381966.
  PointsWorld star;
  for (int k = 0; k < 5; ++k) {
    const double turn = 4.0 * std::numbers::pi * k / 5.0;
    star.push_back(200.0 * Vector2d(std::cos(turn), std::sin(turn)) + Vector2d(12000.0, -7000.0));
  }
  const double t = std::tan(std::numbers::pi / 10.0);
  const double r = (3.0 - std::sqrt(5.0)) / 2.0;
  const double points =
      10.0 * t / (3.0 - t * t) - 2.5 * r * r * std::sin(2.0 * std::numbers::pi / 5.0);
  const auto parts = tiler::repaired_area({star});
  ASSERT_TRUE(parts);
  EXPECT_EQ(parts->size(), 5U);
  // Corners are rounded to a thousandth: of outlines of 2 km in all that is 1 m2.
  EXPECT_NEAR(tiler::enclosed_m2({star}), 200.0 * 200.0 * points, 1.0);
}

TEST(SoundAreas, CornersThatCrowdAreThinned) {
  PointsWorld circle;
  for (int i = 0; i < 1'000'000; ++i) {
    const double turn = 2.0 * std::numbers::pi * i / 1e6;
    circle.emplace_back((40.0 + 0.1 * (i % 2)) * Vector2d(std::cos(turn), std::sin(turn)));
  }
  const PointsWorld thinned = tiler::without_crowded_corners(circle);
  EXPECT_LT(thinned.size(), 1100U);
  EXPECT_NEAR(tiler::enclosed_m2({thinned}), std::numbers::pi * 40.05 * 40.05,
              0.3 * 2.0 * std::numbers::pi * 40.0);
  // A long shore of as many corners is left.
  PointsWorld shore;
  for (int i = 0; i < 100'000; ++i) {
    const double turn = 2.0 * std::numbers::pi * i / 1e5;
    shore.emplace_back(9000.0 * Vector2d(std::cos(turn), std::sin(turn)));
  }
  EXPECT_EQ(tiler::without_crowded_corners(shore).size(), shore.size());
}

}  // namespace
}  // namespace terracast::test
