#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <thread>

#include "batch/job_folder.h"
#include "core/atomic_file.h"
#include "tests/support/test_data.h"

namespace terracast::batch {
namespace {

namespace fs = std::filesystem;

fs::path made_in(const Attempt& attempt, const std::string& text) {
  const fs::path made = attempt.folder() / "made";
  core::write_file(made / "sub/file", text);
  return made;
}

TEST(Attempt, WhatItMadeIsPutInPlaceAndTheRestVanishes) {
  const test::ScratchFolder folder;
  const JobFolder job{folder.path()};
  const fs::path place = folder / "dataset/kitti/run";
  {
    Attempt attempt(job);
    core::write_file(attempt.folder() / "other", "x");
    attempt.place(made_in(attempt, "first"), place);
    EXPECT_EQ(core::read_text_file(place / "sub/file"), "first");
    attempt.place_text("sums", folder / "checksums/run");
    attempt.place_text("sums again", folder / "checksums/run");
  }
  {
    Attempt attempt(job);
    core::write_file(place / "stray", "of no use");
    attempt.place(made_in(attempt, "second"), place);
  }
  EXPECT_EQ(core::read_text_file(place / "sub/file"), "second");
  EXPECT_FALSE(fs::exists(place / "stray"));
  EXPECT_EQ(core::read_text_file(folder / "checksums/run"), "sums again");
  EXPECT_TRUE(fs::is_empty(job.attempts()));
}

TEST(Attempt, WhatItTakesAwayVanishesWithIt) {
  const test::ScratchFolder folder;
  const JobFolder job{folder.path()};
  core::write_file(folder / "world/a/tile", "damaged");
  {
    Attempt attempt(job);
    attempt.take_away(folder / "world/a");
    attempt.take_away(folder / "world/b");  // is not there
    EXPECT_FALSE(fs::exists(folder / "world/a"));
  }
  EXPECT_TRUE(fs::is_empty(job.attempts()));
}

// Seen in 2026: of two workers at one shard the late one took the other's away before it put its own
// in place; killed in between, it left the dataset without either, and the shard was done.
TEST(Attempt, WhereATwinPutItsOwnThereIsNoMomentWithoutOne) {
  const test::ScratchFolder folder;
  const JobFolder job{folder.path()};
  const fs::path place = folder / "dataset/run";
  {
    Attempt attempt(job);
    attempt.place(made_in(attempt, "same"), place);
  }
  std::atomic<bool> has_ended = false;
  std::atomic<int> num_missed = 0;
  std::atomic<int> num_looks = 0;
  std::thread reader([&] {
    while (!has_ended) {
      num_missed += ::access(place.c_str(), F_OK) == 0 ? 0 : 1;
      ++num_looks;
    }
  });
  for (int i = 0; i < 40; ++i) {
    Attempt attempt(job);
    attempt.place(made_in(attempt, "same"), place);
  }
  has_ended = true;
  reader.join();
  EXPECT_EQ(num_missed, 0) << "of " << num_looks;
}

TEST(Attempt, ThoseOfEndedProcessesAreRemovedAndOtherMachinesAreGivenADay) {
  const test::ScratchFolder folder;
  const JobFolder job{folder.path()};
  const pid_t child = ::fork();
  if (child == 0) {
    const Attempt attempt(job);
    core::write_file(attempt.folder() / "half", "x");
    ::_exit(0);
  }
  ::waitpid(child, nullptr, 0);
  ASSERT_FALSE(fs::is_empty(job.attempts()));
  const Attempt living(job);
  const fs::path young = job.attempts() / "01234567-1-5-0123456789abcdef";
  const fs::path old = job.attempts() / "01234567-2-5-0123456789abcdef";
  for (const fs::path& foreign : {young, old}) fs::create_directories(foreign);
  // A shard that takes long: its folder is old, but something is made in it.
  const fs::path busy = job.attempts() / "01234567-3-5-0123456789abcdef";
  core::write_file(busy / "colmap/images/0001.png", "x");
  for (const fs::path& foreign : {old, busy})
    fs::last_write_time(foreign, fs::last_write_time(young) - std::chrono::hours(25));
  remove_ended_attempts(job);
  std::vector<fs::path> left;
  for (const auto& entry : fs::directory_iterator(job.attempts())) left.push_back(entry.path());
  EXPECT_THAT(left, testing::UnorderedElementsAre(living.folder(), young, busy));
}

}  // namespace
}  // namespace terracast::batch
