#include "cli/batch_command.h"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "batch/array_index.h"
#include "batch/plan.h"
#include "batch/pool.h"
#include "batch/slurm.h"
#include "batch/status.h"
#include "batch/update.h"
#include "batch/verify.h"
#include "batch/worker.h"
#include "cli/threads_option.h"
#include "cli/within.h"
#include "core/atomic_file.h"
#include "core/parallel.h"
#include "core/plugin_rows.h"
#include "core/program.h"
#include "core/stop.h"

namespace terracast::cli {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

/// What the options of `batch` are parsed into.
struct BatchArguments {
  fs::path config, job;
  std::vector<std::string> sets, stages;
  std::string shard, only, worker;
  double shard_min = 0.0;
  double quota_bytes = 0.0;
  int num_parts = 0;
  int num_jobs = 1;
  int num_threads = 0;
  bool is_dry = false, is_update = false, is_retry = false, is_requeued = false;
  bool has_needs = false;
  bool has_slurm = false, is_printed = false, is_watched = false, is_json = false;
  double lease_s = 0.0;  ///< 0: as the plan says
  int max_tries = 0;
  batch::SlurmOptions slurm;
  batch::VerifyOptions verify;
  bool verbose = false, quiet = false;
};

core::Log log_of(const BatchArguments& args) {
  return core::Log("batch", args.quiet     ? core::LogLevel::Warn
                            : args.verbose ? core::LogLevel::Debug
                                           : core::LogLevel::Info);
}

std::optional<std::string> variable(const char* name) {
  const char* const value = std::getenv(name);
  return value != nullptr ? std::optional<std::string>(value) : std::nullopt;
}

/// The launcher beside this program, where there is one: what users call.
fs::path this_program() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error) fail(ErrorKind::Io, "/proc/self/exe: {}", error.message());
  const fs::path launcher = program.parent_path() / "terracast";
  return fs::is_regular_file(launcher, error) ? launcher : program;
}

/// As the plan says, or this command.
batch::ClaimOptions claim_options(const batch::ClaimOptions& plan, const BatchArguments& args) {
  return {.lease_s = args.lease_s > 0.0 ? args.lease_s : plan.lease_s,
          .max_tries = args.max_tries > 0 ? args.max_tries : plan.max_tries};
}

int run_plan(const BatchArguments& args) {
  const core::Log log = log_of(args);
  const core::Context context{.log = log, .num_threads = args.num_threads};
  std::optional<batch::Plan> previous;
  std::optional<batch::UpdateRight> right;
  if (batch::has_plan(args.job) && (!args.is_dry || args.is_update)) {
    if (!args.is_update)
      fail(ErrorKind::Usage,
           "{}: there is a plan already; --update takes up what has changed, or give another --out",
           args.job.string());
    if (!args.is_dry) right.emplace(args.job);
    previous = batch::read_plan(args.job);
  } else if (args.is_update) {
    fail(ErrorKind::Usage, "{}: there is no plan to update", args.job.string());
  }
  const auto description = batch::Description::load(args.config, args.sets);
  batch::PlanOptions options;
  options.shard_s = 60.0 * args.shard_min;
  options.claims = claim_options(previous ? previous->claims : batch::ClaimOptions(), args);
  if (previous) options.edits = batch::find_edits(*previous, {args.job, previous->revision});
  const batch::Plan plan =
      batch::make_plan(description, options, previous ? &*previous : nullptr, context);
  fmt::print("{}", batch::describe_plan(plan));
  if (previous && batch::is_same_but_for_revision(*previous, plan)) {
    fmt::print("nothing has changed; revision {} stays\n", previous->revision);
    return 0;
  }
  if (previous) {
    const batch::Update update = args.is_dry ? batch::compare(*previous, plan, args.job)
                                             : batch::carry_over(*previous, plan, args.job);
    fmt::print("revision {}: {} shards stay done, {} are to be looked at again{}\n", plan.revision,
               update.num_kept, update.num_open, args.is_dry ? "; nothing is written" : "");
  }
  if (args.is_dry) return 0;
  batch::write_plan(plan, args.job);
  if (previous) batch::remove_unplanned(plan, {args.job, plan.revision});
  fmt::print("next: {0} batch run {1}, or {0} batch submit {1} --slurm\n",
             core::program_with_plugins(), args.job.string());
  return 0;
}

