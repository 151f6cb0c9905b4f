#include "batch/slurm.h"

#include <algorithm>
#include <cmath>

#include "batch/array_index.h"
#include "core/error.h"
#include "core/plugin_rows.h"
#include "core/program.h"

namespace terracast::batch {
namespace {

using core::ErrorKind;
using core::fail;

constexpr double kTimeLimitPerTask = 3.0;
constexpr double kLeastTimeLimit_min = 30.0;
/// Slurm gives its warning up to a minute early: with less, a task would be warned as it starts.
constexpr double kLeastGivenLimit_min = 2.0;
/// Beside what the forecast says: other machines, other flights.
constexpr double kMemoryMargin = 1.5;
/// Before a task's time is up it is warned, with time for the frame at hand.
constexpr double kWarning_s = 120.0;
constexpr double kWarningPerLimit = 0.25;

/// A part of a name of a log file, in which Slurm takes % for the start of a field.
std::string without_fields(const std::string& text) {
  std::string result;
  for (const char c : text) result += c == '%' ? std::string("%%") : std::string(1, c);
  return result;
}

bool is_one_line(const std::string& text) {
  return !text.empty() && text.find_first_of("\r\n") == std::string::npos;
}

void check(const Plan& plan, const std::string& job, const SlurmOptions& options) {
  if (options.max_array_size < 2)
    fail(ErrorKind::Usage, "--max-array-size {}: an array has two places or more",
         options.max_array_size);
  if (options.time_limit_min > 0.0 && options.time_limit_min < kLeastGivenLimit_min)
    fail(ErrorKind::Usage, "--time-minutes {}: a task needs {} or more, since Slurm warns it early",
         options.time_limit_min, kLeastGivenLimit_min);
  for (const std::string& argument : options.arguments)
    if (!is_one_line(argument))
      fail(ErrorKind::Usage, "--sbatch \"{}\": one argument of sbatch on one line is right",
           argument);
  for (const std::string& name : {job, options.program.string(), plan.name})
    if (!is_one_line(name))
      fail(ErrorKind::Usage, "\"{}\": a name on one line is right for Slurm", name);
  if (job.find('\\') != std::string::npos)
    fail(ErrorKind::Usage, "{}: Slurm cannot write logs below a name with a backslash", job);
}

/// Of a stage's longest task, as the forecast says.
double longest_task_min(const Plan& plan, Stage stage, const SlurmOptions& options) {
  const std::vector<Shard>& shards = plan.of(stage);
  const int count = num_tasks(plan, stage, options);
  double longest_s = 0.0;
  for (int task = 0; task < count; ++task) {
    double task_s = 0.0;
    for (int i = part_begin(shards.size(), task, count);
         i < part_begin(shards.size(), task + 1, count); ++i)
      task_s += shards[static_cast<std::size_t>(i)].cost.cpu_s;
    longest_s = std::max(longest_s, task_s);
  }
  return longest_s / 60.0 / static_cast<double>(options.num_cpus);
}

int time_limit_min(const Plan& plan, Stage stage, const SlurmOptions& options) {
  if (options.time_limit_min > 0.0) return static_cast<int>(std::ceil(options.time_limit_min));
  return static_cast<int>(std::ceil(
      std::max(kLeastTimeLimit_min, kTimeLimitPerTask * longest_task_min(plan, stage, options))));
}

int warning_s(int limit_min) {
  return static_cast<int>(std::min(kWarning_s, 60.0 * kWarningPerLimit * limit_min));
}

std::int64_t memory_mib(const Plan& plan, const SlurmOptions& options) {
  const double bytes =
      options.memory_bytes > 0.0 ? options.memory_bytes : kMemoryMargin * plan.memory_bytes;
  return static_cast<std::int64_t>(std::ceil(bytes / 1048576.0));
}

/// What each task of an array runs. `exec` makes the program the one that Slurm's signals reach.
/// offset   of the array's first task among those of its stage
std::string task_script(const Plan& plan, Stage stage, int offset, const std::string& job,
                        const SlurmOptions& options) {
  std::string plugins;
  for (const std::string& word : core::plugin_arguments())
    plugins += " " + core::shell_quoted(word);
  return fmt::format(
      "#!/bin/sh\n"
      "exec {} batch run {} --stage {} --shard \"$(({} + SLURM_ARRAY_TASK_ID))/{}\" --needs \\\n"
      "  --threads {} --lease-s {} --max-tries {} --requeue{}\n",
      core::shell_quoted(options.program.string()), core::shell_quoted(job), stage_name(stage),
      offset, num_tasks(plan, stage, options), options.num_cpus, options.claims.lease_s,
      options.claims.max_tries, plugins);
}

/// The sbatch of one array, its task on its input.
/// last   index of its last task
std::string sbatch_command(const Plan& plan, Stage stage, int last, bool is_first_stage,
                           const std::string& job, const SlurmOptions& options) {
  const int limit_min = time_limit_min(plan, stage, options);
  const std::string logs =
      fmt::format("{}/logs/{}-%A_%a.log", without_fields(job), stage_name(stage));
  std::string text = fmt::format(
      "sbatch --parsable --job-name={} --array=0-{} \\\n"
      "  --cpus-per-task={} --mem={}M --time={} --signal=B:USR1@{} \\\n"
      "  --requeue --open-mode=append --chdir=\"$job\" --output={}",
      core::shell_quoted(fmt::format("{}-{}", plan.name, stage_name(stage))), last,
      options.num_cpus, memory_mib(plan, options), limit_min, warning_s(limit_min),
      core::shell_quoted(logs));
  if (!options.partition.empty()) text += " --partition=" + core::shell_quoted(options.partition);
  if (!is_first_stage) text += " --dependency=\"afterany$before\"";
  for (const std::string& argument : options.arguments)
    text += " \\\n  " + core::shell_quoted(argument);
  return text;
}

}  // namespace

int num_tasks(const Plan& plan, Stage stage, const SlurmOptions& options) {
  const double wall_min =
      plan.cost_of(stage).cpu_s / 60.0 / static_cast<double>(std::max(1, options.num_cpus));
  const auto wanted = static_cast<std::int64_t>(std::ceil(wall_min / options.task_min));
  const auto num_shards = static_cast<std::int64_t>(plan.of(stage).size());
  return static_cast<int>(
      std::min(num_shards, std::clamp<std::int64_t>(wanted, 1, std::max(1, options.max_tasks))));
}

std::string slurm_script(const Plan& plan, const std::filesystem::path& job_folder,
                         const SlurmOptions& options) {
  const std::string job = job_folder.string();
  check(plan, job, options);
  std::string text = fmt::format(
      "#!/bin/sh\n"
      "# Puts a batch of terracast on a Slurm cluster: arrays of tasks for each stage, which wait\n"
      "# for those of the stage before to end, well or not.\n"
      "set -eu\n"
      "job={}\n"
      "mkdir -p \"$job/logs\"\n"
      "# All or none: where one array is refused, those before it are taken back.\n"
      "ids=\n"
      "trap '[ -z \"$ids\" ] || scancel $ids' EXIT\n",
      core::shell_quoted(job));
  bool is_first_stage = true;
  for (const Stage stage : kStages) {
    const int count = num_tasks(plan, stage, options);
    if (count == 0) continue;
    text += fmt::format("\n# {}: {} shards in {} tasks\nthese=\n", stage_name(stage),
                        plan.of(stage).size(), count);
    for (int offset = 0; offset < count; offset += options.max_array_size) {
      const int last = std::min(count - offset, options.max_array_size) - 1;
      text += fmt::format(
          "id=$({} <<'END_OF_TASK'\n{}END_OF_TASK\n)\n"
          "id=${{id%%;*}}\n"
          "ids=\"$ids $id\" these=\"$these:$id\"\n"
          "echo \"{} $id\"\n",
          sbatch_command(plan, stage, last, is_first_stage, job, options),
          task_script(plan, stage, offset, job, options), stage_name(stage));
    }
    text += "before=$these\n";
    is_first_stage = false;
  }
  return text + "\ntrap - EXIT\n";
}

}  // namespace terracast::batch
