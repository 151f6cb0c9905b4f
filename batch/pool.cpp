#include "batch/pool.h"

#include <signal.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include "batch/board.h"
#include "batch/status.h"
#include "core/atomic_file.h"
#include "core/cpu_quota.h"
#include "core/plugin_rows.h"
#include "core/process_id.h"
#include "core/program.h"
#include "core/stage_cost.h"
#include "core/stop.h"

namespace terracast::batch {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kLook{100};
constexpr std::chrono::seconds kListen{2};
constexpr std::chrono::seconds kReport{10};
/// A worker that was asked to end has so long for the frame at hand.
constexpr std::chrono::seconds kPatience{600};
/// Workers that crash are replaced so often, all together.
constexpr int kMaxReplacements = 100;

/// What a worker failed of, by its exit status.
ErrorKind kind_of_exit_status(int status) {
  for (const ErrorKind kind :
       {ErrorKind::Usage, ErrorKind::Input, ErrorKind::Io, ErrorKind::Interrupted})
    if (core::exit_status(kind) == status) return kind;
  return ErrorKind::Internal;
}

/// The warnings that a worker writes to its log.
class Warnings {
 public:
  /// log   written to from here on
  explicit Warnings(fs::path log) : log_(std::move(log)) {
    std::error_code missing;
    const std::uintmax_t size = fs::file_size(log_, missing);
    place_ = missing ? 0 : static_cast<std::streamoff>(size);
  }

  /// Those that were written since this was last asked.
  std::vector<std::string> next() {
    constexpr std::string_view kMark = "warning: ";
    std::vector<std::string> warnings;
    std::ifstream stream(log_);
    stream.seekg(place_);
    for (std::string line; std::getline(stream, line) && !stream.eof();) {
      place_ = stream.tellg();
      const std::size_t mark = line.find(kMark);
      if (mark != std::string::npos) warnings.push_back(line.substr(mark + kMark.size()));
    }
    return warnings;
  }

 private:
  fs::path log_;
  std::streamoff place_ = 0;
};

class Pool {
 public:
  Pool(const Plan& plan, const JobFolder& folder, const PoolOptions& options,
       const core::Context& context)
      : plan_(plan), folder_(folder), options_(options), context_(context) {
    core::make_folder(folder_.logs());
    for (int k = 0; k < options.num_workers; ++k)
      workers_.push_back({.number = k, .running = {}, .warnings = Warnings(log_of(k))});
  }

  WorkerOutcome run() {
    for (Worker& worker : workers_) start(worker);
    context_.log.info("{} workers; what each says goes to {}", workers_.size(),
                      folder_.logs().string());
    auto next_words = Clock::now() + kListen;
    auto next_report = Clock::now() + kReport;
    while (is_anybody_at_work()) {
      std::this_thread::sleep_for(kLook);
      if (core::stop_asked()) end_all();
      if (Clock::now() < next_words) continue;
      next_words += kListen;
      pass_on_warnings();
      if (Clock::now() < next_report) continue;
      const auto start = Clock::now();
      report();
      // Of a large job it takes long to read all records.
      next_report = Clock::now() + std::max<Clock::duration>(kReport, 20 * (Clock::now() - start));
    }
    pass_on_warnings();
    return outcome();
  }

 private:
  struct Worker {
    int number = 0;
    std::optional<core::RunningProgram> running;
    Warnings warnings;
    int status = 0;  ///< of its end
  };

  fs::path log_of(int worker) const {
    return folder_.logs() / fmt::format("{}-worker-{}.log", core::host_name(), worker);
  }
  fs::path log_of(const Worker& worker) const { return log_of(worker.number); }

  void pass_on_warnings() {
    for (Worker& worker : workers_)
      for (const std::string& warning : worker.warnings.next())
        context_.log.warn("worker {}: {}", worker.number, warning);
  }

  /// The same worker options, as a command; it begins with a part of its own.
  std::vector<std::string> arguments_of(const Worker& worker) const {
    const WorkerOptions& own = options_.worker;
    std::vector<std::string> words = {"batch", "run", folder_.root.string(), "--worker",
                                      fmt::format("{}/{}", worker.number, options_.num_workers)};
    const auto add = [&](const char* name, const std::string& value) {
      words.emplace_back(name);
      words.push_back(value);
    };
    std::vector<std::string> stages;
    for (const Stage stage : own.stages) stages.emplace_back(stage_name(stage));
    add("--stage", fmt::format("{}", fmt::join(stages, ",")));
    if (own.is_part_only) add("--shard", fmt::format("{}/{}", own.part_index, own.part_count));
    if (own.has_needs) words.emplace_back("--needs");
    if (own.is_retry) words.emplace_back("--retry");
    if (own.quota_bytes != std::numeric_limits<double>::infinity())
      add("--quota", fmt::format("{:.0f}", own.quota_bytes));
    add("--lease-s", fmt::format("{}", own.claims.lease_s));
    add("--max-tries", fmt::to_string(own.claims.max_tries));
    add("--threads", fmt::to_string(options_.num_threads > 0
                                        ? options_.num_threads
                                        : std::max(1, core::cpus_to_use() / options_.num_workers)));
    const std::vector<std::string> plugins = core::plugin_arguments();
    words.insert(words.end(), plugins.begin(), plugins.end());
    return words;
  }