batch::WorkerOptions worker_options(const batch::Plan& plan, const BatchArguments& args) {
  batch::WorkerOptions options;
  if (!args.stages.empty()) {
    options.stages.clear();
    for (const std::string& stage : args.stages)
      options.stages.push_back(batch::stage_from_name(stage));
  }
  std::optional<batch::Part> part;
  if (!args.shard.empty())
    part = batch::part_from_text(args.shard);
  else if (args.only.empty())
    part = batch::part_from_queue(variable, args.num_parts);
  if (part) {
    log_of(args).info("part {} of {}, counted from 0", part->index, part->count);
    options.part_index = part->index;
    options.part_count = part->count;
    options.is_part_only = true;
  }
  if (!args.worker.empty() && !part) {
    const batch::Part own = batch::part_from_text(args.worker);
    options.part_index = own.index;
    options.part_count = own.count;
  }
  if (!args.only.empty()) options.only = batch::ShardId::parse(args.only);
  options.has_needs = args.has_needs || (part && args.stages.empty());
  options.is_retry = args.is_retry;
  if (args.quota_bytes > 0.0) options.quota_bytes = args.quota_bytes;
  options.claims = claim_options(plan.claims, args);
  return options;
}

/// The exit status of a worker with nothing left to do.
int tell_outcome(const batch::WorkerOutcome& outcome, const BatchArguments& args) {
  if (outcome.is_over_quota)
    fail(ErrorKind::Io,
         "the quota of {:.10g} MB leaves no room for the next shard; give more, or make room",
         args.quota_bytes * 1e-6);
  for (const batch::ShardId& shard : outcome.poisoned)
    fmt::print("given up: {} batch run {} --only {}\n", core::program_with_plugins(),
               args.job.string(), shard.text());
  if (outcome.num_left > 0)
    fmt::print("{} shards are not done; see terracast batch status {}\n", outcome.num_left,
               args.job.string());
  if (outcome.num_checks_failed > 0)
    fmt::print("{} checks failed; the reports are below {}\n", outcome.num_checks_failed,
               (args.job / "report").string());
  if (outcome.num_left == 0 && !outcome.is_merged && !args.quiet)
    fmt::print("done is what this command was given; see terracast batch status {}\n",
               args.job.string());
  if (outcome.is_merged && !args.quiet)
    fmt::print(
        "the dataset is in {}; its card is README.md, and `sha256sum -c SHA256SUMS` checks it\n",
        (args.job / "dataset").string());
  return outcome.num_left > 0 || outcome.num_checks_failed > 0 ? 1 : 0;
}

/// With which Slurm warns a task that its time is nearly up. The SIGTERM of its cancelling is another
/// thing: what is cancelled must not come back.
constexpr int kWarningSignal = SIGUSR1;
/// A task that was put back so often gets nowhere.
constexpr int kMostRestarts = 20;

/// Puts this task of a Slurm array back into the queue.
void requeue(const core::Log& log) {
  const int num_restarts = std::atoi(variable("SLURM_RESTART_COUNT").value_or("0").c_str());
  if (num_restarts >= kMostRestarts) {
    log.warn(
        "--requeue: this task was started {} times before; look why it takes so long, give "
        "more --time-minutes, and submit the job again",
        num_restarts);
    return;
  }
  const auto array = variable("SLURM_ARRAY_JOB_ID");
  const auto task = variable("SLURM_ARRAY_TASK_ID");
  const auto job = array && task ? std::optional(*array + "_" + *task) : variable("SLURM_JOB_ID");
  const auto program = core::find_program("scontrol");
  if (!job || !program) {
    log.warn("--requeue: this is no task of Slurm's; run the same command again to go on");
    return;
  }
  // The program that is run next is to end by itself, unless this task was cancelled meanwhile.
  if (!core::forget_stop_signal(kWarningSignal)) return;
  const core::ProgramEnd end = core::run_program(*program, {"requeue", *job}, "/dev/stderr");
  if (!end.is_success()) log.warn("scontrol requeue {} {}", *job, end.text());
}

