#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <thread>

#include "core/json.h"
#include "tests/e2e/tiny_job.h"
#include "tests/support/folder_compare.h"
#include "tests/support/record.h"
#include "tests/support/run_program.h"
#include "tests/support/slurm_cluster.h"
#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using Process = SlurmCluster::Process;
using Task = SlurmCluster::Task;

/// Four flights over a world, 32 frames in all, each of a fifth of a second of a core.
std::string job_text() {
  std::string text = replaced(tiny_job_text(R"(
# All that Croissant wants: nothing is warned of.
[dataset]
url = "https://example.org/four-flights"
creators = ["Somebody"]
date_published = "2026-11-23"
licence = "CC-BY-4.0"

[[sweep.product]]
key = "trajectories.0.radius_m"
values = [200.0, 250.0, 300.0, 350.0]
)"),
                              "finest_spacing_m = 4.0", "finest_spacing_m = 16.0");
  text = replaced(text, "num_frames = 4", "num_frames = 8");
  return replaced(text, "color_samples = 1", "color_samples = 4");
}

std::string plan(const fs::path& config, const fs::path& job, const char* shard_minutes) {
  const auto planned = run_program({"batch", "plan", config.string(), "--out", job.string(),
                                    "--shard-minutes", shard_minutes, "-q"});
  return planned.status == 0 ? "" : planned.output;
}

core::Json status_of(const fs::path& job) {
  const auto status = run_program({"batch", "status", job.string(), "--json"});
  return core::Json::parse(status.output, "batch status --json");
}

std::string text_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

std::string checksums_of(const fs::path& job) { return text_of(job / "dataset/SHA256SUMS"); }

/// A claim to a shard that is not done.
struct Held {
  std::string shard;
  int number = 0;   ///< of the try
  std::string own;  ///< Process::own of who made it
};

/// The claims to shards of a stage, those of which were lost too.
std::vector<Held> held(const fs::path& job, const std::string& stage) {
  std::vector<Held> all;
  const fs::path state = job / "state/0001";
  std::error_code missing;
  for (const auto& entry : fs::directory_iterator(state / "claims" / stage, missing)) {
    const std::string name = entry.path().filename();
    const std::string shard = name.substr(0, 6);
    if (name.size() < 8 || name[6] != '.' || name.ends_with(".end") ||
        fs::exists(state / "done" / stage / "000" / (shard + ".json")))
      continue;
    const std::string text = text_of(entry.path());
    const auto begin = text.find("\"process\": \"");
    const auto dash = text.find('-', begin);
    if (begin == std::string::npos || dash == std::string::npos) continue;  // taken back just now
    all.push_back(
        {shard, std::stoi(name.substr(7)), text.substr(dash + 1, text.find('"', dash) - dash - 1)});
  }
  return all;
}

std::optional<Held> held_by(const fs::path& job, const std::string& stage, const Process& process) {
  for (const Held& claim : held(job, stage))
    if (claim.own == process.own) return claim;
  return std::nullopt;
}

bool is_of_stage(const Process& process, const std::string& stage) {
  return process.command.find("batch run ") != std::string::npos &&
         process.command.find("--stage " + stage + " ") != std::string::npos;
}

/// Whether a process stands still, for now or for ever.
bool is_still(const Process& process) {
  const std::string record = text_of(fs::path("/proc") / std::to_string(process.number) / "stat");
  return record.empty() || record.find(") T ") != std::string::npos ||
         record.find(") Z ") != std::string::npos;
}

bool is_there(const SlurmCluster& cluster, const Process& process) {
  const auto all = cluster.processes();
  return std::any_of(all.begin(), all.end(), [&](const Process& other) {
    return other.number == process.number && other.own == process.own;
  });
}

