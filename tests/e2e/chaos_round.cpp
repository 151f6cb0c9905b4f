#include "tests/e2e/chaos_round.h"

#include <fmt/format.h>
#include <signal.h>

#include <algorithm>
#include <iterator>
#include <thread>
#include <utility>

#include "tests/e2e/tiny_job.h"
#include "tests/support/run_program.h"

namespace terracast::test {
namespace {

namespace fs = std::filesystem;

constexpr double kLease_s = 1.0;
constexpr int kInput = 3;
constexpr int kIo = 4;

}  // namespace

Round::Round(std::uint64_t seed, int number, const std::vector<Fault>& faults,
             const BatchSnapshots& snapshots, OwnDisk& disk, const FakeClock& clock,
             const fs::path& scratch, Tally& tally)
    : dice_(seed, static_cast<std::uint64_t>(number)),
      faults_(faults),
      snapshots_(snapshots),
      disk_(disk),
      clock_(clock),
      scratch_(scratch),
      tally_(tally),
      job_(disk.folder() / ("job" + std::to_string(number))) {}

Round::~Round() {
  disk_.restore();
  workers_.clear();
  fs::remove_all(job_);
}

void Round::play() {
  choose_start();
  if (has(Fault::DamageAtRest)) {
    count(Fault::DamageAtRest);
    for (std::size_t i = 0, count = 1 + dice_.index(3); i < count; ++i) damage();
  }
  choose_clocks();
  num_wanted_ = 1 + dice_.index(4);
  if (has(Fault::ClocksDiffer)) num_wanted_ = std::max<std::size_t>(num_wanted_, 2);
  lay_out_events();
  start_ = Clock::now();
  for (std::size_t i = 0; i < num_wanted_; ++i)
    events_.push_back({dice_.between(0.0, 0.3), [this] { start_worker(); }});
  while (!events_.empty() || !workers_.empty()) {
    std::stable_sort(events_.begin(), events_.end(),
                     [](const Event& a, const Event& b) { return a.time_s < b.time_s; });
    while (!events_.empty() && events_.front().time_s <= now_s()) {
      const auto happen = std::move(events_.front().happen);
      events_.pop_front();
      happen();
    }
    look_after_workers();
    if (now_s() > kLongest_s) return fail("the workers did not end");
    std::this_thread::sleep_for(std::chrono::milliseconds(3));
  }
  recover();
}

std::string Round::story() const {
  std::string text;
  for (const std::string& line : story_) text += "  " + line + "\n";
  return text;
}

bool Round::has(Fault fault) const {
  return std::find(faults_.begin(), faults_.end(), fault) != faults_.end();
}

std::string Round::stage_now() const {
  for (const std::string& stage : kBatchStages) {
    const JobFiles records{"", "state/0001/done/" + stage, "", ".json"};
    if (job_files(job_, records).size() < job_files(snapshots_.complete(), records).size())
      return stage;
  }
  return "nothing more";
}

void Round::count(Fault fault) {
  played_.insert(fault);
  ++tally_.faults[fault_name(fault)];
  ++tally_.stages[fault_name(fault) + " in " + stage_now()];
}

void Round::tell(const std::string& line) {
  story_.push_back(fmt::format("{:6.2f} s  {}", now_s(), line));
}

void Round::fail(const std::string& what) {
  wrongs_.push_back(what);
  tell("WRONG: " + what);
}

void Round::choose_start() {
  const std::size_t num_stages = dice_.index(kBatchStages.size() + 1);
  // A job that is complete has nothing to be cut off in.
  const bool is_at_rest = faults_ == std::vector<Fault>{Fault::DamageAtRest};
  num_done_ = is_at_rest ? num_stages : std::min(num_stages, kBatchStages.size() - 1);
  copy_job(snapshots_.after(num_done_), job_);
  tell(fmt::format("{} stages are done", num_done_));
}

void Round::choose_clocks() {
  clocks_ = {{}};
  if (!clock_.is_there()) return;
  const bool with_steady = dice_.chance(0.5);
  if (has(Fault::ClockAhead)) clocks_ = {clock_.shifted("+2d", with_steady)};
  if (has(Fault::ClocksDiffer))
    clocks_ = {clock_.shifted("-1d", with_steady), clock_.shifted("+2d", !with_steady), {}};
  if (has(Fault::ClockJump)) {
    set_clock("+0");
    clocks_ = {clock_.by_file(clock_file_)};
  }
  for (const Fault fault : faults_)
    if (is_of_clock(fault)) {
      played_.insert(fault);
      ++tally_.faults[fault_name(fault)];
      tell(fault_name(fault) + (with_steady ? ", the steady one too" : ""));
    }
}

void Round::set_clock(const std::string& offset) { write_text(clock_file_, offset + "\n"); }

double Round::some_moment_s() {
  double work_s = 0.3;
  for (std::size_t stage = num_done_; stage < kBatchStages.size(); ++stage)
    work_s += snapshots_.duration_s(stage);
  return dice_.between(0.02, work_s);
}

void Round::lay_out_events() {
  for (const Fault fault : faults_) {
    if (fault == Fault::DamageAtRest || (is_of_clock(fault) && fault != Fault::ClockJump)) continue;
    const std::size_t count = is_of_disk(fault) ? 1 : 1 + dice_.index(3);
    for (std::size_t i = 0; i < count; ++i)
      events_.push_back({some_moment_s(), [this, fault] { happen(fault); }});
  }
}

void Round::happen(Fault fault) {
  switch (fault) {
    case Fault::Kill:
    case Fault::Stop:
    case Fault::StopAndKill:
      return signal_one(fault);
    case Fault::FullDisk:
    case Fault::ReadOnly:
      return spoil_disk(fault);
    case Fault::DamageAtWork:
      count(fault);
      return damage();
    case Fault::ClockJump: {
      const std::string offset = dice_.chance(0.5) ? "+2d" : "-1d";
      tell("the clock jumps to " + offset);
      return set_clock(offset);
    }
    case Fault::DamageAtRest:
    case Fault::ClockAhead:
    case Fault::ClocksDiffer:
      break;
  }
}

void Round::signal_one(Fault fault) {
  std::vector<StartedProgram*> running;
  for (StartedProgram& worker : workers_)
    if (!worker.has_ended()) running.push_back(&worker);
  if (running.empty()) return;
  const StartedProgram& worker = *running[dice_.index(running.size())];
  const pid_t process = worker.process();
  count(fault);
  tell(fmt::format("worker {}: {}", process, fault_name(fault)));
  worker.send(fault == Fault::Kill ? SIGKILL : SIGSTOP);
  if (fault == Fault::Kill) return;
  const int next = fault == Fault::Stop ? SIGCONT : SIGKILL;
  const double until_s = now_s() + dice_.between(1.2, 2.5) * kLease_s;
  events_.push_back({until_s, [this, process, next] {
                       for (const StartedProgram& each : workers_)
                         if (each.process() == process) each.send(next);
                     }});
}

void Round::spoil_disk(Fault fault) {
  constexpr double kLongestSpoilt_s = 3.0;
  const bool is_spoilt =
      fault == Fault::FullDisk ? disk_.fill(dice_.index(200000)) : disk_.make_read_only();
  if (!is_spoilt) return tell(fault_name(fault) + ": could not be done now");
  count(fault);
  tell(fault_name(fault));
  spoilt_by_ = fault;
  const double until_s = now_s() + kLongestSpoilt_s;
  num_noticed_ = 0;
  events_.push_back({now_s(), [this, until_s] { mend_disk(until_s); }});
}

void Round::mend_disk(double until_s) {
  if (num_noticed_ == 0 && now_s() < until_s && !workers_.empty()) {
    events_.push_back({now_s() + 0.02, [this, until_s] { mend_disk(until_s); }});
    return;
  }
  disk_.restore();
  spoilt_by_.reset();
  tell("the disk is well again");
}

void Round::damage() {
  const auto& kinds = kinds_of_job_files();
  for (int i = 0; i < 50; ++i) {
    const JobFiles& kind = kinds[dice_.index(kinds.size())];
    const std::vector<std::string> files = job_files(job_, kind);
    const Damage how = kDamages[dice_.index(std::size(kDamages))];
    const std::uint64_t random = dice_.bits();
    if (files.empty()) continue;
    const std::string& file = files[dice_.index(files.size())];
    if (!do_damage(job_ / file, how, random)) continue;
    damaged_.push_back(file);
    ++tally_.damages[damage_name(how) + " " + kind.name];
    return tell(fmt::format("{}: {}", file, damage_name(how)));
  }
}

void Round::start_worker() {
  if (num_started_ >= kMostWorkers) return;
  const auto& environment = clocks_[num_started_ % clocks_.size()];
  const fs::path output = scratch_ / fmt::format("worker-{}.log", num_started_);
  ++num_started_;
  workers_.emplace_back(TERRACAST_PROGRAM, run_arguments(), environment, output);
  tell(fmt::format("worker {} starts", workers_.back().process()));
}

std::vector<std::string> Round::run_arguments() const {
  return {"batch",       "run", job_.string(), "--lease-s", fmt::format("{}", kLease_s),
          "--max-tries", "4",   "--threads",   "1",         "-q"};
}

void Round::look_after_workers() {
  for (auto worker = workers_.begin(); worker != workers_.end();) {
    if (!worker->has_ended()) {
      ++worker;
      continue;
    }
    tell(fmt::format("worker {} ends: {} {}", worker->process(), worker->status(),
                     worker->output()));
    judge(worker->status(), worker->output());
    const bool is_wanted = !events_.empty() && worker->status() != 0;
    worker = workers_.erase(worker);
    if (is_wanted && !spoilt_by_) events_.push_back({now_s() + 0.1, [this] { start_worker(); }});
    if (is_wanted && spoilt_by_) ++num_owed_;
  }
  for (; num_owed_ > 0 && !spoilt_by_; --num_owed_)
    events_.push_back({now_s() + 0.1, [this] { start_worker(); }});
}

void Round::judge(int status, const std::string& output) {
  ++tally_.ends[fmt::format("status {}", status)];
  if (status == 0 || status == -SIGKILL) return;
  ++tally_.failures[general(error_line(output))];
  const bool is_known = status == 1 || status == kInput || status == kIo;
  if (!is_known) return fail(fmt::format("a worker ended with status {}: {}", status, output));
  const auto has = [&](const std::string& text) { return output.find(text) != std::string::npos; };
  const bool tells_of_disk =
      has("Read-only file system") || has("No space left on device") || has("are left on its disk");
  if (tells_of_disk && has(job_.string())) {
    num_noticed_ += spoilt_by_ ? 1 : 0;
    return;
  }
  if (spoilt_by_ && status == kIo)
    return fail("the failure does not tell of the " + fault_name(*spoilt_by_) + ": " + output);
  const bool has_died = has("ended without a word");
  if (!has(job_.string() + "/") && !has_died) fail("a failure names no file: " + output);
}

void Round::recover() {
  constexpr int kMostCommands = 12;
  bool is_retried = false;
  for (int i = 0; i < kMostCommands; ++i) {
    std::vector<std::string> arguments = run_arguments();
    if (is_retried) arguments.push_back("--retry");
    is_retried = false;
    const auto run = run_program(arguments);
    tell(fmt::format("recovery: {} {}", run.status, run.output));
    if (run.status != 0) judge(run.status, run.output);
    if (run.output.find((job_ / "plan").string()) != std::string::npos) {
      // Nobody can tell what was planned; its maker has it.
      fs::remove_all(job_ / "plan");
      fs::copy(snapshots_.after(0) / "plan", job_ / "plan", fs::copy_options::recursive);
      continue;
    }
    if (run.output.find("--repair") == std::string::npos && run.status != 0) {
      is_retried = run.output.find("given up") != std::string::npos;
      if (!is_retried) return fail("a failure without a way on: " + run.output);
      continue;
    }
    if (run.status == 0 && damaged_.empty()) break;
    if (run.status == 0) check_noticed();
    const auto verified =
        run_program({"batch", "verify", job_.string(), "--repair", "--samples", "0", "-q"});
    tell(fmt::format("verify --repair: {} {}", verified.status, verified.output));
    if (verified.status != 0) ++tally_.failures[general(error_line(verified.output))];
    if (run.status == 0 && verified.status == 0) break;
  }
  for (const std::string& fault : faults_of_complete_job(job_, snapshots_.complete())) fail(fault);
}

void Round::check_noticed() {
  const std::string difference = dataset_difference(job_, snapshots_.complete());
  const bool is_explained =
      std::any_of(damaged_.begin(), damaged_.end(), [](const std::string& file) {
        return file.starts_with("dataset") || file.starts_with("state/0001/checksums");
      });
  if (!difference.empty() && !is_explained) fail("a silent wrong byte: " + difference);
}

}  // namespace terracast::test