  void start(Worker& worker) {
    worker.running.emplace(options_.program, arguments_of(worker),
                           core::ProgramOptions{.log_file = log_of(worker)});
  }

  bool is_anybody_at_work() {
    bool is_at_work = false;
    for (Worker& worker : workers_) {
      if (!worker.running) continue;
      const std::optional<core::ProgramEnd> end = worker.running->end();
      if (!end) {
        is_at_work = true;
        continue;
      }
      worker.running.reset();
      worker.status = end->kind == core::ProgramEnd::Kind::Exited ? end->status : -1;
      if (worker.status >= 0 || core::stop_asked()) continue;
      context_.log.warn("worker {} {}; another takes its place (its log is {})", worker.number,
                        end->text(), log_of(worker).string());
      if (++num_replaced_ > kMaxReplacements)
        fail(ErrorKind::Internal, "{} workers have crashed; see {}", num_replaced_,
             folder_.logs().string());
      start(worker);
      is_at_work = true;
    }
    return is_at_work;
  }

  void end_all() {
    for (Worker& worker : workers_)
      if (worker.running) worker.running->send(SIGTERM);
    const auto until = Clock::now() + kPatience;
    while (Clock::now() < until && is_anybody_at_work()) std::this_thread::sleep_for(kLook);
    core::throw_if_stop_asked();
  }

  void report() const {
    try {
      tell_progress();
    } catch (const core::Error& error) {
      if (error.kind() != ErrorKind::Input && error.kind() != ErrorKind::Io) throw;
      context_.log.warn("how far the job is cannot be told: {}", error.what());
    }
  }

  void tell_progress() const {
    const Status status = status_of(plan_, folder_, options_.worker.claims);
    std::int64_t num_done = 0;
    std::int64_t num_shards = 0;
    for (const auto& stage : status.stages) {
      num_done += stage.num_done;
      num_shards += stage.num_shards;
    }
    context_.log.info(
        "{} of {} shards, {:.2f} frames/s{}", num_done, num_shards, status.frames_per_s,
        status.left_s >= 0.0 ? fmt::format(", about {} left", core::duration_text(status.left_s))
                             : "");
  }

  /// Fails as the first worker that did; one that only wants to be run again goes before the others.
  void fail_as_workers() const {
    const int interrupted = core::exit_status(ErrorKind::Interrupted);
    const Worker* failed = nullptr;
    for (const Worker& worker : workers_)
      if (worker.status > 1 &&
          (failed == nullptr || (worker.status == interrupted && failed->status != interrupted)))
        failed = &worker;
    if (failed == nullptr) return;
    fail(kind_of_exit_status(failed->status), "worker {} ended with status {}: {}", failed->number,
         failed->status, last_words_of(*failed));
  }

  /// Its error, or the line that says why it stopped; where there is neither, where its log is.
  std::string last_words_of(const Worker& worker) const {
    constexpr std::string_view kError = "error: ";
    std::string log = core::read_text_file(log_of(worker));
    while (log.ends_with('\n')) log.pop_back();
    const bool is_interrupted = worker.status == core::exit_status(ErrorKind::Interrupted);
    const std::size_t mark = log.rfind(is_interrupted ? "\n" : kError);
    if (is_interrupted) return log.substr(mark == std::string::npos ? 0 : mark + 1);
    return mark == std::string::npos ? log_of(worker).string() : log.substr(mark + kError.size());
  }

  WorkerOutcome outcome() const {
    fail_as_workers();
    const Status status = status_of(plan_, folder_, options_.worker.claims);
    WorkerOutcome outcome;
    const bool is_left = std::any_of(workers_.begin(), workers_.end(),
                                     [](const Worker& worker) { return worker.status == 1; });
    for (const auto& stage : status.stages)
      if (is_left && std::find(options_.worker.stages.begin(), options_.worker.stages.end(),
                               stage.stage) != options_.worker.stages.end())
        outcome.num_left += stage.num_shards - stage.num_done;
    for (const Claims::Tried& tried : status.tried)
      if (tried.is_poisoned) outcome.poisoned.push_back(tried.shard);
    for (const auto& stage : status.stages)
      if (stage.stage == Stage::Merge)
        outcome.is_merged = stage.num_shards > 0 && stage.num_done == stage.num_shards;
    outcome.num_checks_failed = static_cast<int>(status.num_checks_failed);
    return outcome;
  }

  const Plan& plan_;
  const JobFolder& folder_;
  const PoolOptions& options_;
  const core::Context& context_;
  std::vector<Worker> workers_;
  int num_replaced_ = 0;
};

}  // namespace

WorkerOutcome run_pool(const Plan& plan, const JobFolder& folder, const PoolOptions& options,
                       const core::Context& context) {
  return Pool(plan, folder, options, context).run();
}

}  // namespace terracast::batch
