#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>
#include <thread>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/json.h"
#include "tests/e2e/batch_job.h"
#include "tests/e2e/started_program.h"
#include "tests/e2e/tiny_batch.h"
#include "tests/support/folder_compare.h"
#include "tests/support/made_once.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// Shards so small that each piece of a stage is one.
constexpr const char* kSmallShards = "0.002";

/// A planned job in `folder`.
fs::path planned(const ScratchFolder& scratch, const std::string& name,
                 const std::string& shard_minutes = kSmallShards) {
  const auto config = write_text(scratch / "batch.toml", tiny_batch_text());
  const fs::path job = scratch / name;
  const auto plan = run_program({"batch", "plan", config.string(), "--out", job.string(),
                                 "--shard-minutes", shard_minutes, "-q"});
  EXPECT_EQ(plan.status, 0) << plan.output;
  return job;
}

/// A copy, in `scratch`, of the planned job after one worker ran it to its end on one thread.
fs::path complete_job(const ScratchFolder& scratch, const std::string& name) {
  const std::string text = tiny_batch_text();
  const auto make = [&](const fs::path& folder) {
    const auto config = write_text(folder / "batch.toml", text).string();
    const std::string job = (folder / "job").string();
    const auto plan =
        run_program({"batch", "plan", config, "--out", job, "--shard-minutes", kSmallShards, "-q"});
    EXPECT_EQ(plan.status, 0) << plan.output;
    const auto run = run_program({"batch", "run", job, "--threads", "1", "-q"});
    EXPECT_EQ(run.status, 0) << run.output;
  };
  const fs::path job = scratch / name;
  copy_job(made_once("tiny_batch", text + kSmallShards, make) / "job", job);
  return job;
}

core::Json status_of(const fs::path& job) {
  const auto status = run_program({"batch", "status", job.string(), "--json"});
  EXPECT_EQ(status.status, 0) << status.output;
  return core::Json::parse(status.output, "status");
}

std::string checksums_of(const fs::path& job) {
  return core::read_text_file(job / "dataset/SHA256SUMS");
}

/// What sha256sum says of a job's dataset.
int check_sums(const fs::path& job) {
  return run_command("/bin/sh", {"-c", "cd \"$0\" && sha256sum -c --quiet SHA256SUMS",
                                 (job / "dataset").string()})
      .status;
}

/// The only captures of a run.
fs::path captures_of(const fs::path& job, const std::string& run) {
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator(job / "capture" / run))
    folders.push_back(entry.path());
  EXPECT_EQ(folders.size(), 1U) << run;
  return folders.at(0);
}

/// The value that a run's line of the plan gives a key.
std::string value_in_plan(const core::Json& run, const std::string& key) {
  std::smatch match;
  const std::string changes = run.at("changes").string();
  EXPECT_TRUE(std::regex_search(changes, match, std::regex(key + " = ([^,]*)"))) << changes;
  return match[1];
}

TEST(Batch, EachRunIsWhatTheProgramMakesOfItsConfigAlone) {
  const ScratchFolder scratch;
  const fs::path job = complete_job(scratch, "job");
  EXPECT_TRUE(status_of(job).at("complete").boolean());
  EXPECT_EQ(check_sums(job), 0);
  EXPECT_TRUE(fs::is_empty(job / "attempts"));

  const auto alone =
      write_text(scratch / "alone.toml",
                 tiny_batch_text().substr(0, tiny_batch_text().find("[[sweep.list]]")));
  std::istringstream lines(core::read_text_file(job / "plan/0001/runs.jsonl"));
  int num_runs = 0;
  for (std::string line; std::getline(lines, line); ++num_runs) {
    const core::Json planned_run = core::Json::parse(line, "runs.jsonl");
    const std::string name = planned_run.at("name").string();
    const fs::path out = scratch / ("alone-" + name);
    std::vector<std::string> arguments = {"run", alone.string(), "--out", out.string(), "-q"};
    for (const char* key : {"world.origin_lat_deg", "world.name", "conditions.exposure"}) {
      arguments.emplace_back("--set");
      arguments.push_back(std::string(key) + "=" + value_in_plan(planned_run, key));
    }
    const auto single = run_program(arguments);
    ASSERT_EQ(single.status, 0) << single.output;
    EXPECT_EQ(first_difference(out / "capture", captures_of(job, name)), "") << name;
    for (const char* format : {"colmap", "kitti"})
      EXPECT_EQ(first_difference(out / "export" / format, job / "dataset" / format / name), "")
          << name << ", " << format;
  }
  EXPECT_EQ(num_runs, 2);
}

