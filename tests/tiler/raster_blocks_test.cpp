#include "tiler/buildings/raster_blocks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "core/random.h"
#include "tiler/buildings/block_outlines.h"
#include "tiler/buildings/straight_path.h"

/// Pieces of drawn grids, and straight walls round shapes whose corners and areas are known.
namespace terracast::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2i;
using tiler::BlockRules;
using tiler::find_blocks;
using tiler::Grid;
using tiler::RasterBlocks;

/// A letter a cell: a to z are 3, 6, 9, … m high; ? is unknown, . is ground.
Grid<float> grid_of(const std::vector<std::string>& rows) {
  Grid<float> grid(static_cast<int>(rows.front().size()), static_cast<int>(rows.size()));
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i) {
      const char c = rows[static_cast<std::size_t>(j)][static_cast<std::size_t>(i)];
      grid(i, j) = c == '?'   ? std::numeric_limits<float>::quiet_NaN()
                   : c == '.' ? 0.0F
                              : 3.0F * static_cast<float>(c - 'a' + 1);
    }
  return grid;
}

std::vector<std::string> pieces_of(const RasterBlocks& blocks) {
  std::vector<std::string> rows;
  for (int j = 0; j < blocks.piece.height; ++j) {
    rows.emplace_back();
    for (int i = 0; i < blocks.piece.width; ++i)
      rows.back() += blocks.piece(i, j) == 0 ? '.' : static_cast<char>('0' + blocks.piece(i, j));
  }
  return rows;
}

TEST(RasterBlocks, ATerraceIsCutWhereItsHeightsStepAndItsRimGoesToTheHousesBesideIt) {
  // Houses of 12 and 18 m with half-covered cells of 9 and 15 m beside and between them, and a tower on a hall.
  const Grid<float> heights = grid_of({"..............",  //
                                       ".cccceffff....",  //
                                       ".ddddefffe.bbb",  //
                                       ".ddddefffe.bbb",  //
                                       "..........?bjj",  //
                                       "...........bjj"});
  const RasterBlocks blocks = find_blocks(heights, {.least_cells = 4, .height_class_m = 2.0});
  EXPECT_EQ(pieces_of(blocks),
            (std::vector<std::string>{"..............",  //
                                      ".111122222....",  //
                                      ".111122222.333",  //
                                      ".111122222.333",  //
                                      "...........344",  //
                                      "...........344"}));
  ASSERT_EQ(blocks.pieces.size(), 4U);
  // Of the cells of a class alone: those of the rim are half on the ground.
  EXPECT_EQ(blocks.pieces[0].median_m, 12.0);
  EXPECT_EQ(blocks.pieces[1].median_m, 18.0);
  EXPECT_EQ(blocks.pieces[2].median_m, 6.0);
  EXPECT_EQ(blocks.pieces[3].median_m, 30.0);
  EXPECT_EQ(blocks.pieces[0].first_column, 1);
  EXPECT_EQ(blocks.pieces[0].first_row, 1);
  EXPECT_EQ(blocks.pieces[3].first_column, 12);
  EXPECT_EQ(blocks.pieces[3].first_row, 4);
  EXPECT_EQ(blocks.num_blocks, 2);
  // A class that holds both makes one house of them.
  EXPECT_EQ(find_blocks(heights, {.least_cells = 4, .height_class_m = 40.0}).pieces.size(), 2U);
}

TEST(RasterBlocks, SpecksAreLeftOutAndThinBlocksAreKeptWhole) {
  const RasterBlocks blocks = find_blocks(grid_of({"aa..b.........",  //
                                                   "a....bb.......",  //
                                                   "..............",  //
                                                   "...cdcecdcfc..",  //
                                                   ".............a"}),
                                          {.least_cells = 4, .height_class_m = 2.0});
  // Cells that meet at a corner are not of one block; nothing of the last but one row is two cells wide.
  EXPECT_EQ(blocks.num_specks, 4);
  EXPECT_EQ(blocks.num_speck_cells, 3 + 1 + 2 + 1);
  EXPECT_EQ(blocks.num_blocks, 1);
  ASSERT_EQ(blocks.pieces.size(), 1U);
  EXPECT_EQ(blocks.pieces[0].num_cells, 9);
  EXPECT_EQ(blocks.pieces[0].first_column, 3);
}

