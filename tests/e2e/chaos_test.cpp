#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/statvfs.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <functional>
#include <iostream>
#include <list>
#include <map>
#include <optional>
#include <set>
#include <system_error>
#include <thread>

#include "core/random.h"
#include "tests/e2e/batch_job.h"
#include "tests/e2e/started_program.h"
#include "tests/e2e/tiny_job.h"
#include "tests/support/record.h"
#include "tests/support/run_program.h"
#include "tests/support/test_data.h"

/// Rounds of faults on a small batch job. Each ends in the right checksums, after what the program
/// itself asks for, or fails the test with what was done.
///
///     TERRACAST_CHAOS_SEED=7     another course of events (printed with each failure)
///     TERRACAST_CHAOS_ROUNDS=3   of it alone the first ones; 10, and 100 under TERRACAST_FULL
namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr double kLease_s = 1.0;
constexpr int kInput = 3;
constexpr int kIo = 4;

enum class Fault {
  Kill,
  Stop,         ///< past the lease; then it goes on
  StopAndKill,  ///< past the lease; then it is killed
  FullDisk,
  ReadOnly,
  DamageAtRest,  ///< while nobody works
  DamageAtWork,
  ClockAhead,    ///< of all workers, by two days
  ClocksDiffer,  ///< between workers
  ClockJump,     ///< in the middle
};
constexpr Fault kFaults[] = {Fault::Kill,         Fault::Stop,       Fault::StopAndKill,
                             Fault::FullDisk,     Fault::ReadOnly,   Fault::DamageAtRest,
                             Fault::DamageAtWork, Fault::ClockAhead, Fault::ClocksDiffer,
                             Fault::ClockJump};

std::string fault_name(Fault fault) {
  static const std::map<Fault, std::string> kNames = {
      {Fault::Kill, "killed"},
      {Fault::Stop, "stopped past the lease"},
      {Fault::StopAndKill, "stopped past the lease and killed"},
      {Fault::FullDisk, "full disk"},
      {Fault::ReadOnly, "read-only disk"},
      {Fault::DamageAtRest, "damaged at rest"},
      {Fault::DamageAtWork, "damaged at work"},
      {Fault::ClockAhead, "clock two days ahead"},
      {Fault::ClocksDiffer, "clocks that differ"},
      {Fault::ClockJump, "clock jump"}};
  return kNames.at(fault);
}

bool is_of_disk(Fault fault) { return fault == Fault::FullDisk || fault == Fault::ReadOnly; }
bool is_of_clock(Fault fault) {
  return fault == Fault::ClockAhead || fault == Fault::ClocksDiffer || fault == Fault::ClockJump;
}

/// Random choices that follow from a seed.
class Dice {
 public:
  Dice(std::uint64_t seed, std::uint64_t stream) : seed_(seed), stream_(stream) {}
  std::uint64_t bits() { return core::random_bits(seed_, stream_, next_++); }
  double between(double lowest, double highest) {
    return core::random_between(lowest, highest, seed_, stream_, next_++);
  }
  std::size_t index(std::size_t count) { return static_cast<std::size_t>(bits() % count); }
  bool chance(double probability) { return between(0.0, 1.0) < probability; }

 private:
  std::uint64_t seed_, stream_, next_ = 0;
};

/// A disk of the test's own, which can be full or read-only.
class OwnDisk {
 public:
  explicit OwnDisk(const fs::path& folder) : folder_(folder) {
    fs::create_directories(folder_);
    // A name space of our own: nothing is left mounted, however the test ends.
    if (::unshare(CLONE_NEWNS) != 0 ||
        ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
        ::mount("tmpfs", folder_.c_str(), "tmpfs", 0, kRoomy) != 0)
      why_not_ = std::generic_category().message(errno);
  }
  ~OwnDisk() {
    if (is_mounted()) ::umount2(folder_.c_str(), MNT_DETACH);
  }
  OwnDisk(const OwnDisk&) = delete;
  OwnDisk& operator=(const OwnDisk&) = delete;

