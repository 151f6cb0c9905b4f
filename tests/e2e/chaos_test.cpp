#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tests/e2e/batch_job.h"
#include "tests/e2e/chaos_faults.h"
#include "tests/e2e/chaos_round.h"
#include "tests/e2e/chaos_tally.h"
#include "tests/e2e/dice.h"
#include "tests/e2e/fake_clock.h"
#include "tests/e2e/own_disk.h"
#include "tests/support/record.h"
#include "tests/support/test_data.h"

/// Rounds of faults on a small batch job. Each ends in the right checksums, after what the program
/// itself asks for, or fails the test with what was done.
///
///     TERRACAST_CHAOS_SEED=7     another course of events (printed with each failure)
///     TERRACAST_CHAOS_ROUNDS=3   of it alone the first ones; 3, and 100 under TERRACAST_FULL
namespace terracast::test {
namespace {

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
      number_from_environment("TERRACAST_CHAOS_ROUNDS", is_recorded_run() ? 100 : 3));
  std::cout << "TERRACAST_CHAOS_SEED=" << seed << ", " << num_rounds << " rounds\n";
  const ScratchFolder scratch;
  OwnDisk disk(scratch / "disk");
  const FakeClock clock;
  if (!disk.is_mounted())
    std::cout << "skipped: full and read-only disks, for nothing can be mounted here: "
              << disk.why_not() << "\n";
  if (!clock.is_there()) std::cout << "skipped: clocks that jump; faketime is not installed\n";
  const BatchSnapshots snapshots;
  ASSERT_FALSE(testing::Test::HasFailure());
  copy_job(snapshots.complete(), scratch / "complete");
  ASSERT_THAT(faults_of_complete_job(scratch / "complete", snapshots.complete()),
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
