#include "batch/array_index.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

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
