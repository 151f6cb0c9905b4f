#include "tiler/buildings/known_cells.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/random.h"

/// Boxes of cells, painted on a grid of the test's own.
namespace terracast::test {
namespace {

using tiler::boxes_of_known;
using tiler::CellBox;
using tiler::Grid;

Grid<float> noise(int width, int height, double share_known) {
  Grid<float> heights(width, height, std::numeric_limits<float>::quiet_NaN());
  for (std::size_t k = 0; k < heights.values.size(); ++k)
    if (core::random_unit(7, 3, k) < share_known) heights.values[k] = 3.0F;
  return heights;
}

/// How often each cell is in a box.
Grid<int> painted(const std::vector<CellBox>& boxes, int width, int height) {
  Grid<int> num(width, height, 0);
  for (const CellBox& box : boxes) {
    EXPECT_LE(box.end_column - box.first_column, tiler::kMostBoxCells);
    EXPECT_LE(box.end_row - box.first_row, tiler::kMostBoxCells);
    for (int j = box.first_row; j < box.end_row; ++j)
      for (int i = box.first_column; i < box.end_column; ++i) {
        if (!num.contains(i, j)) {
          ADD_FAILURE() << "cell " << i << " " << j << " is none";
          return num;
        }
        ++num(i, j);
      }
  }
  return num;
}

TEST(KnownCells, EachIsInOneBoxAndNoOtherIsInAny) {
  for (const double share : {0.0, 0.02, 0.5, 0.98, 1.0}) {
    SCOPED_TRACE(share);
    const Grid<float> heights = noise(301, 190, share);
    const Grid<int> num = painted(boxes_of_known(heights, 1'000'000), 301, 190);
    for (std::size_t k = 0; k < num.values.size(); ++k)
      ASSERT_EQ(num.values[k], std::isnan(heights.values[k]) ? 0 : 1) << k;
  }
  // 5 by 3 boxes of 64 cells and less.
  EXPECT_EQ(boxes_of_known(noise(301, 190, 1.0), 15).size(), 15U);
}

TEST(KnownCells, OfASlitAndAYardAreFew) {
  Grid<float> heights(60, 40, 3.0F);
  for (int i = 10; i < 20; ++i) heights(i, 30) = std::numeric_limits<float>::quiet_NaN();
  for (int j = 5; j < 25; ++j)
    for (int i = 40; i < 50; ++i) heights(i, j) = std::numeric_limits<float>::quiet_NaN();
  // Above, left and right of the yard, between, left and right of the slit, below.
  EXPECT_EQ(boxes_of_known(heights, 100).size(), 7U);
}

/// The squares whose cells are all known, by a search of the test's own.
TEST(KnownCells, ThatAreTooScatteredAreTakenInSquaresOfWhichAllCellsAreKnown) {
  const Grid<float> heights = noise(203, 150, 0.97);
  const std::size_t num_exact = boxes_of_known(heights, 1'000'000).size();
  std::size_t num_before = num_exact;
  for (const int side : {2, 4, 8}) {
    SCOPED_TRACE(side);
    // One less than the finer squares take.
    const std::vector<CellBox> boxes = boxes_of_known(heights, num_before - 1);
    ASSERT_LT(boxes.size(), num_before);
    const Grid<int> num = painted(boxes, 203, 150);
    for (int j = 0; j < 150; ++j)
      for (int i = 0; i < 203; ++i) {
        bool is_known = true;
        for (int v = j / side * side; v < std::min(j / side * side + side, 150); ++v)
          for (int u = i / side * side; u < std::min(i / side * side + side, 203); ++u)
            is_known = is_known && !std::isnan(heights(u, v));
        ASSERT_EQ(num(i, j), is_known ? 1 : 0) << i << " " << j;
      }
    num_before = boxes.size();
  }
  EXPECT_TRUE(boxes_of_known(noise(200, 200, 1.0), 3).empty());
}

}  // namespace
}  // namespace terracast::test
