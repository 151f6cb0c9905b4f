#include <gtest/gtest.h>

#include <algorithm>

#include "core/log.h"
#include "tests/support/test_data.h"
#include "tests/validate/mutations/mutations.h"
#include "validate/dataset.h"
#include "validate/diagnosis.h"

/// A diagnosis that may not look as long as it wants says so, and keeps what it found by then.
namespace terracast::validate {
namespace {

bool is_named(const std::vector<Cause>& causes, const std::string& part) {
  return std::any_of(causes.begin(), causes.end(), [&](const Cause& cause) {
    return cause.words.find(part) != std::string::npos;
  });
}

TEST(Diagnosis, ThatEndsAtItsBoundSaysSoAndKeepsWhatItFound) {
  const test::ScratchFolder scratch;
  const test::RightDataset right =
      test::write_right_dataset("colmap", test::Path::Curved, scratch / "right");
  const auto half_pixel =
      std::find_if(test::mutations().begin(), test::mutations().end(),
                   [](const test::Mutation& one) { return one.name == "HalfPixel"; });
  ASSERT_NE(half_pixel, test::mutations().end());
  test::corrupt(right, *half_pixel, scratch / "data");

  const core::Log log("validate", core::LogLevel::Off);
  const core::Context context{.log = log};
  ValidateOptions options;
  options.samples_per_image = 1000;
  std::vector<CheckResult> failed =
      run_validate_stage(scratch / "data", options, scratch / "report", context);
  std::erase_if(failed, [](const CheckResult& result) { return result.ok; });
  ASSERT_FALSE(failed.empty());
  Findings findings;
  const Dataset dataset = read_dataset(scratch / "data", "colmap", findings);
  ASSERT_EQ(findings.count(), 0U);
  const auto causes_within = [&](std::int64_t effort) {
    std::vector<std::string> damage;
    return diagnose(dataset, dataset.sequences.at(0), failed, 0, damage, options, context, effort);
  };

  const std::string found = "principal point off by (0.5, 0.5) px";
  const std::vector<Cause> whole = causes_within(kLeastEffort);
  EXPECT_TRUE(is_named(whole, found));
  EXPECT_FALSE(is_named(whole, "search"));
  // Nothing is looked at that would go beyond the bound.
  for (const std::int64_t effort : {1, 100, 2000}) {
    const std::vector<Cause> causes = causes_within(effort);
    ASSERT_FALSE(causes.empty()) << effort;
    EXPECT_EQ(causes.back().name, "search_ended");
    EXPECT_EQ(causes.back().sequence, dataset.sequences[0].name);
    EXPECT_TRUE(is_named(causes, fmt::format("its bound of {} comparisons", effort)));
    EXPECT_EQ(is_named(causes, found), effort == 2000) << effort;
    EXPECT_EQ(causes.size(), effort == 2000 ? 2U : 1U);
  }
}

}  // namespace
}  // namespace terracast::validate
