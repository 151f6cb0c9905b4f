#include <gtest/gtest.h>

#include <cmath>

#include "tests/jobs/draws.h"
#include "validate/checks/photometric_pairs.h"

/// Evidence for swapped channels: none from a few patches; from many, judged by their scatter.
namespace terracast::validate {
namespace {

CheckResult judged(const ColorDifferences& differences) {
  Estimates estimates(1.0);
  estimates.add(differences.swapped_fits_better(1.0));
  CheckResult result;
  estimates.judge(result);
  return result;
}

TEST(ColorDifferences, OfFewPatchesTellNothing) {
  ColorDifferences few;
  for (int i = 0; i < 19; ++i) few.add(9.0, 3.0);
  EXPECT_TRUE(judged(few).is_unseen);
  few.add(9.0, 3.0);
  EXPECT_FALSE(judged(few).ok);
  EXPECT_NEAR(judged(few).value, std::log(3.0), 1e-12);
}

TEST(ColorDifferences, OfGreyGroundAreRightHoweverTheyScatter) {
  for (std::uint64_t seed = 1; seed <= 2000; ++seed) {
    test::Draws draws(seed, "grey");
    ColorDifferences grey;
    const int num_patches = 20 + draws.below(200);
    for (int i = 0; i < num_patches; ++i)
      grey.add(draws.log_between(0.3, 30.0), draws.log_between(0.3, 30.0));
    const CheckResult result = judged(grey);
    EXPECT_TRUE(result.ok) << seed << ": " << result.value << " of " << result.bound;
  }
}

TEST(ColorDifferences, ThatAreTheSameFitInNoOtherOrder) {
  ColorDifferences same;
  for (int i = 0; i < 100; ++i) same.add(0.0, 12.0);
  EXPECT_TRUE(judged(same).ok);
  EXPECT_TRUE(std::isinf(same.right_fits_better()));
}

}  // namespace
}  // namespace terracast::validate