TEST(Batch, OtherShardsPartsThreadsAndCompanyMakeTheSameDataset) {
  const ScratchFolder scratch;
  const fs::path first = complete_job(scratch, "first");

  const fs::path parts = planned(scratch, "parts", "1");
  for (const char* stage : {"tile", "render", "export", "validate", "merge"})
    for (const char* part : {"2/3", "0/3", "1/3"}) {
      const auto run = run_program({"batch", "run", parts.string(), "--stage", stage, "--shard",
                                    part, "--threads", "2", "-q"});
      ASSERT_EQ(run.status, 0) << stage << ' ' << part << ": " << run.output;
    }
  EXPECT_EQ(checksums_of(first), checksums_of(parts));

  const fs::path company = planned(scratch, "company");
  std::vector<std::thread> workers;
  std::vector<ProgramResult> results(3);
  for (ProgramResult& result : results)
    workers.emplace_back([&] {
      result = run_program({"batch", "run", company.string(), "--jobs",
                            &result == results.data() ? "2" : "1", "--threads", "1", "-q"});
    });
  for (std::thread& worker : workers) worker.join();
  for (const ProgramResult& result : results) EXPECT_EQ(result.status, 0) << result.output;
  EXPECT_EQ(checksums_of(first), checksums_of(company));
  EXPECT_TRUE(status_of(company).at("complete").boolean());
}

TEST(Batch, AWorkerThatIsAskedToEndSaysSoAndAnotherGoesOn) {
  const ScratchFolder scratch;
  const fs::path job = planned(scratch, "job");
  int num_interrupted = 0;
  ProgramResult run;
  for (int i = 0; i < 30; ++i) {
    using Clock = std::chrono::steady_clock;
    std::optional<Clock::time_point> at_work;
    run = run_program(
        {"batch", "run", job.string(), "--threads", "1", "-q"}, {.terminate_when = [&] {
          const fs::path attempts = job / "attempts";
          if (!at_work && fs::exists(attempts) && !fs::is_empty(attempts)) at_work = Clock::now();
          // Later each time: somebody else may have the machine's cores.
          return at_work && Clock::now() - *at_work > std::chrono::milliseconds(200 * i);
        }});
    if (run.status == 0) break;
    ++num_interrupted;
    ASSERT_EQ(run.status, 75) << run.output;
    EXPECT_THAT(run.output, HasSubstr("run the same command again"));
  }
  EXPECT_EQ(run.status, 0);
  EXPECT_GE(num_interrupted, 2);
  EXPECT_EQ(check_sums(job), 0);
  EXPECT_TRUE(fs::is_empty(job / "attempts")) << "temporary folders go with their attempt";
  EXPECT_EQ(status_of(job).at("failures").size(), 0U) << "to be asked to end is no failure";
}

/// The processes that a process has begun.
std::set<int> children_of(pid_t process) {
  std::set<int> children;
  std::error_code ended;
  for (const auto& thread : fs::directory_iterator(fmt::format("/proc/{}/task", process), ended)) {
    std::ifstream file(thread.path() / "children");
    children.insert(std::istream_iterator<int>(file), std::istream_iterator<int>());
  }
  return children;
}

/// The processes that hold shards now, by the claims.
std::set<int> workers_of(const fs::path& job) {
  std::set<int> workers;
  std::error_code missing;
  for (const auto& entry : fs::recursive_directory_iterator(job / "state/0001/claims", missing)) {
    const std::string name = entry.path().filename();
    if (!entry.is_regular_file(missing) || name.ends_with(".end") || name.starts_with("."))
      continue;
    try {
      const std::string process = core::Json::read(entry.path()).at("process").string();
      const int number = std::stoi(process.substr(process.find('-') + 1));
      if (::kill(number, 0) == 0) workers.insert(number);  // claims of the dead stay for a while
    } catch (const core::Error&) {
      // Taken back while it was read.
    }
  }
  return workers;
}

