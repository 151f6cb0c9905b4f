#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "tiler/erosion.h"
#include "tiler/flow_routing.h"
#include "tiler/gradient_noise.h"
#include "tiler/grid.h"
#include "tiler/relief.h"
#include "tiler/void_filling.h"

namespace terracast::tiler {
namespace {

Grid<float> random_heights(int side, std::uint64_t seed) {
  Grid<float> heights(side, side);
  for (std::size_t k = 0; k < heights.values.size(); ++k)
    heights.values[k] = static_cast<float>(100.0 * core::random_unit(seed, 1, k));
  return heights;
}

std::vector<std::uint8_t> border_of(const Grid<float>& grid) {
  std::vector<std::uint8_t> is_border(grid.values.size(), 0);
  for (int j = 0; j < grid.height; ++j)
    for (int i = 0; i < grid.width; ++i)
      if (i == 0 || j == 0 || i == grid.width - 1 || j == grid.height - 1)
        is_border[grid.index(i, j)] = 1;
  return is_border;
}

TEST(FlowRouting, EveryCellDrainsDownhillToAnOutlet) {
  const Grid<float> heights = random_heights(60, 3);
  const auto outlets = border_of(heights);
  const FlowRouting flow = route_flow(heights, outlets);
  double total = 0.0;
  std::vector<int> position(flow.order.size());
  for (std::size_t k = 0; k < flow.order.size(); ++k)
    position[static_cast<std::size_t>(flow.order[k])] = static_cast<int>(k);
  for (std::size_t cell = 0; cell < outlets.size(); ++cell) {
    const auto receiver = static_cast<std::size_t>(flow.receiver[cell]);
    EXPECT_GE(flow.filled_m.values[cell], heights.values[cell]);
    if (outlets[cell] != 0) {
      EXPECT_EQ(receiver, cell);
      total += static_cast<double>(flow.area[cell]);
      continue;
    }
    EXPECT_LT(flow.filled_m.values[receiver], flow.filled_m.values[cell]);
    EXPECT_LT(position[receiver], position[cell]);
  }
  EXPECT_EQ(total, 3600.0);  // all water leaves, none is made
}

TEST(FlowRouting, AConeFillsNothing) {
  Grid<float> cone(31, 31);
  for (int j = 0; j < 31; ++j)
    for (int i = 0; i < 31; ++i)
      cone(i, j) = static_cast<float>(100.0 - std::hypot(i - 15, j - 15));
  const FlowRouting flow = route_flow(cone, border_of(cone));
  EXPECT_EQ(flow.filled_m.values, cone.values);
  EXPECT_EQ(flow.area[cone.index(15, 15)], 1.0F);
}

TEST(Erosion, RiversComeToTheSlopeOfTheStreamPowerLaw) {
  // A plane strip that rises evenly, with the sea on one side: in the steady state U = K A^m S
  // along every river. m is 0.4375.
  constexpr int kSide = 48;
  ErosionInputs land;
  land.spacing_m = 100.0;
  land.heights_m = random_heights(kSide, 5);
  land.uplift_m = Grid<float>(kSide, kSide, 1.0F);
  land.erodibility = Grid<float>(kSide, kSide, 1.0F);
  land.is_sea.assign(land.heights_m.values.size(), 0);
  for (int i = 0; i < kSide; ++i) {
    land.is_sea[land.heights_m.index(i, 0)] = 1;
    land.heights_m(i, 0) = 0.0F;
  }
  const ErosionOptions options{
      .num_steps = 400, .stream_power = 0.05, .talus_slope = 10.0, .creep = 0.0};
  const Grid<float> heights = erode(land, options);
  const FlowRouting flow = route_flow(heights, land.is_sea);
  std::vector<double> ratios;
  for (std::size_t cell = 0; cell < flow.area.size(); ++cell) {
    const auto receiver = static_cast<std::size_t>(flow.receiver[cell]);
    if (receiver == cell || flow.area[cell] < 4.0F) continue;
    const std::size_t shift = cell > receiver ? cell - receiver : receiver - cell;
    const double distance_m = shift == 1 || shift == kSide ? 100.0 : 141.421356;
    const double slope =
        static_cast<double>(heights.values[cell] - heights.values[receiver]) / distance_m;
    const double area_m2 = static_cast<double>(flow.area[cell]) * 1e4;
    ratios.push_back(0.05 * std::pow(area_m2, 0.4375) * slope);
  }
  ASSERT_GT(ratios.size(), 200U);
  std::nth_element(ratios.begin(), ratios.begin() + static_cast<long>(ratios.size() / 2),
                   ratios.end());
  // The uplift is 1 m a step.
  EXPECT_NEAR(ratios[ratios.size() / 2], 1.0, 0.02);
}

TEST(Relief, MoistureGathersInValleysAndSlopesAreMeasured) {
  // A valley that runs south: |x| up its sides, and a gentle fall along it.
  constexpr int kSide = 101;
  Grid<float> heights(kSide, kSide);
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i)
      heights(i, j) = static_cast<float>(10.0 * std::abs(i - 50) + 1.0 * j);
  const std::vector<std::uint8_t> no_sea(heights.values.size(), 0);
  const Relief relief = analyse_relief(heights, no_sea, 50.0);
  EXPECT_GT(relief.moisture(50, 20), relief.moisture(20, 20) + 40.0F);
  EXPECT_NEAR(relief.ruggedness(20, 50), std::hypot(10.0, 1.0) / 50.0, 1e-3);
}

TEST(GradientNoise, IsZeroOnItsLatticeAndBounded) {
  const GradientNoise noise(4, 9);
  double highest = 0.0;
  for (int k = -500; k < 500; ++k) {
    EXPECT_EQ(noise(k, 7 * k + 3), 0.0);
    highest = std::max(highest, std::abs(noise(0.37 * k, 0.11 * k + 5.5)));
  }
  EXPECT_GT(highest, 0.3);
  EXPECT_LT(highest, 1.0);
}

TEST(Bicubic, ReproducesQuadraticsAndMeetsWithoutAKink) {
  Grid<double> grid(12, 12);
  const auto f = [](double x, double y) {
    return 3.0 + x - 2.0 * y + 0.5 * x * x - 0.25 * y * y + x * y;
  };
  for (int j = 0; j < 12; ++j)
    for (int i = 0; i < 12; ++i) grid(i, j) = f(i, j);
  for (double y = 1.5; y < 9.0; y += 0.31)
    for (double x = 1.5; x < 9.0; x += 0.37) EXPECT_NEAR(bicubic(grid, {x, y}), f(x, y), 1e-11);
  const Grid<float> rough = random_heights(12, 8);
  const double step = 1e-6;
  const double left = (bicubic(rough, {5.0, 4.3}) - bicubic(rough, {5.0 - step, 4.3})) / step;
  const double right = (bicubic(rough, {5.0 + step, 4.3}) - bicubic(rough, {5.0, 4.3})) / step;
  EXPECT_NEAR(left, right, 1e-2);
}

TEST(VoidFilling, StaysWithinTheRimAndIsHarmonic) {
  Grid<double> heights(90, 70);
  Grid<std::uint8_t> is_unknown(90, 70, 0);
  // x^2 - y^2 is harmonic, on the grid too: the membrane over its rim is the function itself.
  const auto f = [](int i, int j) {
    return 0.01 * ((i - 45.0) * (i - 45.0) - (j - 35.0) * (j - 35.0));
  };
  for (int j = 0; j < 70; ++j)
    for (int i = 0; i < 90; ++i) {
      const bool is_void = std::hypot(i - 45.0, j - 35.0) < 12.0;
      is_unknown(i, j) = is_void ? 1 : 0;
      heights(i, j) = is_void ? 1e9 : f(i, j);
    }
  fill_from_surroundings(heights, is_unknown);
  for (int j = 0; j < 70; ++j)
    for (int i = 0; i < 90; ++i) {
      EXPECT_NEAR(heights(i, j), f(i, j), 0.05);  // of a range of 2.9
    }
}

TEST(VoidFilling, ASpikeAtTheRimStaysTheOnlyOne) {
  Grid<double> heights(60, 60, 100.0);
  Grid<std::uint8_t> is_unknown(60, 60, 0);
  for (int j = 5; j < 55; ++j)
    for (int i = 5; i < 55; ++i) is_unknown(i, j) = 1;
  heights(4, 30) = 500.0;
  fill_from_surroundings(heights, is_unknown);
  for (int j = 5; j < 55; ++j)
    for (int i = 5; i < 55; ++i) {
      EXPECT_GE(heights(i, j), 100.0);
      EXPECT_LE(heights(i, j), 250.0);
    }
}

TEST(Distance, IsEuclidean) {
  Grid<std::uint8_t> is_member(40, 30, 1);
  is_member(7, 9) = 0;
  is_member(31, 22) = 0;
  const Grid<float> distance = distance_to_others(is_member);
  for (int j = 0; j < 30; ++j)
    for (int i = 0; i < 40; ++i)
      EXPECT_NEAR(static_cast<double>(distance(i, j)),
                  std::min(std::hypot(i - 7, j - 9), std::hypot(i - 31, j - 22)), 1e-4);
}

}  // namespace
}  // namespace terracast::tiler
