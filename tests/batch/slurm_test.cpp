#include "batch/slurm.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>

#include "batch/array_index.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/program.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace terracast::batch {
namespace {

namespace fs = std::filesystem;

/// A plan of nothing but shards, each of a stage of the same cost.
Plan plan_of(const std::map<Stage, int>& num_shards, double shard_s = 60.0) {
  Plan plan;
  plan.name = "alps";
  plan.shards.resize(kStages.size());
  plan.memory_bytes = 1024.0 * 1048576.0;
  for (const auto& [stage, count] : num_shards)
    for (int i = 0; i < count; ++i)
      plan.shards[static_cast<std::size_t>(stage)].push_back(
          {.id = {stage, i}, .pieces = {}, .cost = {.cpu_s = shard_s}});
  return plan;
}

std::string refusal_of(const Plan& plan, const fs::path& job, const SlurmOptions& options) {
  try {
    slurm_script(plan, job, options);
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), core::ErrorKind::Usage);
    return error.what();
  }
  return "";
}

/// An environment variable for as long as this lives.
class Variable {
 public:
  Variable(std::string name, const std::string& value) : name_(std::move(name)) {
    if (const char* const before = std::getenv(name_.c_str())) before_ = before;
    ::setenv(name_.c_str(), value.c_str(), 1);
  }
  ~Variable() {
    if (before_)
      ::setenv(name_.c_str(), before_->c_str(), 1);
    else
      ::unsetenv(name_.c_str());
  }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  std::string name_;
  std::optional<std::string> before_;
};