TEST(Batch, APoolDoesWhatItsPartNeedsOfOthers) {
  const ScratchFolder scratch;
  const fs::path job = planned(scratch, "job");
  const auto both =
      run_program({"batch", "run", job.string(), "--jobs", "2", "--only", "tile/0", "-q"});
  EXPECT_EQ(both.status, 2) << both.output;
  EXPECT_THAT(both.output, HasSubstr("--jobs excludes --only"));
  EXPECT_EQ(status_of(job).at("stages").at("tile").at("done").integer(), 0);

  // Nobody does the other parts.
  const auto part =
      run_program({"batch", "run", job.string(), "--jobs", "2", "--shard", "1/2", "-q"});
  EXPECT_EQ(part.status, 0) << part.output;
  const auto merge = run_program(
      {"batch", "run", job.string(), "--jobs", "2", "--stage", "merge", "--needs", "-q"});
  EXPECT_EQ(merge.status, 0) << merge.output;
  EXPECT_TRUE(status_of(job).at("complete").boolean());
}

TEST(Batch, AWorkerOfAPoolThatIsKilledIsReplaced) {
  const ScratchFolder scratch;
  const fs::path job = planned(scratch, "job");
  ProgramResult run;
  std::thread pool([&] {
    run = run_program({"batch", "run", job.string(), "--jobs", "2", "--threads", "1"});
  });
  int num_killed = 0;
  const auto start = std::chrono::steady_clock::now();
  while (num_killed < 3 && std::chrono::steady_clock::now() - start < std::chrono::seconds(60)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(400));
    const std::set<int> workers = workers_of(job);
    if (!workers.empty() && ::kill(*workers.begin(), SIGKILL) == 0) ++num_killed;
  }
  pool.join();
  EXPECT_EQ(run.status, 0) << run.output;
  EXPECT_EQ(num_killed, 3);
  EXPECT_THAT(run.output, HasSubstr("was ended by signal 9"));
  EXPECT_TRUE(status_of(job).at("complete").boolean());
  EXPECT_EQ(check_sums(job), 0);
  EXPECT_TRUE(fs::is_empty(job / "attempts"));
}

