#include "tiler/shoreline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "core/random.h"

// Coasts of rasters that hold the sea as samples of one value.
namespace terracast::test {
namespace {

using tiler::Grid;
using tiler::Shoreline;

constexpr int kSide = 40;

/// Land where a function is positive, at that height; a shelf of 1 m elsewhere.
struct Coast {
  explicit Coast(const std::function<double(int i, int j)>& land_m)
      : heights_m(kSide, kSide), is_sea(kSide, kSide) {
    for (int j = 0; j < kSide; ++j)
      for (int i = 0; i < kSide; ++i) {
        is_sea(i, j) = land_m(i, j) > 0.0 ? 0 : 1;
        heights_m(i, j) = is_sea(i, j) != 0 ? -1.0 : land_m(i, j);
      }
    shoreline = Shoreline(is_sea, is_sea);
  }
  double height_m(double x, double y) const { return shoreline.height_m(heights_m, {x, y}); }

  Grid<double> heights_m;
  Grid<std::uint8_t> is_sea;
  Shoreline shoreline;
};

/// Land and sea by lot, with steep land.
double by_lot_m(int i, int j) {
  const auto place = static_cast<std::uint64_t>(j * kSide + i);
  return core::random_unit(1, 0, place) < 0.5 ? 0.0 : core::random_between(0.5, 300.0, 1, 1, place);
}

TEST(Shoreline, OfAStraightCoastIsNearlyStraight) {
  // The sides of cells, turned by any angle, stray by 0.27 of a sample (RMS).
  double sum_of_rms = 0.0;
  constexpr int kNumCoasts = 40;
  for (int k = 0; k < kNumCoasts; ++k) {
    const auto draw = static_cast<std::uint64_t>(k);
    const double angle = core::random_between(0.0, std::numbers::pi, 2, 0, draw);
    const double off = core::random_between(-0.5, 0.5, 2, 1, draw);
    const Eigen::Vector2d inland(std::cos(angle), std::sin(angle));
    const Eigen::Vector2d along(-inland.y(), inland.x());
    const Eigen::Vector2d middle = Eigen::Vector2d::Constant(0.5 * kSide) + off * inland;
    // Land of unlike heights: the line is that of the samples, not of their heights.
    const Coast coast([&](int i, int j) {
      const double inland_px = inland.dot(Eigen::Vector2d(i, j) - middle);
      return inland_px > 0.0 ? 1.0 + by_lot_m(i, j) : 0.0;
    });
    double sum = 0.0, sum_of_squares = 0.0;
    int count = 0;
    for (double t = -10.0; t <= 10.0; t += 0.1, ++count) {
      double land = 1.5, sea = -1.5;
      while (land - sea > 1e-3) {
        const double between = 0.5 * (land + sea);
        const Eigen::Vector2d at = middle + t * along + between * inland;
        (coast.height_m(at.x(), at.y()) > 0.0 ? land : sea) = between;
      }
      sum += land;
      sum_of_squares += land * land;
      EXPECT_LT(std::abs(land), 0.75) << angle << " " << t;
    }
    sum_of_rms += std::sqrt(sum_of_squares / count - std::pow(sum / count, 2.0)) / kNumCoasts;
  }
  EXPECT_LT(sum_of_rms, 0.16);
}

TEST(Shoreline, PartsSamplesOfLandFromThoseOfSea) {
  // No islet is lost, no channel is filled, and all heights are there.
  const Coast coast(by_lot_m);
  for (int j = 2; j < kSide - 2; ++j)
    for (int i = 2; i < kSide - 2; ++i)
      EXPECT_NEAR(coast.height_m(i, j), coast.heights_m(i, j), 1e-9) << i << " " << j;
}

TEST(Shoreline, IsTheSplineOfTheHeightsAwayFromCoasts) {
  const auto hills_m = [](int i, int j) {
    return i < 12 ? 0.0 : 60.0 + 50.0 * std::sin(0.7 * i) * std::cos(0.9 * j);
  };
  const Coast coast(hills_m);
  for (double y = 4.0; y < 35.0; y += 0.37) {
    for (double x = 16.0; x < 35.0; x += 0.37)
      EXPECT_DOUBLE_EQ(coast.height_m(x, y), bicubic(coast.heights_m, Eigen::Vector2d(x, y)));
    for (double x = 2.0; x < 7.0; x += 0.37) EXPECT_NEAR(coast.height_m(x, y), -1.0, 1e-12);
  }
}

TEST(Shoreline, RaisesNoLandAndHasNoSteps) {
  // A plateau with cliffs stays level to what splines swing by: an eighth of 101 m, twice.
  const Coast plateau([](int i, int j) { return i + j / 3 > 20 ? 100.0 : 0.0; });
  for (double y = 3.0; y < 36.0; y += 0.17)
    for (double x = 3.0; x < 36.0; x += 0.17) EXPECT_LT(plateau.height_m(x, y), 130.0);
  const Coast rough(by_lot_m);
  for (int line = 3; line < kSide - 3; ++line)
    for (double t = 3.03; t < kSide - 3.0; t += 0.31) {
      EXPECT_NEAR(rough.height_m(line - 1e-10, t), rough.height_m(line + 1e-10, t), 1e-4);
      EXPECT_NEAR(rough.height_m(t, line - 1e-10), rough.height_m(t, line + 1e-10), 1e-4);
    }
}

TEST(Shoreline, DigsNoMoats) {
  // Beside a stack of rock, a spit and a cliff the sea is no deeper than the shelf, and land no lower than it is.
  const Coast rough(by_lot_m);
  const Coast stack([](int i, int j) { return i == 20 && j == 20 ? 300.0 : 0.0; });
  const Coast spit([](int, int j) { return j == 20 ? 40.0 : 0.0; });
  for (const Coast* coast : {&rough, &stack, &spit})
    for (double y = 3.0; y < 36.0; y += 0.13)
      for (double x = 3.0; x < 36.0; x += 0.13) EXPECT_GE(coast->height_m(x, y), -1.0 - 1e-12);
}

TEST(Shoreline, PassesFromAShelfToAMeasuredFloorWithoutSteps) {
  // A coast that runs north; the south's floor is measured.
  Grid<double> heights_m(kSide, kSide);
  Grid<std::uint8_t> is_sea(kSide, kSide), is_shelf(kSide, kSide);
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i) {
      is_sea(i, j) = i < 20 ? 1 : 0;
      is_shelf(i, j) = is_sea(i, j) != 0 && j >= 20 ? 1 : 0;
      heights_m(i, j) = is_sea(i, j) == 0 ? 40.0 : is_shelf(i, j) != 0 ? -1.0 : -25.0;
    }
  const Shoreline shoreline(is_sea, is_shelf);
  for (int line = 12; line < 30; ++line)
    for (double t = 12.03; t < 30.0; t += 0.17) {
      EXPECT_NEAR(shoreline.height_m(heights_m, {t, line - 1e-9}),
                  shoreline.height_m(heights_m, {t, line + 1e-9}), 1e-5);
      EXPECT_NEAR(shoreline.height_m(heights_m, {line - 1e-9, t}),
                  shoreline.height_m(heights_m, {line + 1e-9, t}), 1e-5);
    }
}

TEST(Shoreline, OfAMeasuredFloorIsTheContourOfItsHeights) {
  Grid<double> heights_m(kSide, kSide);
  Grid<std::uint8_t> is_sea(kSide, kSide);
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i) {
      heights_m(i, j) = 3.0 * (i - 20.3);
      is_sea(i, j) = heights_m(i, j) <= 0.0 ? 1 : 0;
    }
  const Shoreline shoreline(is_sea, Grid<std::uint8_t>(kSide, kSide, 0));
  for (double x = 3.0; x < 36.0; x += 0.19)
    EXPECT_NEAR(shoreline.height_m(heights_m, {x, 17.4}), 3.0 * (x - 20.3), 1e-9) << x;
}

}  // namespace
}  // namespace terracast::test