/// Every cell that is high enough lies in a block that is large enough, by a search of its own, and all cells of a
/// class that make a piece lie as near to each other as it says.
TEST(RasterBlocks, HoldAllThatStandsHighInNoise) {
  constexpr int kSide = 160;
  Grid<float> heights(kSide, kSide);
  for (std::size_t k = 0; k < heights.values.size(); ++k)
    heights.values[k] = static_cast<float>(6.0 * core::random_unit(5, 1, k));
  const BlockRules rules{.least_height_m = 2.5, .least_cells = 6, .height_class_m = 1.5};
  const RasterBlocks blocks = find_blocks(heights, rules);
  std::vector<int> seen(heights.values.size(), 0);
  std::int64_t num_specks = 0;
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i) {
      if (heights(i, j) < 2.5F) {
        EXPECT_EQ(blocks.piece(i, j), 0);
        continue;
      }
      if (seen[heights.index(i, j)] != 0) continue;
      std::vector<Vector2i> cells = {{i, j}};
      seen[heights.index(i, j)] = 1;
      for (std::size_t k = 0; k < cells.size(); ++k)
        for (const Vector2i& step :
             {Vector2i(1, 0), Vector2i(-1, 0), Vector2i(0, 1), Vector2i(0, -1)}) {
          const Vector2i at = cells[k] + step;
          if (!heights.contains(at.x(), at.y()) || heights(at.x(), at.y()) < 2.5F ||
              seen[heights.index(at.x(), at.y())] != 0)
            continue;
          seen[heights.index(at.x(), at.y())] = 1;
          cells.push_back(at);
        }
      num_specks += cells.size() < 6 ? 1 : 0;
      for (const Vector2i& at : cells)
        EXPECT_EQ(blocks.piece(at.x(), at.y()) > 0, cells.size() >= 6) << at.transpose();
    }
  EXPECT_GT(num_specks, 50);
  EXPECT_EQ(blocks.num_specks, num_specks);
}

/// The cells whose middles lie in a rectangle turned by an angle.
Grid<std::int32_t> turned_rectangle(int side, const Vector2d& middle, double length, double width,
                                    double angle_rad) {
  Grid<std::int32_t> cells(side, side, 0);
  const Vector2d along(std::cos(angle_rad), std::sin(angle_rad));
  const Vector2d across(-along.y(), along.x());
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      const Vector2d from = Vector2d(i + 0.5, j + 0.5) - middle;
      cells(i, j) =
          std::abs(along.dot(from)) < 0.5 * length && std::abs(across.dot(from)) < 0.5 * width ? 1
                                                                                               : 0;
    }
  return cells;
}

double area_of(const std::vector<Vector2d>& ring) {
  double sum = 0.0;
  for (std::size_t k = 0; k < ring.size(); ++k) {
    const Vector2d& a = ring[k];
    const Vector2d& b = ring[(k + 1) % ring.size()];
    sum += a.x() * b.y() - a.y() * b.x();
  }
  return 0.5 * std::abs(sum);
}

TEST(StraightWalls, OfRectanglesHaveTheirFourCornersAtAnyAngle) {
  constexpr double kLength = 40.0;
  constexpr double kWidth = 14.0;
  for (int k = 0; k < 40; ++k) {
    const double angle = std::numbers::pi * k / 40.0;
    SCOPED_TRACE(angle);
    const Vector2d middle(32.3 + 0.37 * std::fmod(7.0 * k, 5.0), 32.1);
    const auto outlines =
        tiler::outlines_of(turned_rectangle(66, middle, kLength, kWidth, angle), 1, 0.9);
    ASSERT_EQ(outlines.size(), 1U);
    ASSERT_EQ(outlines[0].size(), 1U);
    const std::vector<Vector2d>& ring = outlines[0][0];
    EXPECT_EQ(ring.size(), 4U);
    // Walls are known to half a cell at most; lines through many steps are better.
    EXPECT_NEAR(area_of(ring), kLength * kWidth, 0.02 * kLength * kWidth);
    const Vector2d along(std::cos(angle), std::sin(angle));
    const Vector2d across(-along.y(), along.x());
    for (const Vector2d& at : ring) {
      EXPECT_NEAR(std::abs(along.dot(at - middle)), 0.5 * kLength, 0.75);
      EXPECT_NEAR(std::abs(across.dot(at - middle)), 0.5 * kWidth, 0.75);
    }
  }
}

