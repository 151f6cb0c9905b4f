#include "geo/paths/uniform_spline.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"

namespace terracast::geo {
namespace {

TEST(Smoothed, IsTheTriangularMeanOfItsNeighbours) {
  constexpr int kCount = 137;
  std::vector<double> values;
  for (int i = 0; i < kCount; ++i)
    values.push_back(1000.0 + 300.0 * core::random_unit(7, 1, static_cast<std::uint64_t>(i)));
  for (const bool is_closed : {false, true})
    for (const int reach : {1, 2, 3, 10, 64, 200}) {
      const std::vector<double> means = smoothed(values, reach, is_closed);
      ASSERT_EQ(means.size(), values.size());
      const int first = reach / 2;
      const int second = reach - first;
      for (int i = 0; i < kCount; ++i) {
        double sum = 0.0;
        for (int a = -first; a <= first; ++a)
          for (int b = -second; b <= second; ++b) {
            const int k = i + a + b;
            const int at =
                is_closed ? ((k % kCount) + kCount) % kCount : std::clamp(k, 0, kCount - 1);
            sum += values[static_cast<std::size_t>(at)];
          }
        // Rounding of the 4e4 additions, at most, of values about 1000 that make `sum`.
        ASSERT_NEAR(means[static_cast<std::size_t>(i)],
                    sum / ((2.0 * first + 1.0) * (2.0 * second + 1.0)), 1e-8)
            << reach << " " << i;
      }
    }
}

TEST(Smoothed, TakesNoLongerForAWideReach) {
  // 2000 km in steps of 2 m, smoothed over 20 km to each side: window by window some 2e10 additions
  // (half a minute), by blocks 1e7.
  std::vector<double> line(1000000);
  for (std::size_t i = 0; i < line.size(); ++i) line[i] = 500.0 + 0.002 * static_cast<double>(i);
  const std::vector<double> means = smoothed(line, 10000, false);
  // A line is its own mean, up to the rounding of 1e4 additions.
  for (std::size_t i = 10000; i < line.size() - 10000; i += 997)
    ASSERT_NEAR(means[i], line[i], 1e-7);
}

}  // namespace
}  // namespace terracast::geo
