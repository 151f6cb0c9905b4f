#include "tiler/buildings/settled_ground.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace terracast {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2i;
using tiler::Building;
using tiler::SettledGround;
using world::Cover;

/// Square houses every 32 m, in the middle of each cell of a square 1024 m wide about the origin.
std::vector<Building> houses(double side_m) {
  const int steps = static_cast<int>(std::lround(side_m / world::kHeightStep_m));
  std::vector<Building> all;
  for (int y = -496; y < 512; y += 32)
    for (int x = -496; x < 512; x += 32) {
      Building house;
      house.footprint.place_m = {x, y};
      house.footprint.rings = {{{0, 0}, {steps, 0}, {steps, steps}, {0, steps}}};
      all.push_back(house);
    }
  return all;
}

TEST(SettledGround, KnowsTheShareThatBuildingsCover) {
  // 13^2 / 32^2 and 20^2 / 32^2, exact: areas are whole square metres.
  const SettledGround loose(houses(13.0), 4096.0);
  const SettledGround close(houses(20.0), 4096.0);
  for (const Vector2d& place : {Vector2d(0, 0), Vector2d(371.3, -200.7), Vector2d(-128.0, 400.0)}) {
    EXPECT_NEAR(loose.share(place), 169.0 / 1024.0, 1e-12);
    EXPECT_EQ(loose.cover(place), Cover::Grass);
    EXPECT_NEAR(close.share(place), 400.0 / 1024.0, 1e-12);
    EXPECT_EQ(close.cover(place), Cover::BuiltUp);
  }
  // The window is 112 m to each side: beyond it, and a cell, there is nothing.
  EXPECT_EQ(loose.share({512.0 + 145.0, 0.0}), 0.0);
  EXPECT_EQ(loose.cover({512.0 + 145.0, 0.0}), std::nullopt);
  EXPECT_EQ(loose.cover({4000.0, 0.0}), std::nullopt);
  // On the edge half of it counts.
  EXPECT_NEAR(loose.share({512.0, 0.0}), 0.5 * 169.0 / 1024.0, 1e-12);
}

/// Built up is where the middles of cells have four and more of seven columns of houses about them, of which each
/// covers 400 / 1024 / 7: up to x = 464 (five; four are 0.223). Distances grow from there as x does.
TEST(SettledGround, IsATownsOwnWhereItLiesOpenBesideItAndAtItsShore) {
  const auto settled = [](double first_sea_x) {
    return SettledGround(houses(20.0), 4096.0,
                         [=](const Vector2d& place) { return place.x() > first_sea_x; });
  };
  const SettledGround inland = settled(4000.0);
  EXPECT_NE(inland.cover({464.0 + 159.9, 0.0}), std::nullopt);
  EXPECT_EQ(inland.cover({464.0 + 160.1, 0.0}), std::nullopt);
  EXPECT_NE(inland.cover({-464.0 - 159.9, 37.0}), std::nullopt);
  EXPECT_EQ(inland.cover({-464.0 - 160.1, 37.0}), std::nullopt);
  // Noise is as often above zero as below: half of it is gardens, within what a strip of 100 by 800 m, some 12 periods,
  // may differ by.
  int num = 0;
  int num_gardens = 0;
  for (double y = -400.0; y <= 400.0; y += 3.7)
    for (double x = 520.0; x <= 620.0; x += 3.3) {
      const auto cover = inland.cover({x, y});
      ASSERT_TRUE(cover == Cover::Shrubs || cover == Cover::BuiltUp) << x << " " << y;
      ++num;
      num_gardens += cover == Cover::Shrubs ? 1 : 0;
    }
  EXPECT_NEAR(num_gardens, 0.5 * num, 0.25 * num);
  // Of a country, which plans it, as before.
  EXPECT_EQ(SettledGround(houses(20.0), 4096.0).cover({600.0, 0.0}), Cover::Grass);

  // The sea begins with the cell whose middle is at x = 816.
  const SettledGround shore = settled(800.0);
  EXPECT_EQ(shore.cover({816.0 - 48.1, 0.0}), std::nullopt);
  EXPECT_EQ(shore.cover({816.0 - 47.9, 0.0}), Cover::BuiltUp);
  // At x = 976: its shore is farther from the town than a harbour's land, from 944 on.
  const SettledGround far = settled(970.0);
  EXPECT_EQ(far.cover({976.0 - 48.1, 0.0}), std::nullopt);
  EXPECT_EQ(far.cover({976.0 - 47.9, 0.0}), Cover::BuiltUp);
  EXPECT_EQ(far.cover({943.9, 0.0}), Cover::BuiltUp);
  EXPECT_EQ(far.cover({944.1, 0.0}), std::nullopt);

  // Houses that stand loosely make no town, and have no quays.
  const SettledGround loose(houses(13.0), 4096.0,
                            [](const Vector2d& place) { return place.x() > 600.0; });
  EXPECT_EQ(loose.cover({580.0, 0.0}), Cover::Grass);
  EXPECT_EQ(loose.cover({300.0, 0.0}), Cover::Grass);
}

TEST(SettledGround, DoesNotDependOnTheOrderOfBuildings) {
  std::vector<Building> all = houses(11.7);
  const SettledGround one(all, 2048.0);
  std::reverse(all.begin(), all.end());
  const SettledGround other(all, 2048.0);
  for (double x = -700.0; x < 700.0; x += 17.3)
    EXPECT_EQ(one.share({x, 0.31 * x}), other.share({x, 0.31 * x}));
  EXPECT_EQ(SettledGround().cover({0.0, 0.0}), std::nullopt);
}

}  // namespace
}  // namespace terracast