  bool is_mounted() const { return why_not_.empty(); }
  const std::string& why_not() const { return why_not_; }
  const fs::path& folder() const { return folder_; }

  /// Leaves so many bytes to be written.
  bool fill(std::uint64_t room_bytes) {
    struct statvfs space {};
    ::statvfs(folder_.c_str(), &space);
    const std::uint64_t used = (space.f_blocks - space.f_bfree) * space.f_frsize;
    const std::string size = "size=" + std::to_string(used + room_bytes);
    return ::mount("tmpfs", folder_.c_str(), "tmpfs", MS_REMOUNT, size.c_str()) == 0;
  }
  /// Not while a file is open for writing: a moment is waited for.
  bool make_read_only() {
    for (int i = 0; i < 2000; ++i) {
      if (::mount(nullptr, folder_.c_str(), nullptr, MS_REMOUNT | MS_BIND | MS_RDONLY, nullptr) ==
          0)
        return true;
      std::this_thread::sleep_for(std::chrono::microseconds(300));
    }
    return false;
  }
  void restore() {
    ::mount(nullptr, folder_.c_str(), nullptr, MS_REMOUNT | MS_BIND, nullptr);
    ::mount("tmpfs", folder_.c_str(), "tmpfs", MS_REMOUNT, kRoomy);
  }

 private:
  static constexpr const char* kRoomy = "size=2g";  // more than a worker wants to see free
  fs::path folder_;
  std::string why_not_;
};

/// What libfaketime tells a process of the time.
class FakeClock {
 public:
  FakeClock() {
    // The wrapper knows where its library lies, as the loader is told it.
    const auto found = run_command("/usr/bin/env", {"faketime", "-m", "-f", "+0s", "/bin/sh", "-c",
                                                    "printf %s \"$LD_PRELOAD\""});
    if (found.status == 0) library_ = found.output;
  }
  bool is_there() const { return !library_.empty(); }

  using Environment = std::vector<std::pair<std::string, std::string>>;
  /// offset         "+2d"
  /// with_steady    the clock that never jumps, too; leases are renewed no more under it, since
  ///                libfaketime leaves what waits by it alone
  Environment shifted(const std::string& offset, bool with_steady) const {
    Environment environment = {{"LD_PRELOAD", library_}, {"FAKETIME", offset}};
    if (!with_steady) environment.emplace_back("FAKETIME_DONT_FAKE_MONOTONIC", "1");
    return environment;
  }
  /// By what a file says at the time.
  Environment by_file(const fs::path& file) const {
    return {{"LD_PRELOAD", library_},
            {"FAKETIME_TIMESTAMP_FILE", file.string()},
            {"FAKETIME_NO_CACHE", "1"},
            {"FAKETIME_DONT_FAKE_MONOTONIC", "1"}};
  }

 private:
  std::string library_;
};

/// What happened in all rounds.
struct Tally {
  std::map<std::string, int> faults;
  std::map<std::string, int> stages;    ///< "killed in render"
  std::map<std::string, int> damages;   ///< "flipped tile"
  std::map<std::string, int> failures;  ///< messages without paths and numbers
  std::map<std::string, int> ends;      ///< "status 0"
};

/// A message in which all that differs from case to case is left out.
std::string general(std::string line) {
  std::string text;
  for (std::size_t i = 0; i < line.size();) {
    if (line[i] == '/') {
      const std::size_t end = line.find_first_of(" :;,)", i);
      const std::string path = line.substr(i, end - i);
      text += "…" + fs::path(path).extension().string();
      i = std::min(end, line.size());
    } else if (std::isdigit(static_cast<unsigned char>(line[i])) != 0) {
      text += '#';
      i = std::min(line.find_first_not_of("0123456789abcdef.", i), line.size());
    } else {
      text += line[i++];
    }
  }
  return text;
}

