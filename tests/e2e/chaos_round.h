#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <list>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tests/e2e/batch_job.h"
#include "tests/e2e/chaos_faults.h"
#include "tests/e2e/chaos_tally.h"
#include "tests/e2e/dice.h"
#include "tests/e2e/fake_clock.h"
#include "tests/e2e/own_disk.h"
#include "tests/e2e/started_program.h"

namespace terracast::test {

/// One job, its workers, and what befalls them.
class Round {
 public:
  Round(std::uint64_t seed, int number, const std::vector<Fault>& faults,
        const BatchSnapshots& snapshots, OwnDisk& disk, const FakeClock& clock,
        const std::filesystem::path& scratch, Tally& tally);
  ~Round();
  Round(const Round&) = delete;
  Round& operator=(const Round&) = delete;

  void play();

  /// What was not as it ought to be.
  const std::vector<std::string>& wrongs() const { return wrongs_; }
  /// Whether anything came of a fault.
  bool has_played(Fault fault) const { return played_.contains(fault); }
  /// All that happened, a line each.
  std::string story() const;

 private:
  using Clock = std::chrono::steady_clock;

  static constexpr double kLongest_s = 90.0;

  struct Event {
    double time_s;
    std::function<void()> happen;
  };

  bool has(Fault fault) const;
  double now_s() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  /// The first stage that is not done.
  std::string stage_now() const;
  void count(Fault fault);
  void tell(const std::string& line);
  void fail(const std::string& what);

  void choose_start();
  void choose_clocks();
  void set_clock(const std::string& offset);
  /// A moment at which work is going on, as far as that can be known beforehand.
  double some_moment_s();
  void lay_out_events();
  void happen(Fault fault);
  void signal_one(Fault fault);
  /// Until a worker has noticed, or a while has passed.
  void spoil_disk(Fault fault);
  void mend_disk(double until_s);
  void damage();

  void start_worker();
  std::vector<std::string> run_arguments() const;
  /// As a cluster's queue does, puts others in the place of those that have ended.
  void look_after_workers();

  /// Whether a command ended as it may.
  void judge(int status, const std::string& output);

  /// Does what the program asks for, until the job is complete.
  void recover();

  /// A byte of the dataset that is wrong where none was damaged is one that the program wrote.
  void check_noticed();

  static constexpr int kMostWorkers = 16;

  Dice dice_;
  std::vector<Fault> faults_;
  const BatchSnapshots& snapshots_;
  OwnDisk& disk_;
  const FakeClock& clock_;
  std::filesystem::path scratch_;
  Tally& tally_;
  std::filesystem::path job_;
  std::filesystem::path clock_file_ = scratch_ / "clock";
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

}  // namespace terracast::test