void stop(const Process& process) {
  ::kill(process.number, SIGSTOP);
  while (!is_still(process)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

/// A process of a stage, stopped in the middle of a shard, so that what is done to it comes then. It
/// gets there in small steps: on a busy machine it could be past its work between two looks.
/// shard   the one; empty: any
Process stopped_at_work(
    const SlurmCluster& cluster, const fs::path& job, const std::string& stage,
    const std::function<bool(const Process&)>& is_wanted = [](const Process&) { return true; },
    const std::string& shard = "") {
  constexpr auto kStep = std::chrono::milliseconds(10);
  std::optional<Process> stopped;
  cluster.wait_until("a task of " + stage + " is in the middle of a shard", [&] {
    for (const Process& process : cluster.processes()) {
      if (!is_of_stage(process, stage) || !is_wanted(process)) continue;
      for (stop(process); is_there(cluster, process); stop(process)) {
        const std::optional<Held> claim = held_by(job, stage, process);
        if (claim && (shard.empty() || claim->shard == shard)) {
          stopped = process;
          return true;
        }
        ::kill(process.number, SIGCONT);
        std::this_thread::sleep_for(kStep);
      }
    }
    return false;
  });
  return *stopped;
}

/// How often each shard was done, as the logs of a job tell, by log.
std::map<std::string, std::map<std::string, int>> times_done(const fs::path& job) {
  std::map<std::string, std::map<std::string, int>> times;
  for (const auto& entry : fs::directory_iterator(job / "logs")) {
    std::stringstream lines(text_of(entry.path()));
    for (std::string line; std::getline(lines, line);) {
      const auto begin = line.find("shard ");
      const auto end = line.find(" is done, ");
      if (begin == std::string::npos || end == std::string::npos) continue;
      ++times[line.substr(begin + 6, end - begin - 6)][entry.path().filename()];
    }
  }
  return times;
}

/// A job that is complete holds each shard once, and nothing else.
void expect_complete(const fs::path& job) {
  const core::Json status = status_of(job);
  EXPECT_TRUE(status.at("complete").boolean()) << status.text();
  EXPECT_EQ(status.at("checks_failed").integer(), 0);
  EXPECT_EQ(status.at("failures").size(), 0U);
  for (const auto& [stage, counts] : status.at("stages").members()) {
    std::int64_t num_records = 0;
    for (const auto& entry : fs::recursive_directory_iterator(job / "state/0001/done" / stage))
      num_records += entry.is_regular_file() ? 1 : 0;
    EXPECT_EQ(num_records, counts.at("shards").integer()) << stage;
    EXPECT_EQ(counts.at("done").integer(), counts.at("shards").integer()) << stage;
    EXPECT_TRUE(held(job, stage).empty()) << stage;
  }
  EXPECT_TRUE(fs::is_empty(job / "attempts"));
  const auto check =
      run_command("/bin/sh", {"-c", "cd \"$1\" && sha256sum --check --strict --quiet SHA256SUMS",
                              "sh", (job / "dataset").string()});
  EXPECT_EQ(check.status, 0) << check.output;
  // A line for each file, and none twice.
  std::map<std::string, int> times_listed;
  std::stringstream lines(checksums_of(job));
  for (std::string line; std::getline(lines, line);) ++times_listed[line.substr(66)];
  std::map<std::string, int> once;
  for (const auto& [file, bytes] : folder_bytes(job / "dataset"))
    if (file != "SHA256SUMS") once[file] = 1;
  EXPECT_EQ(times_listed, once);
}

int num_shards(const fs::path& job) {
  int count = 0;
  const core::Json status = status_of(job);
  for (const auto& [stage, counts] : status.at("stages").members())
    count += static_cast<int>(counts.at("shards").integer());
  return count;
}

/// A task is killed, one is put back into the queue, and a node dies with all that runs on it.
struct Losses {
  Process killed;
  Held left;  ///< by the killed one
  Process requeued;
};
Losses lose_tasks_and_a_node(SlurmCluster& cluster, const fs::path& job) {
  Losses losses;
  const Process lost = stopped_at_work(cluster, job, "render",
                                       [](const Process& process) { return process.node == "n2"; });
  losses.killed = stopped_at_work(cluster, job, "render",
                                  [](const Process& process) { return process.node == "n1"; });
  losses.left = *held_by(job, "render", losses.killed);
  ::kill(losses.killed.number, SIGKILL);
  losses.requeued = stopped_at_work(cluster, job, "render", [&](const Process& process) {
    return process.node == "n1" && process.task() != losses.killed.task();
  });
  cluster.command("scontrol", {"requeue", losses.requeued.task()});
  ::kill(losses.requeued.number, SIGCONT);
  cluster.kill_node("n2");
  EXPECT_FALSE(is_there(cluster, lost));
  EXPECT_TRUE(held_by(job, "render", lost)) << "it died in the middle of a shard";
  cluster.wait_until("Slurm sees that the node is dead",
                     [&] { return cluster.num_ends("NODE_FAIL") > 0; });
  cluster.start_node("n2");
  return losses;
}

/// A task loses its slurmd: Slurm starts a twin of it on the other node, and both work on a shard.
/// returns   the first of the two
Process make_a_twin(SlurmCluster& cluster, const fs::path& job) {
  const Process first = stopped_at_work(
      cluster, job, "render", [](const Process& process) { return process.num_restarts > 0; });
  const Held claim = *held_by(job, "render", first);
  cluster.kill_slurmd(first.node);
  cluster.command("scontrol",
                  {"update", "NodeName=" + first.node, "State=DOWN", "Reason=out_of_sight"});
  const Process twin = stopped_at_work(
      cluster, job, "render",
      [&](const Process& process) {
        return process.task() == first.task() && process.number != first.number;
      },
      claim.shard);
  EXPECT_NE(twin.node, first.node);
  EXPECT_EQ(twin.num_restarts, first.num_restarts + 1);
  EXPECT_TRUE(is_there(cluster, first)) << "both are there at once";
  EXPECT_EQ(held_by(job, "render", twin)->number, claim.number + 1);
  ::kill(first.number, SIGCONT);
  ::kill(twin.number, SIGCONT);
  cluster.wait_until("the twins have ended",
                     [&] { return !is_there(cluster, first) && !is_there(cluster, twin); });
  cluster.start_node(first.node);
  return first;
}

TEST(Slurm, ThroughADeadNodeAKilledTaskARequeuedOneAndATwinAJobGetsToTheBytesOfALocalRun) {
  TERRACAST_NEEDS_FULL();
  TERRACAST_NEEDS_SLURM();
  const ScratchFolder scratch;
  const fs::path config = write_text(scratch / "job.toml", job_text());

  const fs::path alone = scratch / "alone";
  ASSERT_EQ(plan(config, alone, "0.15"), "");
  const auto ran = run_program({"batch", "run", alone.string(), "--threads", "1", "-q"});
  ASSERT_EQ(ran.status, 0) << ran.output;
  expect_complete(alone);

  const fs::path shared = scratch / "shared";
  ASSERT_EQ(plan(config, shared, "0.08"), "");
  EXPECT_NE(num_shards(shared), num_shards(alone));
  const auto three =
      run_command("/bin/sh", {"-c",
                              "for part in 0 1 2; do"
                              "  \"$0\" batch run \"$1\" --shard $part/3 --needs --threads 2 -q & "
                              "done; wait",
                              TERRACAST_PROGRAM, shared.string()});
  EXPECT_EQ(three.output, "");
  expect_complete(shared);
  EXPECT_EQ(checksums_of(shared), checksums_of(alone));

  // A name that a shell and Slurm's names of logs could take for something else.
  const fs::path job = scratch / "a b'c %A $HOME";
  ASSERT_EQ(plan(config, job, "0.02"), "");
  EXPECT_GE(num_shards(job), 32);
  SlurmCluster cluster;
  const auto submitted =
      run_program({"batch", "submit", job.string(), "--slurm", "--memory", "1GB", "--task-minutes",
                   "0.2", "--max-array-size", "5", "--lease-s", "8"});
  ASSERT_EQ(submitted.status, 0) << submitted.output;
  const Losses losses = lose_tasks_and_a_node(cluster, job);
  const Process first = make_a_twin(cluster, job);
  cluster.wait_until(
      "the job is through the queue", [&] { return cluster.is_empty(); }, 300.0);

  expect_complete(job);
  EXPECT_EQ(checksums_of(job), checksums_of(alone));
  EXPECT_EQ(first_difference(alone / "dataset", job / "dataset"), "");
  for (const Task& task : cluster.tasks())
    EXPECT_EQ(task.state, task.name() == losses.killed.task() ? "FAILED" : "COMPLETED")
        << task.name();
  EXPECT_THAT(text_of(job / "logs" / ("render-" + losses.requeued.task() + ".log")),
              testing::HasSubstr("stopped on request"));
  // What the killed task left was done by tasks of the next stage; twins alone do a shard twice.
  const auto times = times_done(job);
  constexpr int kSilent = 1;  // a second task may have died on the node before it told of a shard
  EXPECT_GE(static_cast<int>(times.size()), num_shards(job) - kSilent);
  for (const auto& [shard, logs] : times) {
    EXPECT_EQ(logs.size(), 1U) << shard << " was done by several tasks";
    const auto& [log, count] = *logs.begin();
    if (log != "render-" + first.task() + ".log") {
      EXPECT_EQ(count, 1) << shard << " was done again in " << log;
    }
    if (shard == "render/" + std::to_string(std::stoi(losses.left.shard))) {
      EXPECT_TRUE(log.starts_with("export-")) << log;
    }
  }
}

TEST(Slurm, ATaskWhoseTimeIsNearlyUpGoesBackIntoTheQueueAndACancelledOneStaysAway) {
  TERRACAST_NEEDS_SLURM();
  const ScratchFolder scratch;
  const fs::path config = write_text(scratch / "job.toml", job_text());
  const fs::path job = scratch / "job";
  ASSERT_EQ(plan(config, job, "0.02"), "");
  SlurmCluster cluster;
  const auto submitted =
      run_program({"batch", "submit", job.string(), "--slurm", "--memory", "1GB"});
  ASSERT_EQ(submitted.status, 0) << submitted.output;

  // As Slurm does before a limit, which has whole minutes.
  const Process warned = stopped_at_work(cluster, job, "tile");
  cluster.command("scancel", {"--signal=USR1", "--batch", warned.task()});
  ::kill(warned.number, SIGCONT);
  const Process again = stopped_at_work(cluster, job, "tile", [&](const Process& process) {
    return process.task() == warned.task() && process.num_restarts == 1;
  });
  EXPECT_FALSE(is_there(cluster, warned));
  EXPECT_THAT(text_of(job / "logs" / ("tile-" + warned.task() + ".log")),
              testing::HasSubstr("stopped on request"));

  cluster.command("scancel", {"--user=root"});
  ::kill(again.number, SIGCONT);
  cluster.wait_until("all tasks have ended", [&] {
    const std::vector<Task> tasks = cluster.tasks();
    return cluster.processes().empty() &&
           std::none_of(tasks.begin(), tasks.end(),
                        [](const Task& task) { return task.state == "COMPLETING"; });
  });
  EXPECT_TRUE(cluster.is_empty()) << cluster.command("squeue", {});
  for (const Task& task : cluster.tasks())
    EXPECT_THAT(task.state, testing::AnyOf("CANCELLED", "COMPLETED")) << task.name();

  // What is cancelled can be taken up by hand.
  const auto rest = run_program({"batch", "run", job.string(), "--stage", "tile", "-q"});
  EXPECT_EQ(rest.status, 0) << rest.output;
}

/// How a task of a cluster ends that gets a signal while it makes tiles.
/// asked   of scontrol, by a stand-in for it
struct EndOfTask {
  int status = 0;
  std::string output;
  std::string asked;
};
EndOfTask end_of_task(const ScratchFolder& scratch, const std::string& signal,
                      const std::string& num_restarts) {
  const fs::path job = scratch / ("job" + signal + num_restarts);
  const fs::path asked = job / "asked";
  EXPECT_EQ(plan(write_text(scratch / "job.toml", job_text()), job, "0.02"), "");
  fs::permissions(write_text(scratch / "bin/scontrol", "#!/bin/sh\necho \"$@\" >\"$ASKED\"\n"),
                  fs::perms::owner_all);
  const auto ended = run_command(
      "/bin/sh",
      {"-c",
       "export PATH=\"$2:$PATH\" ASKED=\"$3\" SLURM_ARRAY_JOB_ID=71 SLURM_ARRAY_TASK_ID=4 \n"
       "export SLURM_RESTART_COUNT=$5\n"
       "\"$0\" batch run \"$1\" --shard 0/1 --requeue -q & \n"
       "until [ -e \"$1/state/0001/claims/tile/000000.1\" ]; do sleep 0.02; done\n"
       "kill -$4 $!; wait $!",
       TERRACAST_PROGRAM, job.string(), (scratch / "bin").string(), asked.string(), signal,
       num_restarts});
  return {ended.status, ended.output, text_of(asked)};
}

TEST(SlurmTask, PutsItselfBackIntoTheQueueWhenItIsWarnedButNotForEverNorWhenItIsCancelled) {
  const ScratchFolder scratch;
  const EndOfTask warned = end_of_task(scratch, "USR1", "0");
  EXPECT_EQ(warned.status, 75) << warned.output;
  EXPECT_EQ(warned.asked, "requeue 71_4\n");
  const EndOfTask cancelled = end_of_task(scratch, "TERM", "0");
  EXPECT_EQ(cancelled.status, 75) << cancelled.output;
  EXPECT_EQ(cancelled.asked, "");
  const EndOfTask last = end_of_task(scratch, "USR1", "20");
  EXPECT_EQ(last.status, 75) << last.output;
  EXPECT_EQ(last.asked, "");
  EXPECT_THAT(last.output, testing::HasSubstr("was started 20 times before"));
}

bool runs(const SlurmCluster& cluster, const std::string& node) {
  const auto all = cluster.processes();
  return std::any_of(all.begin(), all.end(),
                     [&](const Process& process) { return process.node == node; });
}

/// Puts two tasks on each node that do nothing for long.
void fill(const SlurmCluster& cluster) {
  cluster.command("sbatch", {"--array=0-3", "--output=/dev/null", "--wrap=sleep 1000"});
  cluster.wait_until("both nodes work", [&] { return runs(cluster, "n1") && runs(cluster, "n2"); });
}

TEST(SlurmCluster, ADeadNodeTakesItsTasksWithItAndADeadSlurmdDoesNot) {
  TERRACAST_NEEDS_FULL();
  TERRACAST_NEEDS_SLURM();
  for (const bool may_have_spaces : {true, false}) {
    SlurmCluster cluster(may_have_spaces);
    fill(cluster);
    cluster.kill_node("n1");
    cluster.kill_slurmd("n2");
    EXPECT_FALSE(runs(cluster, "n1"));
    EXPECT_TRUE(runs(cluster, "n2"));
  }
}

/// Processes that were started with a variable of their environment, in whatever task or daemon.
int num_processes_with(const std::string& variable) {
  int count = 0;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator("/proc", ignored))
    count += text_of(entry.path() / "environ").find(variable) != std::string::npos ? 1 : 0;
  return count;
}

TEST(SlurmCluster, NothingOfItOutlivesTheProcessThatMadeIt) {
  TERRACAST_NEEDS_FULL();
  TERRACAST_NEEDS_SLURM();
  for (const bool may_have_spaces : {true, false}) {
    int ends[2];
    ASSERT_EQ(::pipe(ends), 0);
    const pid_t child = ::fork();
    if (child == 0) {
      try {
        const SlurmCluster cluster(may_have_spaces);
        fill(cluster);
        const std::string config = std::getenv("SLURM_CONF");
        if (::write(ends[1], config.c_str(), config.size()) > 0) ::pause();
      } catch (const std::exception& error) {
        fmt::print(stderr, "{}\n", error.what());
      }
      ::_exit(1);
    }
    ::close(ends[1]);
    char text[200] = {};
    ASSERT_GT(::read(ends[0], text, sizeof text - 1), 0);
    ::close(ends[0]);
    const fs::path config = text;
    EXPECT_GE(num_processes_with("SLURM_CONF=" + config.string()), 8) << "daemons and tasks";
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    const auto start = std::chrono::steady_clock::now();
    while (num_processes_with("SLURM_CONF=" + config.string()) > 0 &&
           std::chrono::steady_clock::now() - start < std::chrono::seconds(30))
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_EQ(num_processes_with("SLURM_CONF=" + config.string()), 0);
    fs::remove_all(config.parent_path());
  }
}

}  // namespace
}  // namespace terracast::test
