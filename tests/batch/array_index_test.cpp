#include "batch/array_index.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <map>
#include <string>

#include "core/error.h"

namespace terracast::batch {
namespace {

using Variables = std::map<std::string, std::string>;

std::optional<Part> part_of(const Variables& variables, int count = 0) {
  return part_from_queue(
      [&](const char* name) -> std::optional<std::string> {
        const auto found = variables.find(name);
        return found != variables.end() ? std::optional(found->second) : std::nullopt;
      },
      count);
}

std::string refusal_of(const Variables& variables, int count = 0) {
  try {
    part_of(variables, count);
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), core::ErrorKind::Usage);
    return error.what();
  }
  return "";
}

TEST(ArrayIndex, PartsAreCountedFromZero) {
  EXPECT_EQ(part_from_text("0/4"), (Part{0, 4}));
  EXPECT_EQ(part_from_text("3/4"), (Part{3, 4}));
  for (const char* wrong : {"4/4", "-1/4", "1", "1/", "/4", "1/0", "a/b", "1/4/2", "1e0/4", ""})
    EXPECT_THROW(part_from_text(wrong), core::Error) << wrong;
}

TEST(ArrayIndex, EachQueueTellsItsTasksWhoTheyAre) {
  EXPECT_EQ(part_of({}), std::nullopt);
  EXPECT_EQ(part_of({{"SLURM_JOB_ID", "12"}}), std::nullopt) << "no array";
  // sbatch --array=0-7, and 10-30:5, as its manual describes the variables
  EXPECT_EQ(part_of({{"SLURM_ARRAY_TASK_ID", "5"},
                     {"SLURM_ARRAY_TASK_MIN", "0"},
                     {"SLURM_ARRAY_TASK_MAX", "7"},
                     {"SLURM_ARRAY_TASK_STEP", "1"}}),
            (Part{5, 8}));
  EXPECT_EQ(part_of({{"SLURM_ARRAY_TASK_ID", "25"},
                     {"SLURM_ARRAY_TASK_MIN", "10"},
                     {"SLURM_ARRAY_TASK_MAX", "30"},
                     {"SLURM_ARRAY_TASK_STEP", "5"}}),
            (Part{3, 5}));
  // qsub -t 1-8 of Grid Engine counts from 1; outside of arrays the variable says "undefined".
  EXPECT_EQ(part_of({{"SGE_TASK_ID", "8"},
                     {"SGE_TASK_FIRST", "1"},
                     {"SGE_TASK_LAST", "8"},
                     {"SGE_TASK_STEPSIZE", "1"}}),
            (Part{7, 8}));
  EXPECT_EQ(part_of({{"SGE_TASK_ID", "undefined"},
                     {"SGE_TASK_FIRST", "undefined"},
                     {"SGE_TASK_LAST", "undefined"}}),
            std::nullopt);
  EXPECT_EQ(part_of({{"PBS_ARRAY_INDEX", "3"}}, 4), (Part{3, 4}));
  EXPECT_EQ(part_of({{"JOB_COMPLETION_INDEX", "0"}}, 4), (Part{0, 4}));
}

/// A task of sbatch --array=3,7,8.
Variables task_with_holes(const char* index) {
  return {{"SLURM_ARRAY_TASK_ID", index},
          {"SLURM_ARRAY_TASK_MIN", "3"},
          {"SLURM_ARRAY_TASK_MAX", "8"},
          {"SLURM_ARRAY_TASK_STEP", "1"},
          {"SLURM_ARRAY_TASK_COUNT", "3"}};
}

// Parts 1, 2 and 3 of 6 would be nobody's, and the others wait for them for ever.
TEST(ArrayIndex, ArraysWithHolesAreRefusedUnlessTheyArePartsOfAKnownNumber) {
  using testing::HasSubstr;
  for (const char* index : {"3", "7", "8"})
    EXPECT_THAT(refusal_of(task_with_holes(index)),
                testing::AllOf(HasSubstr("3 to 8 have holes"), HasSubstr("--parts COUNT")));
  EXPECT_EQ(part_of(task_with_holes("7"), 10), (Part{7, 10}));
  EXPECT_EQ(part_of(task_with_holes("3"), 10), (Part{3, 10}));
  EXPECT_THAT(refusal_of(task_with_holes("8"), 8), HasSubstr("outside"));
  // 0,2,5, where the step is that of the first two
  Variables uneven = task_with_holes("5");
  uneven["SLURM_ARRAY_TASK_MIN"] = "0";
  uneven["SLURM_ARRAY_TASK_MAX"] = "5";
  uneven["SLURM_ARRAY_TASK_STEP"] = "2";
  EXPECT_THAT(refusal_of(uneven), HasSubstr("have holes"));
  // Without holes the count is that of the others.
  EXPECT_EQ(part_of({{"SLURM_ARRAY_TASK_ID", "25"},
                     {"SLURM_ARRAY_TASK_MIN", "10"},
                     {"SLURM_ARRAY_TASK_MAX", "30"},
                     {"SLURM_ARRAY_TASK_STEP", "5"},
                     {"SLURM_ARRAY_TASK_COUNT", "5"}}),
            (Part{3, 5}));
}