std::vector<std::string> lines_of(const fs::path& file) {
  std::ifstream stream(file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

void write_executable(const fs::path& file, const std::string& text) {
  core::write_file(file, text);
  fs::permissions(file, fs::perms::owner_all);
}

/// What an sbatch was given.
struct Submitted {
  std::vector<std::string> arguments;
  fs::path task;  ///< the script on its input

  /// Of "--name=value"; the last counts, as with sbatch.
  std::string option(const std::string& name) const {
    std::string value = "(not given)";
    for (const std::string& argument : arguments)
      if (argument.starts_with(name + "=")) value = argument.substr(name.size() + 1);
    return value;
  }
  int num_tasks() const {
    const std::string array = option("--array");
    EXPECT_TRUE(array.starts_with("0-")) << array;
    return std::stoi(array.substr(2)) + 1;
  }
};

/// Stands in PATH for Slurm, and records what it is asked.
class FakeSlurm {
 public:
  explicit FakeSlurm(const test::ScratchFolder& scratch)
      : record_(scratch / "record"),
        path_("PATH", (scratch / "bin").string() + ":" + std::getenv("PATH")),
        record_variable_("RECORD", record_.string()) {
    fs::create_directories(record_);
    write_executable(
        scratch / "bin/sbatch",
        "#!/bin/sh\n"
        "n=$(($(cat \"$RECORD/count\" 2>/dev/null || echo 0) + 1))\n"
        "echo $n >\"$RECORD/count\"\n"
        "for argument in \"$@\"; do printf '%s\\n' \"$argument\"; done >\"$RECORD/$n.arguments\"\n"
        "cat >\"$RECORD/$n.task\"\n"
        "if [ \"$n\" = \"${REFUSED:-}\" ]; then echo 'sbatch: error: no' >&2; exit 1; fi\n"
        "echo \"$((100 + n));a_cluster\"\n");
    write_executable(scratch / "bin/scancel", "#!/bin/sh\necho \"$@\" >>\"$RECORD/cancelled\"\n");
  }

  /// Runs a script as `batch submit` does.
  test::ProgramResult run(const std::string& script) const {
    const fs::path file = record_ / "submit.sh";
    core::write_file(file, script);
    return test::run_command("/bin/sh", {file.string()});
  }

  std::vector<Submitted> submitted() const {
    std::vector<Submitted> all;
    for (int n = 1; fs::exists(record_ / (std::to_string(n) + ".task")); ++n)
      all.push_back({.arguments = lines_of(record_ / (std::to_string(n) + ".arguments")),
                     .task = record_ / (std::to_string(n) + ".task")});
    return all;
  }
  std::vector<std::string> cancelled() const { return lines_of(record_ / "cancelled"); }

 private:
  fs::path record_;
  Variable path_;
  Variable record_variable_;
};

/// The arguments of the program when a task runs.
std::vector<std::string> arguments_in_task(const Submitted& array, int task,
                                           const fs::path& recorded) {
  const Variable index("SLURM_ARRAY_TASK_ID", std::to_string(task));
  const auto ended = test::run_command("/bin/sh", {array.task.string()});
  EXPECT_EQ(ended.status, 0) << ended.output;
  return lines_of(recorded);
}

std::string argument_after(const std::vector<std::string>& arguments, const std::string& name) {
  const auto found = std::find(arguments.begin(), arguments.end(), name);
  return found == arguments.end() || found + 1 == arguments.end() ? "(not given)" : *(found + 1);
}

/// A name of a log as Slurm reads it, by the manual of sbatch ("filename pattern").
std::string log_name(const std::string& pattern, const std::string& job, const std::string& task) {
  std::string name;
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    if (pattern[i] != '%') {
      name += pattern[i];
      continue;
    }
    const char field = pattern.at(++i);
    EXPECT_THAT(field, testing::AnyOf('%', 'A', 'a')) << pattern;
    name += field == '%' ? "%" : field == 'A' ? job : task;
  }
  return name;
}

TEST(Slurm, PartsOfARowLieSideBySideAndDifferByOneAtMost) {
  for (int num_things = 0; num_things <= 40; ++num_things)
    for (int num_parts = 1; num_parts <= 45; ++num_parts) {
      int end = 0;
      for (int part = 0; part < num_parts; ++part) {
        const int begin = part_begin(static_cast<std::size_t>(num_things), part, num_parts);
        EXPECT_EQ(begin, end);
        end = part_begin(static_cast<std::size_t>(num_things), part + 1, num_parts);
        EXPECT_GE(end - begin, num_things / num_parts);
        EXPECT_LE(end - begin, (num_things + num_parts - 1) / num_parts);
      }
      EXPECT_EQ(end, num_things);
    }
}

TEST(Slurm, ShardsAreBundledToTasksOfTheWantedTime) {
  const Plan plan = plan_of({{Stage::Render, 100}, {Stage::Merge, 1}});  // 100 minutes in all
  EXPECT_EQ(num_tasks(plan, Stage::Render, {.task_min = 30.0}), 4);
  EXPECT_EQ(num_tasks(plan, Stage::Render, {.num_cpus = 2, .task_min = 30.0}), 2);
  EXPECT_EQ(num_tasks(plan, Stage::Render, {.num_cpus = 64, .task_min = 30.0}), 1);
  EXPECT_EQ(num_tasks(plan, Stage::Render, {.task_min = 0.1}), 100) << "no task without a shard";
  EXPECT_EQ(num_tasks(plan, Stage::Render, {.task_min = 1.0, .max_tasks = 7}), 7);
  EXPECT_EQ(num_tasks(plan, Stage::Merge, {.task_min = 30.0}), 1);
  EXPECT_EQ(num_tasks(plan, Stage::Export, {.task_min = 30.0}), 0);
}

TEST(Slurm, EachStageWaitsForAllArraysOfTheOneBeforeAndItsTasksTakeEachPartOnce) {
  const test::ScratchFolder scratch;
  // What a shell, sbatch or its log names could take for something else.
  for (const char* name : {"a b'c", "100%A %% %", "$(touch gone) `id` \"$HOME\"", "-e *;&|<>#~!",
                           "END_OF_TASK", "caf\u00e9\t\x01"}) {
    SCOPED_TRACE(name);
    fs::remove_all(scratch / "record");
    const FakeSlurm slurm(scratch);
    const fs::path job = scratch / name;
    const fs::path program = scratch / (std::string(name) + " program");
    const fs::path recorded = scratch / "arguments";
    write_executable(program,
                     "#!/bin/sh\nfor argument in \"$@\"; do printf '%s\\n' \"$argument\"; "
                     "done >'" +
                         recorded.string() + "'\n");
    Plan plan =
        plan_of({{Stage::Tile, 3}, {Stage::Render, 12}, {Stage::Export, 1}, {Stage::Merge, 1}});
    plan.name = name;
    const SlurmOptions options{.program = program,
                               .partition = name,
                               .num_cpus = 3,
                               .task_min = 0.1,
                               .max_array_size = 5,
                               .claims = {.lease_s = 7.5, .max_tries = 9},
                               .arguments = {"--comment=" + std::string(name)}};
    const std::string script = slurm_script(plan, job, options);
    for (const char* shell : {"sh", "dash", "bash"})
      if (const auto found = core::find_program(shell)) {
        core::write_file(scratch / "script.sh", script);
        const auto read =
            test::run_command(found->string(), {"-n", (scratch / "script.sh").string()});
        EXPECT_EQ(read.status, 0) << shell << ": " << read.output;
      }
    const auto run = slurm.run(script);
    ASSERT_EQ(run.status, 0) << run.output;
    EXPECT_EQ(run.output, "tile 101\nrender 102\nrender 103\nrender 104\nexport 105\nmerge 106\n");
    EXPECT_THAT(slurm.cancelled(), testing::IsEmpty());

    const std::vector<Submitted> arrays = slurm.submitted();
    ASSERT_EQ(arrays.size(), 6U);
    std::vector<std::string> dependencies;
    std::vector<int> sizes;
    std::map<std::string, std::vector<std::string>> parts;
    for (const Submitted& array : arrays) {
      dependencies.push_back(array.option("--dependency"));
      sizes.push_back(array.num_tasks());
      EXPECT_EQ(array.option("--chdir"), job.string());
      EXPECT_EQ(array.option("--partition"), name);
      EXPECT_EQ(array.option("--comment"), name);
      EXPECT_EQ(array.option("--cpus-per-task"), "3");
      EXPECT_EQ(array.option("--open-mode"), "append");
      EXPECT_EQ(array.option("--signal"), "B:USR1@120");
      EXPECT_THAT(array.arguments, testing::Contains("--requeue"));
      std::string stage;
      for (int task = 0; task < array.num_tasks(); ++task) {
        const auto arguments = arguments_in_task(array, task, recorded);
        ASSERT_GE(arguments.size(), 3U);
        EXPECT_EQ(arguments[0], "batch");
        EXPECT_EQ(arguments[1], "run");
        EXPECT_EQ(arguments[2], job.string());
        EXPECT_EQ(argument_after(arguments, "--threads"), "3");
        EXPECT_EQ(argument_after(arguments, "--lease-s"), "7.5");
        EXPECT_EQ(argument_after(arguments, "--max-tries"), "9");
        EXPECT_THAT(arguments, testing::IsSupersetOf({"--requeue", "--needs"}));
        stage = argument_after(arguments, "--stage");
        parts[stage].push_back(argument_after(arguments, "--shard"));
      }
      EXPECT_EQ(array.option("--job-name"), std::string(name) + "-" + stage);
      EXPECT_EQ(log_name(array.option("--output"), "71", "4"),
                (job / "logs" / (stage + "-71_4.log")).string());
    }
    EXPECT_THAT(dependencies,
                testing::ElementsAre("(not given)", "afterany:101", "afterany:101", "afterany:101",
                                     "afterany:102:103:104", "afterany:105"));
    EXPECT_THAT(sizes, testing::ElementsAre(3, 5, 5, 2, 1, 1));
    std::vector<std::string> twelve;
    for (int i = 0; i < 12; ++i) twelve.push_back(std::to_string(i) + "/12");
    EXPECT_EQ(parts["tile"], (std::vector<std::string>{"0/3", "1/3", "2/3"}));
    EXPECT_EQ(parts["export"], std::vector<std::string>{"0/1"});
    EXPECT_EQ(parts["render"], twelve);
    EXPECT_EQ(parts["merge"], std::vector<std::string>{"0/1"});
    EXPECT_TRUE(fs::is_directory(job / "logs"));
  }
  EXPECT_FALSE(fs::exists("gone"));
}

TEST(Slurm, WhereOneArrayIsRefusedThoseBeforeAreTakenBack) {
  const test::ScratchFolder scratch;
  const FakeSlurm slurm(scratch);
  const Variable refused("REFUSED", "3");
  const Plan plan = plan_of({{Stage::Tile, 1}, {Stage::Render, 9}, {Stage::Export, 1}});
  const auto run = slurm.run(slurm_script(plan, scratch / "job", {.program = "/bin/true"}));
  EXPECT_EQ(run.status, 1) << "sbatch's own";
  EXPECT_THAT(run.output, testing::HasSubstr("sbatch: error: no"));
  EXPECT_EQ(slurm.submitted().size(), 3U) << "none after it";
  EXPECT_THAT(slurm.cancelled(), testing::ElementsAre("101 102"));
}

TEST(Slurm, TimeAndMemoryOfATaskFollowFromThePlanUnlessTheyAreGiven) {
  const test::ScratchFolder scratch;
  const auto only_array = [&](const Plan& plan, const SlurmOptions& options) {
    fs::remove_all(scratch / "record");
    const FakeSlurm slurm(scratch);
    EXPECT_EQ(slurm.run(slurm_script(plan, scratch / "job", options)).status, 0);
    return slurm.submitted().at(0);
  };
  const SlurmOptions plain{.program = "/bin/true"};
  // One and a half times the gibibyte of the plan; three times the 30 minutes of all three shards.
  const Submitted of_plan = only_array(plan_of({{Stage::Render, 3}}, 600.0), plain);
  EXPECT_EQ(of_plan.option("--mem"), "1536M");
  EXPECT_EQ(of_plan.option("--time"), "90");
  // Of three shards of 100 minutes each two fall to one of the two tasks.
  SlurmOptions few = plain;
  few.max_tasks = 2;
  EXPECT_EQ(only_array(plan_of({{Stage::Render, 3}}, 6000.0), few).option("--time"), "600");
  few.num_cpus = 4;
  EXPECT_EQ(only_array(plan_of({{Stage::Render, 3}}, 6000.0), few).option("--time"), "150");
  EXPECT_EQ(only_array(plan_of({{Stage::Render, 3}}), plain).option("--time"), "30") << "at least";
  SlurmOptions given = plain;
  given.time_limit_min = 2.5;
  given.memory_bytes = 3e9;
  const Submitted as_given = only_array(plan_of({{Stage::Render, 3}}), given);
  EXPECT_EQ(as_given.option("--time"), "3");
  EXPECT_EQ(as_given.option("--mem"), "2862M") << "3e9 / 2^20, rounded up";
  // Slurm may warn a minute early: of three minutes a task has one and a quarter at least.
  EXPECT_EQ(as_given.option("--signal"), "B:USR1@45");
}

TEST(Slurm, WhatSlurmCannotTakeIsRefused) {
  const Plan plan = plan_of({{Stage::Render, 3}});
  const SlurmOptions plain{.program = "/bin/true"};
  EXPECT_EQ(refusal_of(plan, "/job", plain), "");
  EXPECT_THAT(refusal_of(plan, "/a\nb", plain), testing::HasSubstr("on one line"));
  EXPECT_THAT(refusal_of(plan, "/a\\b", plain), testing::HasSubstr("/a\\b"));
  SlurmOptions wrong = plain;
  wrong.program = "/a\nrm -r";
  EXPECT_THAT(refusal_of(plan, "/job", wrong), testing::HasSubstr("on one line"));
  wrong = plain;
  wrong.arguments = {"--account=x", "--comment=\n"};
  EXPECT_THAT(refusal_of(plan, "/job", wrong), testing::HasSubstr("--sbatch"));
  wrong = plain;
  wrong.time_limit_min = 1.0;
  EXPECT_THAT(refusal_of(plan, "/job", wrong), testing::HasSubstr("--time-minutes 1"));
  wrong = plain;
  wrong.max_array_size = 1;
  EXPECT_THAT(refusal_of(plan, "/job", wrong), testing::HasSubstr("--max-array-size 1"));
  Plan named = plan;
  named.name = "two\nlines";
  EXPECT_THAT(refusal_of(named, "/job", plain), testing::HasSubstr("on one line"));
}

}  // namespace
}  // namespace terracast::batch