int run_run(const BatchArguments& args) {
  // Queues leave 30 s between SIGTERM and SIGKILL. A worker gives its shard back meanwhile; who started workers outlasts
  // them, since they end with it.
  constexpr unsigned kWorkersGrace_s = 20, kPoolsGrace_s = 25;
  core::set_stop_grace(args.num_jobs > 1 ? kPoolsGrace_s : kWorkersGrace_s);
  if (args.is_requeued) core::catch_stop_signal(kWarningSignal);
  const core::Log log = log_of(args);
  const core::ThreadLimit limit(args.num_threads);
  const batch::Plan plan = batch::read_plan(args.job);
  const batch::JobFolder folder{args.job, plan.revision};
  const batch::WorkerOptions options = worker_options(plan, args);
  try {
    if (args.num_jobs > 1) {
      const batch::PoolOptions pool{.program = this_program(),
                                    .num_workers = args.num_jobs,
                                    .num_threads = args.num_threads,
                                    .worker = options};
      return tell_outcome(batch::run_pool(plan, folder, pool, {.log = log}), args);
    }
    return tell_outcome(
        batch::run_worker(plan, folder, options, {.log = log, .num_threads = args.num_threads}),
        args);
  } catch (const core::Error& error) {
    if (error.kind() == ErrorKind::Interrupted && args.is_requeued &&
        core::stop_signal() == kWarningSignal)
      requeue(log);
    throw;
  }
}

int run_submit(const BatchArguments& args) {
  if (!args.has_slurm)
    fail(ErrorKind::Usage, "give --slurm; for other queues docs/cluster.md has worked lines");
  const batch::Plan plan = batch::read_plan(args.job);
  batch::SlurmOptions options = args.slurm;
  if (options.program.empty()) options.program = this_program();
  options.claims = claim_options(plan.claims, args);
  const std::string script = batch::slurm_script(plan, fs::canonical(args.job), options);
  if (args.is_printed) {
    fmt::print("{}", script);
    return 0;
  }
  const fs::path file = args.job / "slurm" / "submit.sh";
  const fs::path output = args.job / "slurm" / "submit.log";
  core::write_file(file, script);
  const auto shell = core::find_program("sh");
  if (!shell) fail(ErrorKind::Io, "there is no sh in PATH to run {}", file.string());
  core::write_file(output, "");
  const core::ProgramEnd end = core::run_program(*shell, {file.string()}, output);
  fmt::print("{}", core::read_text_file(output));
  if (!end.is_success())
    fail(ErrorKind::Io, "{} {}; what it said is in {}", file.string(), end.text(), output.string());
  return 0;
}

int run_status(const BatchArguments& args) {
  constexpr std::chrono::seconds kPeriod{5};
  while (true) {
    const batch::Plan plan = batch::read_plan(args.job);
    const batch::Status status =
        batch::status_of(plan, {args.job, plan.revision}, claim_options(plan.claims, args));
    if (args.is_json) {
      fmt::print("{}\n", batch::status_json(status, args.job.string()).text());
    } else {
      if (args.is_watched && ::isatty(STDOUT_FILENO) != 0) fmt::print("\033[H\033[2J");
      fmt::print("{}", batch::status_text(status, args.job.string()));
    }
    std::fflush(stdout);
    if (!args.is_watched || status.is_complete()) return 0;
    for (auto waited = kPeriod * 0; waited < kPeriod; waited += std::chrono::seconds(1)) {
      core::throw_if_stop_asked();
      std::this_thread::sleep_for(std::chrono::seconds(1));
    }
  }
}

int run_verify(const BatchArguments& args) {
  const core::Log log = log_of(args);
  const core::ThreadLimit limit(args.num_threads);
  const batch::Plan plan = batch::read_plan(args.job);
  batch::VerifyOptions options = args.verify;
  options.claims = plan.claims;
  const batch::Verification found = batch::verify(plan, {args.job, plan.revision}, options,
                                                  {.log = log, .num_threads = args.num_threads});
  constexpr std::size_t kShown = 20;
  for (std::size_t i = 0; i < std::min(found.damaged.size(), kShown); ++i)
    fmt::print("{} {} (shard {})\n", found.damaged[i].file, found.damaged[i].what,
               found.damaged[i].shard.text());
  if (found.damaged.size() > kShown) fmt::print("and {} more\n", found.damaged.size() - kShown);
  for (const std::string& frame : found.differing)
    fmt::print("{}: rendered once more, it has other bytes\n", frame);
  fmt::print(
      "{} exported files and reports, {} frames of captures and {} tiles read, {} not as they were "
      "made; {} frames rendered once more, {} differ\n",
      found.num_files, found.num_frames, found.num_tiles, found.damaged.size(),
      found.sampled.size(), found.differing.size());
  if (found.num_open > 0)
    fmt::print("{} shards are not done yet, and nothing of theirs was looked at\n", found.num_open);
  if (!found.reopened.empty())
    fmt::print("{} shards are open again: {} batch run {}\n", found.reopened.size(),
               core::program_with_plugins(), args.job.string());
  else if (!found.damaged.empty())
    fmt::print("the same command with --repair has what is damaged made again\n");
  return found.is_right() ? 0 : 1;
}

