#include "validate/null_distribution.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "core/random.h"

/// Tails against closed forms and sums; verdicts against estimates that are drawn with an error that is known.
namespace terracast::validate {
namespace {

constexpr double kNormal = 1e12;  ///< degrees of freedom: as good as a normal distribution

TEST(StudentTail, IsThatOfTheClosedForms) {
  for (const double x : {0.1, 1.0, 3.0, 50.0, 1e4, 1e8}) {
    // One degree: Cauchy's distribution; written so that no digits cancel.
    EXPECT_NEAR(student_tail(x, 1.0) / (2.0 / std::numbers::pi * std::atan(1.0 / x)), 1.0, 1e-9)
        << x;
    // Two degrees: 1 - x / sqrt(2 + x²).
    const double root = std::sqrt(2.0 + x * x);
    EXPECT_NEAR(student_tail(x, 2.0) / (2.0 / (root * (root + x))), 1.0, 1e-9) << x;
  }
  for (const double x : {0.1, 1.0, 6.0, 20.0})
    EXPECT_NEAR(student_tail(x, kNormal) / std::erfc(x / std::sqrt(2.0)), 1.0, 1e-6) << x;
  // Tables of the distribution: 5 % and 1 % on both sides.
  EXPECT_NEAR(student_quantile(0.05, 10.0), 2.228, 5e-4);
  EXPECT_NEAR(student_quantile(0.01, 30.0), 2.750, 5e-4);
  EXPECT_NEAR(student_quantile(1e-9, kNormal), 6.1094, 1e-4);
  EXPECT_EQ(student_tail(5.0, 0.0), 1.0);
  EXPECT_TRUE(std::isinf(student_quantile(0.01, 0.0)));
  for (const double degrees : {0.6, 1.0, 3.0, 17.0, 1e6})
    for (const double probability : {0.3, 1e-3, 1e-9, 1e-13}) {
      const double deviations = student_quantile(probability, degrees);
      if (std::isfinite(deviations)) {
        EXPECT_NEAR(student_tail(deviations, degrees) / probability, 1.0, 1e-6) << degrees;
      }
    }
}

TEST(BinomialTail, IsTheSumOfItsTerms) {
  for (const double share : {1e-3, 0.07, 0.5, 0.93})
    for (const int total : {1, 12, 60}) {
      for (int count = 0; count <= total + 1; ++count) {
        long double sum = 0.0L;
        for (int k = count; k <= total; ++k)
          sum += std::exp(std::lgamma(total + 1.0L) - std::lgamma(k + 1.0L) -
                          std::lgamma(total - k + 1.0L) +
                          k * std::log(static_cast<long double>(share)) +
                          (total - k) * std::log1p(-static_cast<long double>(share)));
        EXPECT_NEAR(binomial_tail(count, total, share), static_cast<double>(sum),
                    1e-9 * static_cast<double>(sum) + 1e-300)
            << count << " of " << total << " at " << share;
      }
      const std::int64_t most = binomial_quantile(1e-9, total, share);
      EXPECT_LT(binomial_tail(most + 1, total, share), 1e-9);
      if (most > 0) {
        EXPECT_GE(binomial_tail(most, total, share), 1e-9);
      }
    }
}

/// Values of a normal distribution by the polar way of Box and Muller.
double normal(std::uint64_t turn, std::uint64_t index) {
  const double u = core::random_unit(11, turn, 2 * index),
               v = core::random_unit(11, turn, 2 * index + 1);
  return std::sqrt(-2.0 * std::log1p(-u)) * std::cos(2.0 * std::numbers::pi * v);
}

/// A mean of a few normal values about `truth`, with the standard error that they themselves show.
Estimate mean_of(int count, double truth, std::uint64_t turn) {
  std::vector<double> values;
  double sum = 0.0, squares = 0.0;
  for (int i = 0; i < count; ++i)
    values.push_back(truth + normal(turn, static_cast<std::uint64_t>(i)));
  for (const double value : values) sum += value / count;
  for (const double value : values) squares += (value - sum) * (value - sum);
  return {.value = sum,
          .standard_error = std::sqrt(squares / (count * (count - 1.0))),
          .degrees = count - 1.0,
          .allowance = 0.0,
          .where = "here"};
}

TEST(JudgedEstimates, StateTheirProbability) {
  constexpr int kTurns = 20000;
  for (const int count : {3, 8, 100}) {
    int num_rare = 0;
    for (std::uint64_t turn = 0; turn < kTurns; ++turn) {
      Estimates estimates(10.0);
      estimates.add(mean_of(count, 0.0, turn + 1000000 * static_cast<std::uint64_t>(count)));
      CheckResult result;
      estimates.judge(result);
      EXPECT_TRUE(result.ok);
      num_rare += *result.probability < 0.01 ? 1 : 0;
    }
    // 200 are expected, with a standard error of 14; five of those.
    EXPECT_NEAR(num_rare, 200, 70) << count;
  }
}

TEST(JudgedEstimates, FindErrorsOfTheSizeThatTheySay) {
  for (const int count : {5, 40}) {
    int num_found = 0;
    constexpr int kTurns = 2000;
    for (std::uint64_t turn = 0; turn < kTurns; ++turn) {
      // The size is said by the same values' scatter: a first look at them tells it, a second one is judged.
      Estimates before(1e9);
      const Estimate right = mean_of(count, 0.0, turn + 77000000);
      before.add(right);
      CheckResult said;
      before.judge(said);
      Estimates estimates(1e9);
      Estimate wrong = right;
      wrong.value += *said.smallest;
      estimates.add(wrong);
      CheckResult result;
      estimates.judge(result);
      num_found += result.ok ? 0 : 1;
    }
    // 99 of 100, less five standard errors.
    EXPECT_GE(num_found, 0.99 * kTurns - 5.0 * std::sqrt(0.01 * 0.99 * kTurns)) << count;
  }
}

TEST(JudgedEstimates, WhatIsAllowedIsNoError) {
  Estimates estimates(1.0);
  estimates.add(
      {.value = 0.3, .standard_error = 1e-3, .degrees = 50.0, .allowance = 0.3, .where = "a"});
  CheckResult result;
  estimates.judge(result);
  EXPECT_TRUE(result.ok);
  EXPECT_FALSE(result.is_unseen);
  EXPECT_EQ(*result.probability, 1.0);
  EXPECT_NEAR(result.value, 0.3, 1e-15);
  EXPECT_GT(result.bound, 0.3);
  EXPECT_LT(*result.smallest, 1.0);
  // The one that uses most of its bound stands for all.
  estimates.add(
      {.value = -0.4, .standard_error = 1e-3, .degrees = 50.0, .allowance = 0.3, .where = "b"});
  estimates.judge(result);
  EXPECT_FALSE(result.ok);
  EXPECT_LT(*result.probability, kFalseVerdict);
  EXPECT_EQ(result.worst.substr(0, 2), "b:");
}

TEST(JudgedEstimates, ThatCouldNotTellAreUnseen) {
  Estimates estimates(1.0);
  estimates.add(
      {.value = 0.5, .standard_error = 1.0, .degrees = 4.0, .allowance = 0.1, .where = "a"});
  estimates.add_unseen();
  CheckResult result;
  estimates.judge(result);
  EXPECT_TRUE(result.ok);
  EXPECT_TRUE(result.is_unseen);
  EXPECT_GT(*result.smallest, 1.0);
  EXPECT_EQ(estimates.num_seen(), 0U);
  EXPECT_EQ(estimates.num_all(), 2U);
  // An error so large that it shows all the same is one.
  estimates.add(
      {.value = 1e6, .standard_error = 1.0, .degrees = 4.0, .allowance = 0.1, .where = "b"});
  estimates.judge(result);
  EXPECT_FALSE(result.ok);
  EXPECT_FALSE(result.is_unseen);
}

TEST(JudgedEstimates, PartsThatCouldNotTellAreNamedAndDoNotStandForThoseThatCould) {
  const auto of_camera = [](const char* camera, double value, double standard_error) {
    return Estimate{.value = value,
                    .standard_error = standard_error,
                    .degrees = 50.0,
                    .where = std::string(camera) + ", x",
                    .part = camera};
  };
  Estimates estimates(1.0);
  estimates.add(of_camera("left", 0.01, 0.01));
  estimates.add(of_camera("left", 0.3, 100.0));
  estimates.add(of_camera("right", 30.0, 100.0));
  estimates.add(of_camera("right", 80.0, 100.0));
  estimates.add_unseen("rear");
  estimates.add({.value = 0.0, .standard_error = 100.0, .degrees = 50.0, .where = "an image"});
  CheckResult result;
  estimates.judge(result);
  EXPECT_TRUE(result.ok);
  EXPECT_FALSE(result.is_unseen);
  EXPECT_EQ(result.unseen_parts, (std::vector<std::string>{"rear", "right"}));
  EXPECT_EQ(result.value, 0.01);
  EXPECT_LT(result.bound, 1.0);
  // Beyond its own bound it stands for all.
  estimates.add(of_camera("right", 1e5, 100.0));
  estimates.judge(result);
  EXPECT_FALSE(result.ok);
  EXPECT_EQ(result.value, 1e5);
  // Where no part could tell, the whole is unseen.
  Estimates none(1.0);
  none.add(of_camera("right", 30.0, 100.0));
  CheckResult unseen;
  none.judge(unseen);
  EXPECT_TRUE(unseen.is_unseen);
  EXPECT_TRUE(unseen.unseen_parts.empty());
}

/// Draws which points are wrong, each with the same probability.
ShareOfPoints drawn_share(std::int64_t num_points, double share, std::uint64_t seed) {
  ShareOfPoints part{0, num_points, "drawn"};
  for (std::int64_t i = 0; i < num_points; ++i)
    part.num_wrong += core::random_unit(seed, 5, static_cast<std::uint64_t>(i)) < share ? 1 : 0;
  return part;
}

TEST(JudgedShares, FewPointsMayBeMoreByChanceAndManyNotBeyondWhatIsAllowed) {
  struct Case {
    std::int64_t num_wrong, num_points;
    bool is_ok;
  };
  // If 2 % may be wrong, 3 wrong points of 100 prove nothing, but 30 000 of a million do.
  for (const auto& [allowance, one] : {std::pair{0.02, Case{3, 100, true}},
                                       {1e-5, Case{6, 10000, true}},
                                       {0.02, Case{30000, 1000000, false}},
                                       {0.02, Case{20000, 1000000, true}},
                                       {0.02, Case{100, 100, false}},
                                       {0.02, Case{14, 100, true}},
                                       {0.02, Case{18, 100, false}}}) {
    PointShares shares(allowance, 0.5);
    shares.add({one.num_wrong, one.num_points, "a"});
    CheckResult result;
    shares.judge(result);
    EXPECT_EQ(result.ok, one.is_ok) << one.num_wrong << " of " << one.num_points;
    EXPECT_NEAR(*result.probability, binomial_tail(one.num_wrong, one.num_points, allowance),
                1e-15);
  }
}

TEST(JudgedShares, FindSharesOfTheSizeThatTheySay) {
  for (const std::int64_t num_points : {60, 1000, 20000}) {
    PointShares none(1e-3, 0.5);
    none.add({0, num_points, "a"});
    CheckResult result;
    none.judge(result);
    ASSERT_TRUE(result.ok && !result.is_unseen);
    // 297 of 300 draws are found on average; three standard errors below that is the least.
    constexpr int kDraws = 300;
    int num_found = 0;
    for (int draw = 0; draw < kDraws; ++draw) {
      PointShares shares(1e-3, 0.5);
      shares.add(drawn_share(num_points, *result.smallest, static_cast<std::uint64_t>(draw)));
      CheckResult found;
      shares.judge(found);
      num_found += found.ok ? 0 : 1;
    }
    EXPECT_GE(num_found, 0.97 * kDraws) << num_points;
    EXPECT_LT(num_found, kDraws) << "the smallest one would do with less: " << num_points;
  }
}

// A single wrong point proves nothing: the report names the part that is nearest to its bound.
TEST(JudgedShares, ThePartThatIsLeastProbableStandsForAll) {
  PointShares shares(0.02, 0.5);
  shares.add({1, 1, "small"});
  shares.add({50, 1000, "large"});
  shares.add({5, 1000, "other"});
  CheckResult result;
  shares.judge(result);
  EXPECT_TRUE(result.ok);
  EXPECT_EQ(result.worst, "large: 50 of 1000 points");
  EXPECT_NEAR(*result.probability, 2.0 * binomial_tail(50, 1000, 0.02), 1e-12);
}

TEST(JudgedShares, ThatCouldNotTellAreUnseen) {
  PointShares shares(0.02, 0.5);
  shares.add({1, 4, "a"});
  CheckResult result;
  shares.judge(result);
  EXPECT_TRUE(result.ok && result.is_unseen && result.skipped);
  shares.add({90, 100, "b"});
  shares.judge(result);
  EXPECT_FALSE(result.ok);
  EXPECT_EQ(result.worst, "b: 90 of 100 points");
  EXPECT_EQ(shares.num_points(), 104);
}

}  // namespace
}  // namespace terracast::validate
