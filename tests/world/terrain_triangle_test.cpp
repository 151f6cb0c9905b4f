#include "world/terrain_triangle.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <set>

namespace terracast::world {
namespace {

/// Twice the area of a triangle of whole numbers, which is exact.
std::int64_t doubled_area(const std::array<std::int64_t, 2>& a,
                          const std::array<std::int64_t, 2>& b,
                          const std::array<std::int64_t, 2>& c) {
  return std::abs((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
}

/// All places of a lattice on both triangles of a cell, against the areas of what a place parts a triangle into.
TEST(TerrainTriangle, WeightsAreSharesOfAreaAndTheLargestIsTheNearest) {
  constexpr int kSteps = 64;  // of a cell's side; a power of two: doubles are exact
  constexpr int kColumn = 5;
  constexpr int kRow = 9;
  int num_ties = 0;
  for (const bool is_upper : {false, true}) {
    // The diagonal runs from the cell's south-east to its north-west.
    const std::array<int, 2> right_angle = is_upper ? std::array{1, 1} : std::array{0, 0};
    for (int y = 0; y <= kSteps; ++y)
      for (int x = 0; x <= kSteps; ++x) {
        if (is_upper ? x + y < kSteps : x + y > kSteps) continue;
        const TrianglePlace place =
            place_on_triangle(kColumn, kRow, is_upper, x / double(kSteps), y / double(kSteps));
        std::set<std::array<int, 2>> corners;
        std::array<std::array<std::int64_t, 2>, 3> at{};
        for (std::size_t k = 0; k < 3; ++k) {
          const auto& corner = place.corners[k];
          corners.insert({corner.i - kColumn, corner.j - kRow});
          at[k] = {std::int64_t{kSteps} * (corner.i - kColumn),
                   std::int64_t{kSteps} * (corner.j - kRow)};
          EXPECT_EQ(corner.sample(), Tile::sample(corner.i, corner.j));
        }
        ASSERT_EQ(corners, (std::set<std::array<int, 2>>{right_angle, {1, 0}, {0, 1}}));
        EXPECT_EQ(place.corners[0].i - kColumn, right_angle[0]);
        EXPECT_EQ(place.corners[0].j - kRow, right_angle[1]);
        EXPECT_EQ(place.corners[1].j, place.corners[0].j) << "along x";
        EXPECT_EQ(place.corners[2].i, place.corners[0].i) << "along y";
        const std::array<std::int64_t, 2> here = {x, y};
        std::array<std::int64_t, 3> shares{};
        for (std::size_t k = 0; k < 3; ++k) {
          shares[k] = doubled_area(here, at[(k + 1) % 3], at[(k + 2) % 3]);
          EXPECT_EQ(place.weights[k], static_cast<double>(shares[k]) / (kSteps * kSteps));
        }
        std::size_t largest = 0;
        for (std::size_t k = 1; k < 3; ++k) {
          if (shares[k] == shares[largest]) ++num_ties;
          if (shares[k] > shares[largest]) largest = k;
        }
        EXPECT_EQ(&place.nearest(), &place.corners[largest]) << x << " " << y << " " << is_upper;
      }
  }
  EXPECT_GT(num_ties, 100);
}

}  // namespace
}  // namespace terracast::world