void add_job(CLI::App& command, BatchArguments& args) {
  command.add_option("JOB", args.job, "Folder of the job.")->required();
}

void add_threads(CLI::App& command, BatchArguments& args) {
  add_threads_option(command, args.num_threads, " of each process");
  command.add_flag("-v,--verbose", args.verbose, "Say what happens to each tile and frame.");
  command.add_flag("-q,--quiet", args.quiet, "Say only what changes the data or fails.");
}

/// "500GB", "1.5 TB", "64MiB" or a number of bytes, as a number of bytes.
CLI::AsNumberWithUnit bytes_with_unit() {
  const std::map<std::string, double> units = {{"b", 1.0},      {"kb", 1e3},     {"mb", 1e6},
                                               {"gb", 1e9},     {"tb", 1e12},    {"kib", 0x1p10},
                                               {"mib", 0x1p20}, {"gib", 0x1p30}, {"tib", 0x1p40}};
  return CLI::AsNumberWithUnit(units, CLI::AsNumberWithUnit::CASE_INSENSITIVE, "SIZE");
}

void add_lease(CLI::App& command, BatchArguments& args) {
  command
      .add_option("--lease-s", args.lease_s,
                  "A shard of which nothing was heard for so long is taken by others; 300 unless "
                  "the plan says otherwise.")
      ->check(within(0.5, 1e6));
  command
      .add_option("--max-tries", args.max_tries,
                  "A shard that failed, or whose process died, so often is left; 5 unless the plan "
                  "says otherwise.")
      ->check(CLI::Range(1, 1000000));
}

void add_plan(CLI::App& batch, BatchArguments& args, int& status) {
  auto* plan = batch.add_subcommand(
      "plan", "Cut a dataset description into shards: a job folder, and what it will take.");
  plan->add_option("CONFIG", args.config,
                   "The dataset, TOML: a job's config with a [sweep]; `terracast config explain "
                   "sweep` lists its keys.")
      ->required();
  plan->add_option("--out", args.job, "The job folder, on a file system that all workers see.")
      ->required();
  plan->add_option("--set", args.sets, "Set a key of the config (repeatable).")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  plan->add_flag("--dry-run", args.is_dry, "Say what the job would take, and write nothing.");
  plan->add_flag("--update", args.is_update,
                 "Plan a job again after its config or data changed; what did not change stays.");
  plan->add_option("--shard-minutes", args.shard_min,
                   "CPU time of a shard; left out: a thirty-second of the whole, 1 to 15.")
      ->check(within(0.001, 1e4));
  add_lease(*plan, args);
  add_threads(*plan, args);
  plan->callback([&] { status = run_plan(args); });
}

void add_run(CLI::App& batch, BatchArguments& args, int& status) {
  auto* run = batch.add_subcommand(
      "run", "Work on a job until it is done; any number may, on any machines, at any time.");
  add_job(*run, args);
  auto* jobs = run->add_option("--jobs", args.num_jobs,
                               "Processes on this machine, which share its cores unless --threads "
                               "says otherwise.")
                   ->check(CLI::Range(1, 4096));
  run->add_option("--shard", args.shard,
                  "Only part INDEX of COUNT of each stage; counted from 0. Left out in a task of a "
                  "Slurm, SGE, PBS or Kubernetes array: the task's.")
      ->type_name("INDEX/COUNT");
  run->add_option("--parts", args.num_parts,
                  "How many tasks the array has, where its queue does not tell (PBS, Kubernetes).")
      ->check(CLI::Range(1, 1000000));
  run->add_option("--stage", args.stages,
                  "Only these stages: tile, render, export, "
                  "validate, merge (several with commas).")
      ->delimiter(',')
      ->allow_extra_args(false);
  run->add_flag("--needs", args.has_needs,
                "Also what those shards need of others and nobody has done.");
  run->add_option("--only", args.only, "Only this shard, as render/12, failed or not.")
      ->type_name("STAGE/INDEX")
      ->excludes(jobs);
  run->add_option("--worker", args.worker,
                  "Begin with part INDEX of COUNT, then go on with others.")
      ->type_name("INDEX/COUNT")
      ->group("");  // for --jobs
  run->add_flag("--retry", args.is_retry, "Try again what was given up.");
  run->add_option("--quota", args.quota_bytes,
                  "Stop before the job takes more disk than this, as 500GB.")
      ->transform(bytes_with_unit());
  run->add_flag("--requeue", args.is_requeued,
                "When SIGUSR1 warns that its time is nearly up, put this Slurm task back into the "
                "queue.");
  add_lease(*run, args);
  add_threads(*run, args);
  run->callback([&] { status = run_run(args); });
}

