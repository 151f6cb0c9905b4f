#include "batch/dataset/deal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "core/random.h"

namespace terracast::batch {
namespace {

double cost(const std::vector<std::int64_t>& groups, const std::vector<int>& parts,
            const std::array<std::int64_t, 3>& targets) {
  std::array<std::int64_t, 3> sums{};
  for (std::size_t i = 0; i < groups.size(); ++i)
    sums[static_cast<std::size_t>(parts[i])] += groups[i];
  double sum = 0.0;
  for (std::size_t k = 0; k < 3; ++k) sum += std::pow(static_cast<double>(sums[k] - targets[k]), 2);
  return sum;
}

TEST(Deal, FindsTheBestOfAllDealsOfFewGroups) {
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    std::vector<std::int64_t> groups(1 + seed % 10);
    for (std::size_t i = 0; i < groups.size(); ++i)
      groups[i] = 1 + static_cast<std::int64_t>(core::random_bits(seed, 1, i) % 300);
    const std::int64_t sum = std::accumulate(groups.begin(), groups.end(), std::int64_t{0});
    const std::array<std::int64_t, 3> targets = {sum * 7 / 10, sum / 5,
                                                 sum - sum * 7 / 10 - sum / 5};
    double best = std::numeric_limits<double>::infinity();
    std::vector<int> parts(groups.size());
    for (int code = 0; code < std::pow(3, groups.size()); ++code) {
      for (int rest = code, i = 0; i < static_cast<int>(parts.size()); ++i, rest /= 3)
        parts[static_cast<std::size_t>(i)] = rest % 3;
      best = std::min(best, cost(groups, parts, targets));
    }
    ASSERT_EQ(cost(groups, deal(groups, targets), targets), best) << "seed " << seed;
  }
}

TEST(Deal, OfManyGroupsIsBetteredByNoMoveAndNoExchange) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    std::vector<std::int64_t> groups(kMostTriedOut + 1 + 7 * (seed % 9));
    for (std::size_t i = 0; i < groups.size(); ++i)
      groups[i] =
          1 + static_cast<std::int64_t>(std::exp(core::random_between(0.0, 8.0, seed, 1, i)));
    const std::int64_t sum = std::accumulate(groups.begin(), groups.end(), std::int64_t{0});
    const std::array<std::int64_t, 3> targets = {sum * 7 / 10, sum / 5,
                                                 sum - sum * 7 / 10 - sum / 5};
    std::vector<int> parts = deal(groups, targets);
    const double found = cost(groups, parts, targets);
    for (std::size_t i = 0; i < groups.size(); ++i) {
      const int before = parts[i];
      for (int part = 0; part < 3; ++part) {
        parts[i] = part;
        ASSERT_GE(cost(groups, parts, targets), found);
      }
      parts[i] = before;
      for (std::size_t k = 0; k < i; ++k) {
        std::swap(parts[i], parts[k]);
        ASSERT_GE(cost(groups, parts, targets), found);
        std::swap(parts[i], parts[k]);
      }
    }
  }
}

TEST(Deal, GivesNothingToATargetOfNothing) {
  EXPECT_THAT(deal({5, 5, 5, 5}, {20, 0, 0}), testing::Each(0));
  EXPECT_THAT(deal(std::vector<std::int64_t>(50, 7), {200, 0, 150}), testing::Each(testing::Ne(1)));
  EXPECT_THAT(deal({}, {0, 0, 0}), testing::IsEmpty());
}

}  // namespace
}  // namespace terracast::batch