/// The line that says what went wrong.
std::string error_line(const std::string& output) {
  for (const char* mark : {"error: ", "failed: ", "given up", " not as they were made"}) {
    const std::size_t at = output.find(mark);
    if (at == std::string::npos) continue;
    const std::size_t begin = output.rfind('\n', at) + 1;
    return output.substr(begin, output.find('\n', at) - begin);
  }
  return output.substr(0, output.find('\n'));
}

/// One job, its workers, and what befalls them.
class Round {
 public:
  Round(std::uint64_t seed, int number, const std::vector<Fault>& faults,
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
  ~Round() {
    disk_.restore();
    workers_.clear();
    fs::remove_all(job_);
  }
  Round(const Round&) = delete;
  Round& operator=(const Round&) = delete;

  void play() {
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

  const std::vector<std::string>& wrongs() const { return wrongs_; }
  bool has_played(Fault fault) const { return played_.contains(fault); }
  std::string story() const {
    std::string text;
    for (const std::string& line : story_) text += "  " + line + "\n";
    return text;
  }

 private:
  static constexpr double kLongest_s = 90.0;

  struct Event {
    double time_s;
    std::function<void()> happen;
  };

  bool has(Fault fault) const {
    return std::find(faults_.begin(), faults_.end(), fault) != faults_.end();
  }
  double now_s() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  /// The first stage that is not done.
  std::string stage_now() const {
    for (const std::string& stage : kBatchStages) {
      const JobFiles records{"", "state/0001/done/" + stage, "", ".json"};
      if (job_files(job_, records).size() < job_files(snapshots_.complete(), records).size())
        return stage;
    }
    return "nothing more";
  }
  void count(Fault fault) {
    played_.insert(fault);
    ++tally_.faults[fault_name(fault)];
    ++tally_.stages[fault_name(fault) + " in " + stage_now()];
  }
  void tell(const std::string& line) {
    story_.push_back(fmt::format("{:6.2f} s  {}", now_s(), line));
  }
  void fail(const std::string& what) {
    wrongs_.push_back(what);
    tell("WRONG: " + what);
  }

  void choose_start() {
    const std::size_t num_stages = dice_.index(kBatchStages.size() + 1);
    // A job that is complete has nothing to be cut off in.
    const bool is_at_rest = faults_ == std::vector<Fault>{Fault::DamageAtRest};
    num_done_ = is_at_rest ? num_stages : std::min(num_stages, kBatchStages.size() - 1);
    copy_job(snapshots_.after(num_done_), job_);
    tell(fmt::format("{} stages are done", num_done_));
  }

  void choose_clocks() {
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

  void set_clock(const std::string& offset) { write_text(clock_file_, offset + "\n"); }

  /// A moment at which work is going on, as far as that can be known beforehand.
  double some_moment_s() {
    double work_s = 0.3;
    for (std::size_t stage = num_done_; stage < kBatchStages.size(); ++stage)
      work_s += snapshots_.duration_s(stage);
    return dice_.between(0.02, work_s);
  }

  void lay_out_events() {
    for (const Fault fault : faults_) {
      if (fault == Fault::DamageAtRest || (is_of_clock(fault) && fault != Fault::ClockJump))
        continue;
      const std::size_t count = is_of_disk(fault) ? 1 : 1 + dice_.index(3);
      for (std::size_t i = 0; i < count; ++i)
        events_.push_back({some_moment_s(), [this, fault] { happen(fault); }});
    }
  }

  void happen(Fault fault) {
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

  void signal_one(Fault fault) {
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

  /// Until a worker has noticed, or a while has passed.
  void spoil_disk(Fault fault) {
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

  void mend_disk(double until_s) {
    if (num_noticed_ == 0 && now_s() < until_s && !workers_.empty()) {
      events_.push_back({now_s() + 0.02, [this, until_s] { mend_disk(until_s); }});
      return;
    }
    disk_.restore();
    spoilt_by_.reset();
    tell("the disk is well again");
  }

  void damage() {
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

  void start_worker() {
    if (num_started_ >= kMostWorkers) return;
    const auto& environment = clocks_[num_started_ % clocks_.size()];
    const fs::path output = scratch_ / fmt::format("worker-{}.log", num_started_);
    ++num_started_;
    workers_.emplace_back(TERRACAST_PROGRAM, run_arguments(), environment, output);
    tell(fmt::format("worker {} starts", workers_.back().process()));
  }

  std::vector<std::string> run_arguments() const {
    return {"batch",       "run", job_.string(), "--lease-s", fmt::format("{}", kLease_s),
            "--max-tries", "4",   "--threads",   "1",         "-q"};
  }

  /// As a cluster's queue does, puts others in the place of those that have ended.
  void look_after_workers() {
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

  /// Whether a command ended as it may.
  void judge(int status, const std::string& output) {
    ++tally_.ends[fmt::format("status {}", status)];
    if (status == 0 || status == -SIGKILL) return;
    ++tally_.failures[general(error_line(output))];
    const bool is_known = status == 1 || status == kInput || status == kIo;
    if (!is_known) return fail(fmt::format("a worker ended with status {}: {}", status, output));
    const auto has = [&](const std::string& text) {
      return output.find(text) != std::string::npos;
    };
    const bool tells_of_disk = has("Read-only file system") || has("No space left on device") ||
                               has("are left on its disk");
    if (tells_of_disk && has(job_.string())) {
      num_noticed_ += spoilt_by_ ? 1 : 0;
      return;
    }
    if (spoilt_by_ && status == kIo)
      return fail("the failure does not tell of the " + fault_name(*spoilt_by_) + ": " + output);
    const bool has_died = has("ended without a word");
    if (!has(job_.string() + "/") && !has_died) fail("a failure names no file: " + output);
  }

  /// Does what the program asks for, until the job is complete.
  void recover() {
    constexpr int kMostCommands = 12;
    bool is_retried = false;
    for (int i = 0; i < kMostCommands; ++i) {
      std::vector<std::string> arguments = run_arguments();
      if (is_retried) arguments.push_back("--retry");
      is_retried = false;
      const auto run = run_program(arguments, {.timeout_s = 60.0});
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
          run_program({"batch", "verify", job_.string(), "--repair", "--samples", "0", "-q"},
                      {.timeout_s = 60.0});
      tell(fmt::format("verify --repair: {} {}", verified.status, verified.output));
      if (verified.status != 0) ++tally_.failures[general(error_line(verified.output))];
      if (run.status == 0 && verified.status == 0) break;
    }
    for (const std::string& fault : faults_of_complete_job(job_, snapshots_.complete()))
      fail(fault);
  }

  /// A byte of the dataset that is wrong where none was damaged is one that the program wrote.
  void check_noticed() {
    const std::string difference = dataset_difference(job_, snapshots_.complete());
    const bool is_explained =
        std::any_of(damaged_.begin(), damaged_.end(), [](const std::string& file) {
          return file.starts_with("dataset") || file.starts_with("state/0001/checksums");
        });
    if (!difference.empty() && !is_explained) fail("a silent wrong byte: " + difference);
  }

  static constexpr int kMostWorkers = 16;

  Dice dice_;
  std::vector<Fault> faults_;
  const BatchSnapshots& snapshots_;
  OwnDisk& disk_;
  const FakeClock& clock_;
  fs::path scratch_;
  Tally& tally_;
  fs::path job_;
  fs::path clock_file_ = scratch_ / "clock";
  std::size_t num_done_ = 0;
  std::size_t num_wanted_ = 1;
  int num_started_ = 0;
  int num_owed_ = 0;
  int num_noticed_ = 0;  ///< workers that ended by the disk's fault
  std::optional<Fault> spoilt_by_;
  std::vector<FakeClock::Environment> clocks_;
  std::deque<Event> events_;
  std::list<StartedProgram> workers_;
  std::vector<std::string> damaged_;
  std::set<Fault> played_;
  Clock::time_point start_ = Clock::now();
  std::vector<std::string> story_, wrongs_;
};

std::uint64_t number_from_environment(const char* name, std::uint64_t otherwise) {
  const char* text = std::getenv(name);
  return text != nullptr ? std::strtoull(text, nullptr, 10) : otherwise;
}

void print(const char* title, const std::map<std::string, int>& counts) {
  std::cout << title << "\n";
  for (const auto& [what, count] : counts) std::cout << fmt::format("{:6}  {}\n", count, what);
}

TEST(Chaos, EveryRoundOfFaultsEndsInTheRightChecksums) {
  const std::uint64_t seed = number_from_environment("TERRACAST_CHAOS_SEED", 1);
  const auto num_rounds = static_cast<int>(
      number_from_environment("TERRACAST_CHAOS_ROUNDS", is_recorded_run() ? 100 : 10));
  std::cout << "TERRACAST_CHAOS_SEED=" << seed << ", " << num_rounds << " rounds\n";
  const ScratchFolder scratch;
  OwnDisk disk(scratch / "disk");
  const FakeClock clock;
  if (!disk.is_mounted())
    std::cout << "skipped: full and read-only disks, for nothing can be mounted here: "
              << disk.why_not() << "\n";
  if (!clock.is_there()) std::cout << "skipped: clocks that jump; faketime is not installed\n";
  const BatchSnapshots snapshots(scratch / "snapshots");
  ASSERT_FALSE(testing::Test::HasFailure());
  ASSERT_THAT(faults_of_complete_job(snapshots.complete(), snapshots.complete()),
              testing::IsEmpty());

  std::vector<Fault> possible;
  for (const Fault fault : kFaults)
    if ((disk.is_mounted() || !is_of_disk(fault)) && (clock.is_there() || !is_of_clock(fault)))
      possible.push_back(fault);
  Tally tally;
  std::vector<Fault> deck;
  for (int number = 0; number < num_rounds; ++number) {
    Dice dice(seed, 1000000 + static_cast<std::uint64_t>(number));
    // In ten rounds every fault comes up, by itself or with one or two others.
    if (deck.empty()) {
      deck = possible;
      for (std::size_t i = deck.size(); i > 1; --i) std::swap(deck[i - 1], deck[dice.index(i)]);
    }
    std::vector<Fault> faults = {deck.back()};
    deck.pop_back();
    for (std::size_t i = 0, count = dice.index(3); i < count; ++i) {
      const Fault other = possible[dice.index(possible.size())];
      const bool is_new = std::find(faults.begin(), faults.end(), other) == faults.end();
      const bool is_second_clock =
          is_of_clock(other) && std::any_of(faults.begin(), faults.end(), is_of_clock);
      const bool is_second_disk =
          is_of_disk(other) && std::any_of(faults.begin(), faults.end(), is_of_disk);
      if (is_new && !is_second_clock && !is_second_disk) faults.push_back(other);
    }
    // A fault of which nothing came, since no worker was at work just then, is played again.
    constexpr int kMostTimes = 5;
    bool has_played = false;
    for (int time = 0; time < kMostTimes && !has_played; ++time) {
      Round round(seed, number + 1000 * time, faults, snapshots, disk, clock, scratch.path(),
                  tally);
      round.play();
      has_played = round.has_played(faults.front());
      std::string wrongs;
      for (const std::string& wrong : round.wrongs()) wrongs += wrong + "\n";
      EXPECT_EQ(wrongs, "") << "TERRACAST_CHAOS_SEED=" << seed << ", round " << number << " of "
                            << num_rounds << ", what happened:\n"
                            << round.story();
    }
    EXPECT_TRUE(has_played) << fault_name(faults.front()) << ": not in " << kMostTimes << " times";
  }
  print("faults:", tally.faults);
  print("when:", tally.stages);
  print("damaged files:", tally.damages);
  print("ends of commands:", tally.ends);
  print("failures seen:", tally.failures);
}

}  // namespace
}  // namespace terracast::test
