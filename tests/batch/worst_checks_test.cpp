#include "batch/dataset/worst_checks.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "validate/report.h"

namespace terracast::batch {
namespace {

/// A result as checks give it.
validate::CheckResult result(const char* name, double value, double bound,
                             bool is_lower_bound = false) {
  validate::CheckResult one;
  one.name = name;
  one.value = value;
  one.bound = bound;
  one.is_lower_bound = is_lower_bound;
  one.unit = "px";
  one.ok = one.is_within_bound();
  return one;
}

validate::CheckResult unseen(const char* name) {
  validate::CheckResult one = result(name, 0.0, 0.0);
  one.skipped = one.is_unseen = true;
  return one;
}

ValidationReport report(const char* run, const char* format,
                        const std::vector<validate::CheckResult>& results) {
  return {run, format, validate::report_json(results)};
}

TEST(WorstChecks, AreThoseNearestToTheirBound) {
  const std::vector<CheckFacts> worst = worst_checks({
      report("b", "kitti", {result("shift", 0.05, 0.1), result("points", 3000.0, 2000.0, true)}),
      report("a", "colmap", {result("shift", 0.03, 0.04), result("points", 2500.0, 2000.0, true)}),
      report("a", "kitti", {result("shift", 0.06, 0.1), unseen("points")}),
  });
  ASSERT_EQ(worst.size(), 2U);
  EXPECT_EQ(worst[0].name, "points");
  EXPECT_EQ(worst[0].value, 2500.0);
  EXPECT_TRUE(worst[0].is_lower_bound);
  EXPECT_EQ(worst[0].num_measured, 2);
  EXPECT_EQ(worst[0].num_unseen, 1);
  EXPECT_EQ(worst[0].num_failed, 0);
  EXPECT_EQ(worst[1].name, "shift");
  EXPECT_EQ(worst[1].value, 0.03);  // 75 % of its bound; 0.06 is 60 % of its own
  EXPECT_EQ(worst[1].bound, 0.04);
  EXPECT_EQ(worst[1].unit, "px");
  EXPECT_EQ(worst[1].run + " " + worst[1].format, "a colmap");
  EXPECT_EQ(worst[1].num_measured, 3);
}

TEST(WorstChecks, OfWhichOneFailsIsThatOne) {
  validate::CheckResult wrong = result("structure", 0.0, 0.0);
  wrong.ok = false;  // said so whatever its value
  const std::vector<CheckFacts> worst =
      worst_checks({report("a", "kitti", {result("structure", 0.0, 0.0)}),
                    report("b", "kitti", {wrong}), report("c", "kitti", {wrong})});
  ASSERT_EQ(worst.size(), 1U);
  EXPECT_EQ(worst[0].run, "b");
  EXPECT_EQ(worst[0].num_failed, 2);
  EXPECT_EQ(worst[0].num_measured, 3);
}

TEST(WorstChecks, ThatNothingMeasuredAreCountedAsUnseen) {
  const std::vector<CheckFacts> worst = worst_checks({report("a", "kitti", {unseen("colours")})});
  ASSERT_EQ(worst.size(), 1U);
  EXPECT_EQ(worst[0].num_measured, 0);
  EXPECT_EQ(worst[0].num_unseen, 1);
}

TEST(WorstChecks, OfDamagedReportsAreRefused) {
  EXPECT_THROW(worst_checks({{"a", "kitti", core::Json::object()}}), core::Error);
}

}  // namespace
}  // namespace terracast::batch