TEST(StraightWalls, AlongTheCellsAreExact) {
  Grid<std::int32_t> cells(20, 16, 0);
  for (int j = 2; j < 12; ++j)
    for (int i = 3; i < (j < 6 ? 17 : 9); ++i) cells(i, j) = 1;
  for (int j = 8; j < 10; ++j)
    for (int i = 5; i < 7; ++i) cells(i, j) = 0;  // a yard
  const auto outlines = tiler::outlines_of(cells, 1, 0.9);
  ASSERT_EQ(outlines[0].size(), 2U);
  EXPECT_EQ(outlines[0][0].size(), 6U);
  EXPECT_EQ(outlines[0][1].size(), 4U);
  EXPECT_NEAR(area_of(outlines[0][0]), 4 * 14 + 6 * 6, 1e-9);
  EXPECT_NEAR(area_of(outlines[0][1]), 4.0, 1e-9);
}

/// Five houses in a row at an angle: their fronts are one straight line, and each wall between two is the same for both.
TEST(StraightWalls, BetweenHousesAreSharedAndTheirFrontsAreOneLine) {
  constexpr double kAngle = 0.42;
  Grid<std::int32_t> cells = turned_rectangle(90, {45.0, 45.0}, 75.0, 12.0, kAngle);
  const Vector2d along(std::cos(kAngle), std::sin(kAngle));
  for (int j = 0; j < 90; ++j)
    for (int i = 0; i < 90; ++i)
      if (cells(i, j) != 0)
        cells(i, j) =
            1 +
            static_cast<int>(std::floor(
                (along.dot(Vector2d(i, j) + Vector2d(0.5, 0.5) - Vector2d(45, 45)) + 37.5) / 15.0));
  const auto outlines = tiler::outlines_of(cells, 5, 0.9);
  ASSERT_EQ(outlines.size(), 5U);
  const Vector2d across(-along.y(), along.x());
  double sum = 0.0;
  int num_shared = 0;
  for (std::size_t k = 0; k < 5; ++k) {
    ASSERT_EQ(outlines[k].size(), 1U);
    sum += area_of(outlines[k][0]);
    EXPECT_NEAR(area_of(outlines[k][0]), 15.0 * 12.0, 0.06 * 180.0);
    for (const Vector2d& at : outlines[k][0]) {
      // Corners on the fronts do not leave the line by more than lines through steps err.
      const double off = std::abs(std::abs(across.dot(at - Vector2d(45, 45))) - 6.0);
      EXPECT_LT(std::min(off, std::abs(across.dot(at - Vector2d(45, 45)))), 1.0);
      if (k > 0)
        for (const Vector2d& other : outlines[k - 1][0]) num_shared += other == at ? 1 : 0;
    }
  }
  EXPECT_NEAR(sum, 75.0 * 12.0, 0.02 * 900.0);
  EXPECT_GE(num_shared, 8);  // two ends of each of four walls, to the last bit
}

/// Whatever the shape: all of a grid is in one outline or none, so that areas add up to the cells'.
TEST(StraightWalls, OfNoiseEndAndKeepMostOfItsArea) {
  Grid<float> heights(200, 200);
  for (std::size_t k = 0; k < heights.values.size(); ++k)
    heights.values[k] = static_cast<float>(5.0 * core::random_unit(9, 2, k));
  const RasterBlocks blocks = find_blocks(heights, {.least_height_m = 2.0, .least_cells = 4});
  const auto outlines =
      tiler::outlines_of(blocks.piece, static_cast<std::int32_t>(blocks.pieces.size()), 0.9);
  ASSERT_EQ(outlines.size(), blocks.pieces.size());
  for (const auto& rings : outlines)
    for (const auto& ring : rings)
      for (const Vector2d& at : ring) {
        EXPECT_TRUE(at.allFinite());
        EXPECT_GE(at.minCoeff(), -1.5);
        EXPECT_LE(at.maxCoeff(), 201.5);
      }
}

}  // namespace
}  // namespace terracast::test