TEST(Batch, WorkersThatMeetANewerPlanEndAndTheNextGoOnWithIt) {
  const ScratchFolder scratch;
  const fs::path job = planned(scratch, "job");
  const auto plan = [&](const fs::path& folder, const std::string& how) {
    const auto planned =
        run_program({"batch", "plan", (scratch / "batch.toml").string(), "--out", folder.string(),
                     "--set", "conditions.color_samples=2", how, "-q"});
    EXPECT_EQ(planned.status, 0) << planned.output;
  };
  StartedProgram pool(TERRACAST_PROGRAM,
                      {"batch", "run", job.string(), "--jobs", "2", "--threads", "1", "-q"}, {},
                      scratch / "pool.log");
  // Once a shard is begun all workers rest until the plan is there, those that have none, too: by and by
  // they would take over what a sleeper holds.
  while (!pool.has_ended() && workers_of(job).empty())
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  const std::set<int> workers = children_of(pool.process());
  EXPECT_EQ(workers.size(), 2U);
  for (const int worker : workers) ::kill(worker, SIGSTOP);
  plan(job, "--update");
  for (const int worker : workers) ::kill(worker, SIGCONT);
  while (!pool.has_ended()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(pool.status(), 75) << pool.output();
  EXPECT_THAT(pool.output(), HasSubstr("there is a newer plan; run the same command again"));
  // A worker that had not read its plan yet may have done all that is left, by the newer one.
  const auto run = run_program({"batch", "run", job.string(), "-q"});
  ASSERT_EQ(run.status, 0) << run.output;
  const fs::path fresh = scratch / "fresh";
  plan(fresh, "--shard-minutes=0.002");
  ASSERT_EQ(run_program({"batch", "run", fresh.string(), "-q"}).status, 0);
  EXPECT_EQ(checksums_of(job), checksums_of(fresh));
}

TEST(Batch, AShardThatCannotBeDoneIsGivenUpAndTheRestGoesOn) {
  const ScratchFolder scratch;
  // Over each world one flies above the ground, and one under it, which is refused.
  const auto config = write_text(
      scratch / "bad.toml",
      tiny_batch_text() +
          "[[sweep.product]]\nkey = \"trajectories.0.centre.height_m\"\nvalues = [-50.0, 250.0]\n");
  const fs::path job = scratch / "job";
  ASSERT_EQ(run_program({"batch", "plan", config.string(), "--out", job.string(), "--shard-minutes",
                         kSmallShards, "--max-tries", "2", "-q"})
                .status,
            0);
  const auto run =
      run_program({"batch", "run", job.string(), "--jobs", "2", "--threads", "1", "-q"});
  EXPECT_EQ(run.status, 1) << run.output;
  EXPECT_THAT(run.output, HasSubstr("terracast batch run " + job.string() + " --only "));
  // A pool passes on what its workers warn of.
  EXPECT_THAT(run.output, testing::ContainsRegex("worker [01]: shard [a-z]+/[0-9]+ failed: "));
  const core::Json status = status_of(job);
  EXPECT_FALSE(status.at("complete").boolean());
  ASSERT_GE(status.at("failures").size(), 1U);
  const core::Json& failure = status.at("failures").at(0);
  EXPECT_EQ(failure.at("tries").integer(), 2);
  EXPECT_TRUE(failure.at("given_up").boolean());
  EXPECT_THAT(failure.at("error").string(), HasSubstr("ground"));
  // The runs that can be made are exported and validated all the same.
  for (const char* name : {"run0001", "run0003"}) {
    EXPECT_TRUE(fs::exists(job / "dataset/kitti" / name / "dataset.json")) << name;
    EXPECT_TRUE(fs::exists(job / "report" / name / "kitti/report.json")) << name;
  }
  EXPECT_FALSE(fs::exists(job / "dataset/SHA256SUMS"));
  EXPECT_THAT(run_program({"batch", "verify", job.string(), "--samples", "0", "-q"}).output,
              HasSubstr("shards are not done yet"));
  // The command that the status gives repeats the failure, with its error.
  const auto repeated =
      run_program({"batch", "run", job.string(), "--only", failure.at("shard").string(), "-q"});
  EXPECT_EQ(repeated.status, 3) << repeated.output;
  EXPECT_THAT(repeated.output, HasSubstr("ground"));

  // And the way that it names has the rest merged.
  const std::string without = R"(sweep.leave_out=["run0000","run0002"])";
  EXPECT_THAT(run_program({"batch", "status", job.string()}).output, HasSubstr(without));
  const auto updated = run_program(
      {"batch", "plan", config.string(), "--out", job.string(), "--update", "--set", without});
  ASSERT_EQ(updated.status, 0) << updated.output;
  EXPECT_THAT(updated.output, HasSubstr(", 1 are to be looked at again")) << "the merge";
  const auto rest = run_program({"batch", "run", job.string()});
  EXPECT_EQ(rest.status, 0) << rest.output;
  EXPECT_THAT(rest.output, HasSubstr("the dataset is in " + (job / "dataset").string()));
  EXPECT_EQ(check_sums(job), 0);
  EXPECT_TRUE(fs::exists(job / "dataset/kitti/run0003"));
  EXPECT_FALSE(fs::exists(job / "dataset/kitti/run0002"));
}

TEST(Batch, AQuotaStopsItCleanly) {
  const ScratchFolder scratch;
  const fs::path job = planned(scratch, "job");
  const auto stopped = run_program({"batch", "run", job.string(), "--quota", "0.01GB", "-q"});
  EXPECT_EQ(stopped.status, 4) << stopped.output;
  EXPECT_THAT(stopped.output, HasSubstr("quota"));
  EXPECT_LE(status_of(job).at("bytes").number(), 10e6);
  // Two that claim at the same time count each other's.
  const fs::path twice = planned(scratch, "twice");
  const auto both = run_program(
      {"batch", "run", twice.string(), "--quota", "0.01GB", "--jobs", "2", "--threads", "1", "-q"});
  EXPECT_EQ(both.status, 4) << both.output;
  EXPECT_THAT(both.output, HasSubstr("quota"));
  EXPECT_LE(status_of(twice).at("bytes").number(), 10e6);
  EXPECT_GE(status_of(twice).at("bytes").number(), 0.5 * status_of(job).at("bytes").number());
  const auto run = run_program({"batch", "run", job.string(), "-q"});
  EXPECT_EQ(run.status, 0) << run.output;
  EXPECT_EQ(check_sums(job), 0);
}

TEST(Batch, DamageIsFoundNamedAndMadeGood) {
  const ScratchFolder scratch;
  const fs::path job = complete_job(scratch, "job");
  const std::string sums = checksums_of(job);
  const auto right = run_program({"batch", "verify", job.string(), "-q"});
  EXPECT_EQ(right.status, 0) << right.output;
  EXPECT_THAT(right.output, HasSubstr("4 frames rendered once more, 0 differ"));

  const std::string damaged = "kitti/run0000/dataset.json";
  write_text(job / "dataset" / damaged, "not what was exported");
  fs::remove(job / "dataset/colmap/run0001/dataset.json");
  write_text(job / "dataset/colmap/run0001/stray.txt", "nobody exported this");
  const auto wrong =
      run_program({"batch", "verify", job.string(), "--samples", "0", "--repair", "-q"});
  EXPECT_EQ(wrong.status, 1) << wrong.output;
  EXPECT_THAT(wrong.output, HasSubstr(damaged + " has changed"));
  EXPECT_THAT(wrong.output, HasSubstr("colmap/run0001/dataset.json is missing"));
  EXPECT_THAT(wrong.output, HasSubstr("colmap/run0001/stray.txt was not exported"));
  ASSERT_EQ(run_program({"batch", "run", job.string(), "-q"}).status, 0);
  EXPECT_EQ(checksums_of(job), sums);
  EXPECT_EQ(check_sums(job), 0);
  EXPECT_EQ(run_program({"batch", "verify", job.string(), "-q"}).status, 0);
}

TEST(Batch, APlanIsWrittenOnceAndADryRunWritesNothing) {
  const ScratchFolder scratch;
  const auto config = write_text(scratch / "batch.toml", tiny_batch_text());
  const fs::path job = scratch / "job";
  const auto dry =
      run_program({"batch", "plan", config.string(), "--out", job.string(), "--dry-run"});
  EXPECT_EQ(dry.status, 0) << dry.output;
  EXPECT_THAT(dry.output, HasSubstr("2 runs, 2 sequences, 8 frames, 2 worlds"));
  EXPECT_FALSE(fs::exists(job));
  ASSERT_EQ(run_program({"batch", "plan", config.string(), "--out", job.string(), "-q"}).status, 0);
  const auto again = run_program({"batch", "plan", config.string(), "--out", job.string(), "-q"});
  EXPECT_EQ(again.status, 2) << again.output;
  EXPECT_THAT(again.output, HasSubstr("--update"));
  const auto nowhere = run_program({"batch", "run", (scratch / "nowhere").string()});
  EXPECT_EQ(nowhere.status, 4) << nowhere.output;
  EXPECT_THAT(nowhere.output, HasSubstr("batch plan"));
  EXPECT_FALSE(fs::exists(scratch / "nowhere"));
  const auto single = run_program({"run", config.string(), "--out", (scratch / "out").string()});
  EXPECT_EQ(single.status, 2) << single.output;
  EXPECT_THAT(single.output, HasSubstr("batch plan"));
}

TEST(Batch, TheForecastOfDiskIsNear) {
  const ScratchFolder scratch;
  const fs::path job = complete_job(scratch, "job");
  const core::Json plan = core::Json::read(job / "plan/0001/plan.json");
  const core::Json status = status_of(job);
  for (const char* stage : {"render", "export"}) {
    const double expected = plan.at("stages").at(stage).at("bytes").number();
    const double written = status.at("stages").at(stage).at("bytes").number();
    // Images of 160 x 120 carry more beside their pixels than those the factors were taken from.
    EXPECT_GT(written, 0.4 * expected) << stage;
    EXPECT_LT(written, 3.0 * expected) << stage;
  }
}

}  // namespace
}  // namespace terracast::test