void add_submit(CLI::App& batch, BatchArguments& args, int& status) {
  batch::SlurmOptions& slurm = args.slurm;
  auto* submit = batch.add_subcommand("submit", "Put a job on a cluster.");
  add_job(*submit, args);
  submit->add_flag("--slurm", args.has_slurm, "As arrays of Slurm, one stage after the other.");
  submit->add_flag("--print", args.is_printed, "Print the script instead of running it.");
  submit->add_option("--partition", slurm.partition, "Slurm's partition.");
  submit->add_option("--cpus", slurm.num_cpus, "Cores of a task: 1.")->check(CLI::Range(1, 1024));
  submit->add_option("--memory", slurm.memory_bytes, "Of a task; left out: by the plan.")
      ->transform(bytes_with_unit());
  submit
      ->add_option("--task-minutes", slurm.task_min,
                   "What a task shall take: shards are bundled to it: 30.")
      ->check(within(0.01, 1e5));
  submit
      ->add_option(
          "--time-minutes", slurm.time_limit_min,
          "Time limit of a task; left out: three times what its stage's longest task shall "
          "take, 30 at least.")
      ->check(within(2.0, 1e6));
  submit
      ->add_option("--max-array-size", slurm.max_array_size,
                   "MaxArraySize of the cluster (`scontrol show config`): 1001.")
      ->check(CLI::Range(2, 4000001));
  submit->add_option("--max-tasks", slurm.max_tasks, "Tasks of a stage at most: 10000.")
      ->check(CLI::Range(1, 10000000));
  submit->add_option("--program", slurm.program, "terracast, as the nodes see it; this one.");
  submit
      ->add_option("--sbatch", slurm.arguments,
                   "An argument for sbatch, as --sbatch=--account=x (repeatable).")
      ->allow_extra_args(false);
  add_lease(*submit, args);
  submit->callback([&] { status = run_submit(args); });
}

void add_status(CLI::App& batch, BatchArguments& args, int& status) {
  auto* command = batch.add_subcommand(
      "status", "How far a job has come, what failed and how to repeat it, time left.");
  add_job(*command, args);
  command->add_flag("--watch", args.is_watched, "Again every 5 s, until the job is done.");
  command->add_flag("--json", args.is_json, "As JSON.");
  add_lease(*command, args);
  command->callback([&] { status = run_status(args); });
}

void add_verify(CLI::App& batch, BatchArguments& args, int& status) {
  auto* command = batch.add_subcommand(
      "verify",
      "Read every file, of captures and tiles too, against its checksum, and render a sample once "
      "more.");
  add_job(*command, args);
  command->add_option("--samples", args.verify.num_samples, "Frames that are rendered again: 4.")
      ->check(CLI::Range(0, 1000000));
  command->add_option("--seed", args.verify.seed, "Of their choice: 1.");
  command->add_flag("--repair", args.verify.is_repaired,
                    "Have what is damaged made again by the next `batch run`.");
  add_threads(*command, args);
  command->callback([&] { status = run_verify(args); });
}

}  // namespace

void add_batch_command(CLI::App& app, int& status) {
  // The callbacks run while the app parses, which outlives them.
  const auto args = std::make_shared<BatchArguments>();
  auto* batch = app.add_subcommand(
      "batch", "Many runs as one job, on this machine or a cluster: plan, run, status, verify.");
  batch->require_subcommand(1);
  batch->footer(
      "Start with:\n"
      "  terracast batch plan configs/batch/demo.toml --out out/batch\n"
      "  terracast batch run out/batch --jobs 2\n"
      "  terracast batch status out/batch\n"
      "What was cut off goes on when it is run again.");
  add_plan(*batch, *args, status);
  add_run(*batch, *args, status);
  add_submit(*batch, *args, status);
  add_status(*batch, *args, status);
  add_verify(*batch, *args, status);
  batch->parse_complete_callback([args] {});  // keeps the arguments as long as the app
}

}  // namespace terracast::cli
