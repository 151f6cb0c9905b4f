#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <set>

#include "core/random.h"
#include "tiler/vegetation/blue_noise.h"
#include "tiler/vegetation/crop_rows.h"
#include "tiler/vegetation/fields.h"
#include "world/tile_id.h"

namespace terracast::test {
namespace {

using Eigen::Vector2d;
using tiler::BlueNoise;

/// Distances to the nearest other place, by trying all.
double least_distance_m(const std::vector<BlueNoise::Place>& places) {
  double least2 = 1e300;
  for (std::size_t i = 0; i < places.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      least2 = std::min(least2, (places[i].at_world - places[j].at_world).squaredNorm());
  return std::sqrt(least2);
}

TEST(BlueNoise, NoTwoPlacesAreNearerThanTheLeastDistance) {
  for (const double cell_m : {2.5, 5.0}) {
    const BlueNoise noise(1234, 5, cell_m);
    EXPECT_DOUBLE_EQ(noise.least_distance_m(), 1.4 * cell_m);
    // Across the origin, where cells count from below 0, and far from it.
    for (const Vector2d& corner : {Vector2d(-60.0, -75.0), Vector2d(24000.0, -25100.0)}) {
      const auto places = noise.places_in(corner, corner + Vector2d::Constant(40.0 * cell_m));
      ASSERT_GT(places.size(), 400U);
      EXPECT_GE(least_distance_m(places), noise.least_distance_m());
    }
  }
}

TEST(BlueNoise, ThereAreNoWideGaps) {
  const BlueNoise noise(99, 0, 2.5);
  const auto places = noise.places_in({0.0, 0.0}, {250.0, 250.0});
  // Random sequential addition of discs stops at a density of 0.547 (Feder 1980), that is 0.696 places in a
  // square of the least distance; cells that give up after four misses come near to it.
  const double density = static_cast<double>(places.size()) / (250.0 * 250.0) *
                         noise.least_distance_m() * noise.least_distance_m();
  EXPECT_GT(density, 0.57);
  EXPECT_LT(density, 0.72);
  // From any spot a place is near.
  double widest_m = 0.0;
  for (std::uint64_t i = 0; i < 3000; ++i) {
    const Vector2d spot(core::random_between(20.0, 230.0, 7, 0, i),
                        core::random_between(20.0, 230.0, 7, 1, i));
    double least_m = 1e300;
    for (const BlueNoise::Place& place : places)
      least_m = std::min(least_m, (place.at_world - spot).norm());
    widest_m = std::max(widest_m, least_m);
  }
  EXPECT_LT(widest_m, 1.6 * noise.least_distance_m());
}

TEST(BlueNoise, PairsAreAsInPoissonDiscSets) {
  const BlueNoise noise(5, 3, 2.5);
  constexpr double kSide_m = 300.0;
  constexpr double kRim_m = 30.0;
  const auto places = noise.places_in({0.0, 0.0}, {kSide_m, kSide_m});
  const double d = noise.least_distance_m();
  // Pair correlation: pairs by distance, relative to places thrown at random.
  constexpr int kBins = 32;
  std::vector<double> pairs(kBins, 0.0);
  int num_inner = 0;
  for (const BlueNoise::Place& place : places) {
    if ((place.at_world.array() < kRim_m).any() ||
        (place.at_world.array() > kSide_m - kRim_m).any())
      continue;
    ++num_inner;
    for (const BlueNoise::Place& other : places) {
      const double r = (place.at_world - other.at_world).norm() / d;
      if (r > 0.0 && r < 4.0) pairs[static_cast<std::size_t>(r * kBins / 4.0)] += 1.0;
    }
  }
  const double per_m2 = static_cast<double>(places.size()) / (kSide_m * kSide_m);
  for (int i = 0; i < kBins; ++i) {
    const double inner = i * 4.0 / kBins * d;
    const double outer = (i + 1) * 4.0 / kBins * d;
    const double expected = num_inner * per_m2 * std::numbers::pi * (outer * outer - inner * inner);
    const double correlation = pairs[static_cast<std::size_t>(i)] / expected;
    SCOPED_TRACE(inner / d);
    if (outer <= d) {
      EXPECT_EQ(correlation, 0.0);
    }
    // Neighbours crowd at the least distance. Behind them a faint second ring, then nothing is left of
    // any order; a lattice shows as rings that do not fade. Some 3 000 places: bins are good to 2 %.
    if (inner == d) {
      EXPECT_GT(correlation, 1.3);
    }
    if (inner >= 1.75 * d) {
      EXPECT_NEAR(correlation, 1.0, inner < 2.5 * d ? 0.17 : 0.06);
    }
  }
}

TEST(BlueNoise, TheSpectrumLacksLowFrequencies) {
  const BlueNoise noise(17, 1, 2.5);
  constexpr double kSide_m = 320.0;
  const double d = noise.least_distance_m();
  // Power at waves that fit into the window, averaged over rings; white noise has 1 everywhere.
  const auto power = [&](double lowest, double highest) {
    const auto places = noise.places_in({-1000.0, 400.0}, {-1000.0 + kSide_m, 400.0 + kSide_m});
    double sum = 0.0;
    int num_waves = 0;
    constexpr int kMost = 110;
    for (int v = 0; v <= kMost; v += 2)
      for (int u = -kMost; u <= kMost; u += 2) {
        const double frequency = std::hypot(u, v) / kSide_m * d;
        if (frequency < lowest || frequency >= highest || (v == 0 && u <= 0)) continue;
        std::complex<double> wave = 0.0;
        for (const BlueNoise::Place& place : places)
          wave += std::polar(1.0, -2.0 * std::numbers::pi / kSide_m *
                                      (u * place.at_world.x() + v * place.at_world.y()));
        sum += std::norm(wave) / static_cast<double>(places.size());
        ++num_waves;
      }
    return sum / num_waves;
  };
  // Cycles in a least distance. Saturated random addition has 0.06 at the lowest (Torquato 2006).
  EXPECT_LT(power(0.05, 0.25), 0.13);
  EXPECT_LT(power(0.25, 0.5), 0.3);
  EXPECT_GT(power(0.8, 1.1), 1.1);
}

TEST(BlueNoise, AnyWindowHoldsTheSamePlaces) {
  const BlueNoise noise(42, 2, 2.5);
  const auto all = noise.places_in({-64.0, -64.0}, {64.0, 64.0});
  const auto is_less = [](const BlueNoise::Place& a, const BlueNoise::Place& b) {
    return std::pair(a.cell_y, a.cell_x) < std::pair(b.cell_y, b.cell_x);
  };
  std::set<BlueNoise::Place, decltype(is_less)> pieced(is_less);
  std::size_t num_pieces = 0;
  // Windows of all kinds of sides, in an order of their own.
  for (int k = 0; k < 64; ++k) {
    const int row = (k * 37) % 64;
    const Vector2d corner(-64.0 + 16.0 * (row % 8), -64.0 + 16.0 * (row / 8));
    for (const BlueNoise::Place& place : noise.places_in(corner, corner + Vector2d(16.0, 16.0))) {
      EXPECT_TRUE(pieced.insert(place).second);
      ++num_pieces;
    }
  }
  ASSERT_EQ(num_pieces, all.size());
  auto piece = pieced.begin();
  std::vector<BlueNoise::Place> sorted = all;
  std::sort(sorted.begin(), sorted.end(), is_less);
  for (const BlueNoise::Place& place : sorted) {
    EXPECT_EQ(place.at_world, piece->at_world);
    EXPECT_EQ(std::floor(place.at_world.x() / 2.5), place.cell_x);
    EXPECT_EQ(std::floor(place.at_world.y() / 2.5), place.cell_y);
    ++piece;
  }
  EXPECT_NE(noise.places_in({0.0, 0.0}, {20.0, 20.0}).front().at_world,
            BlueNoise(43, 2, 2.5).places_in({0.0, 0.0}, {20.0, 20.0}).front().at_world);
}

TEST(Fields, ACellsPieceDoesNotDependOnTheCellAskedForBefore) {
  const tiler::Fields fields(world::FieldPattern(11, true));
  std::optional<tiler::Fields::Found> last;
  int num_pieces = 0;
  for (int y = 0; y < 700; y += 3)  // 1900 m
    for (int x = -350; x < 350; ++x) {
      std::optional<tiler::Fields::Found> none;
      const auto alone = fields.piece_in(x, y, none);
      const auto after = fields.piece_in(x, y, last);
      ASSERT_EQ(alone.has_value(), after.has_value()) << x << " " << y;
      if (!alone) continue;
      ++num_pieces;
      ASSERT_EQ(alone->center_world, after->center_world);
      ASSERT_EQ(alone->heading_rad, after->heading_rad);
      ASSERT_EQ(alone->crop, after->crop);
    }
  EXPECT_GT(num_pieces, 10000);
}

TEST(Fields, PiecesLieInRowsAndNeverOverlap) {
  const tiler::Fields fields(world::FieldPattern(11, true));
  std::vector<tiler::CropPiece> pieces;
  std::optional<tiler::Fields::Found> last;
  constexpr int kCells = 330;  // 900 m: several regions
  for (int y = -kCells / 2; y < kCells / 2; ++y)
    for (int x = -kCells / 2; x < kCells / 2; ++x)
      if (const auto piece = fields.piece_in(x, y, last)) {
        EXPECT_EQ(std::floor(piece->center_world.x() / tiler::Fields::kCell_m), x);
        EXPECT_EQ(std::floor(piece->center_world.y() / tiler::Fields::kCell_m), y);
        pieces.push_back(*piece);
      }
  // Most of the land is field, margins and borders of regions apart.
  const double area_m2 = std::pow(kCells * tiler::Fields::kCell_m, 2);
  EXPECT_GT(static_cast<double>(pieces.size()) * 16.0, 0.75 * area_m2);
  std::set<double> headings;
  std::set<tiler::Crop> crops;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    headings.insert(pieces[i].heading_rad);
    crops.insert(pieces[i].crop);
    for (std::size_t j = 0; j < i; ++j) {
      const Vector2d apart = pieces[j].center_world - pieces[i].center_world;
      if (apart.squaredNorm() > 33.0) continue;
      const Vector2d along(std::cos(pieces[i].heading_rad), std::sin(pieces[i].heading_rad));
      if (pieces[i].heading_rad == pieces[j].heading_rad) {
        // On one lattice: a whole number of pieces apart, along and across.
        const double u = apart.dot(along) / tiler::kCropPiece_m;
        const double v = (along.x() * apart.y() - along.y() * apart.x()) / tiler::kCropPiece_m;
        EXPECT_NEAR(u, std::round(u), 1e-9);
        EXPECT_NEAR(v, std::round(v), 1e-9);
        EXPECT_GT(std::abs(std::round(u)) + std::abs(std::round(v)), 0.5);
      } else {
        EXPECT_GE(apart.norm(), tiler::kCropPiece_m);  // both are within their own region
      }
    }
  }
  EXPECT_GE(headings.size(), 2U);
  EXPECT_EQ(crops.size(), static_cast<std::size_t>(world::kNumCrops));
}

}  // namespace
}  // namespace terracast::test