/// What stands behind a key, up to a sign.
std::string behind(const std::string& text, const std::string& key, const char* ends) {
  const std::size_t at = text.find(key);
  if (at == std::string::npos) return "absent: " + key;
  const std::size_t from = text.find_first_not_of(" \"", at + key.size());
  return text.substr(from, text.find_first_of(ends, from) - from);
}

// A pod takes its part from its index, and its threads from its CPU limit (CpuQuota.*), as the page's example sets them.
TEST(ArrayIndex, SomeTasksOfALargerArrayAreItsParts) {
  const auto task = [](const char* index, const char* first, const char* last, const char* count) {
    return Variables{{"SLURM_ARRAY_TASK_ID", index},
                     {"SLURM_ARRAY_TASK_MIN", first},
                     {"SLURM_ARRAY_TASK_MAX", last},
                     {"SLURM_ARRAY_TASK_STEP", "1"},
                     {"SLURM_ARRAY_TASK_COUNT", count}};
  };
  EXPECT_EQ(part_of(task("7", "7", "7", "1"), 32), (Part{7, 32}));  // sbatch --array=7
  EXPECT_EQ(part_of(task("4", "3", "5", "3"), 32), (Part{4, 32}));  // --array=3-5
  EXPECT_EQ(part_of({{"SGE_TASK_ID", "7"},
                     {"SGE_TASK_FIRST", "7"},
                     {"SGE_TASK_LAST", "7"},
                     {"SGE_TASK_STEPSIZE", "1"}},
                    32),
            (Part{7, 32}));
  EXPECT_THAT(refusal_of(task("32", "32", "32", "1"), 32),
              testing::HasSubstr("one less than the task's number"));
}

TEST(ArrayIndex, TheExampleOfKubernetesStatesWhatIsReadOfIt) {
  std::ifstream file(TERRACAST_SOURCE_DIR "/docs/cluster.md");
  std::string page((std::istreambuf_iterator<char>(file)), {});
  const std::size_t at = page.find("apiVersion: batch/v1");
  ASSERT_NE(at, std::string::npos);
  const std::string example = page.substr(at, page.find("\n## ", at) - at);
  const int completions = std::stoi(behind(example, "completions:", "\n"));
  EXPECT_EQ(behind(example, "completionMode:", "\n"), "Indexed");
  EXPECT_EQ(behind(example, "--parts,", "\"]"), std::to_string(completions));
  for (int i = 0; i < completions; ++i)
    EXPECT_EQ(part_of({{"JOB_COMPLETION_INDEX", std::to_string(i)}}, completions),
              (Part{i, completions}));
  EXPECT_GE(std::stoi(behind(example, "limits: {cpu:", "\"")), 1);
}

TEST(ArrayIndex, WhatDoesNotFitIsRefused) {
  using testing::HasSubstr;
  EXPECT_THAT(refusal_of({{"JOB_COMPLETION_INDEX", "0"}}), HasSubstr("--parts"));
  EXPECT_THAT(refusal_of({}, 4), HasSubstr("--shard INDEX/COUNT"));
  EXPECT_THAT(refusal_of({{"PBS_ARRAY_INDEX", "4"}}, 4), HasSubstr("outside"));
  EXPECT_THAT(refusal_of({{"PBS_ARRAY_INDEX", "x"}}, 4), HasSubstr("no number"));
  EXPECT_THAT(refusal_of({{"SLURM_ARRAY_TASK_ID", "1"}}), HasSubstr("SLURM_ARRAY_TASK_MIN"));
  EXPECT_THAT(refusal_of({{"SLURM_ARRAY_TASK_ID", "1"},
                          {"SLURM_ARRAY_TASK_MIN", "0"},
                          {"SLURM_ARRAY_TASK_MAX", "7"},
                          {"SLURM_ARRAY_TASK_STEP", "1"}},
                         9),
              HasSubstr("has 8 tasks"));
}

}  // namespace
}  // namespace terracast::batch
