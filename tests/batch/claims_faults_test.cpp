#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <functional>
#include <thread>

#include "batch/claims.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "tests/support/test_data.h"

namespace terracast::batch {
namespace {

namespace fs = std::filesystem;
using Standing = Claims::Standing;

constexpr ShardId kShard{.stage = Stage::Render, .index = 7};
const fs::path kFirstTry = "claims/render/000007.1";
const fs::path kRecord = "done/render/000/000007.json";

core::Json some_record() { return core::Json::object().set("frames", 5); }

/// Runs work in a process of its own, which ends without cleaning up behind it.
pid_t in_process(const std::function<void()>& work) {
  const pid_t child = ::fork();
  if (child == 0) {
    work();
    ::_exit(0);
  }
  return child;
}

void end_with(pid_t child, int signal) {
  ::kill(child, signal);
  ::waitpid(child, nullptr, 0);
}

bool comes(const std::function<bool()>& condition, double within_s = 20.0) {
  const auto start = std::chrono::steady_clock::now();
  while (!condition()) {
    if (std::chrono::steady_clock::now() - start > std::chrono::duration<double>(within_s))
      return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return true;
}

/// A process that claims the shard and lives until it is ended.
pid_t claimed_by_other(const fs::path& folder, const ClaimOptions& options) {
  const pid_t child = in_process([&] {
    Claims claims(folder, options);
    const auto claimed = claims.claim(kShard);
    core::write_file(folder / "claimed", "");
    while (true) ::pause();
  });
  EXPECT_TRUE(comes([&] { return fs::exists(folder / "claimed"); }));
  return child;
}

/// As of a machine whose clock is ahead.
void set_time_ahead(const fs::path& file, std::time_t ahead_s) {
  const timespec times[2] = {{.tv_sec = ::time(nullptr) + ahead_s, .tv_nsec = 0},
                             {.tv_sec = ::time(nullptr) + ahead_s, .tv_nsec = 0}};
  ASSERT_EQ(::utimensat(AT_FDCWD, file.c_str(), times, 0), 0);
}

// Seen in 2026 with a clock two days ahead: what a stopped process held was held for two days.
TEST(ClaimFaults, AClaimThatNobodyRenewsIsLostEvenWhenItsTimeLiesAhead) {
  const test::ScratchFolder folder;
  constexpr ClaimOptions kOptions{.lease_s = 0.5};
  const pid_t child = claimed_by_other(folder.path(), kOptions);
  ::kill(child, SIGSTOP);
  set_time_ahead(folder / kFirstTry, 172800);
  Claims claims(folder.path(), kOptions);
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(claims.standing(kShard), Standing::Held);
  EXPECT_TRUE(comes([&] { return claims.standing(kShard) == Standing::Free; }));
  EXPECT_GT(std::chrono::steady_clock::now() - start, std::chrono::duration<double>(0.5))
      << "not before the lease was over";
  end_with(child, SIGKILL);
}

TEST(ClaimFaults, AClaimThatIsRenewedStaysThoughItsTimeLiesAhead) {
  const test::ScratchFolder folder;
  constexpr ClaimOptions kOptions{.lease_s = 0.6};
  const pid_t child = claimed_by_other(folder.path(), {.lease_s = 3600.0});  // does not renew
  Claims claims(folder.path(), kOptions);
  for (int i = 0; i < 12; ++i) {
    set_time_ahead(folder / kFirstTry, 172800 + i);
    EXPECT_EQ(claims.standing(kShard), Standing::Held);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  end_with(child, SIGKILL);
}

TEST(ClaimFaults, WhatEndedProcessesLeftIsClearedUpAndTheLivingKeepTheirs) {
  const test::ScratchFolder folder;
  constexpr ClaimOptions kOptions{.lease_s = 3600.0};
  constexpr ShardId kLiving{.stage = Stage::Export, .index = 3};
  Claims claims(folder.path(), kOptions);
  auto living = claims.claim(kLiving);
  // One died at the shard and in the middle of a file; another took its place and did it.
  const pid_t child = claimed_by_other(folder.path(), kOptions);
  const pid_t writer = in_process([&] {
    core::write_file_by(folder / "claims/render/000009.1", [](const fs::path& unfinished) {
      std::ofstream(unfinished) << "half";
      ::_exit(0);
    });
  });
  ::waitpid(writer, nullptr, 0);
  end_with(child, SIGKILL);
  // One looked at a claim of the living, for which it needed the time.
  const pid_t onlooker = in_process([&] {
    Claims others(folder.path(), kOptions);
    others.standing(kLiving);
    ::_exit(0);
  });
  ::waitpid(onlooker, nullptr, 0);
  ASSERT_FALSE(fs::is_empty(folder / "clocks"));
  auto next = claims.claim(kShard);
  ASSERT_TRUE(std::holds_alternative<Claim>(next));
  std::get<Claim>(next).commit(some_record());
  ASSERT_TRUE(fs::exists(folder / kFirstTry)) << "nobody has cleared up behind it yet";
  core::write_file(folder / "claims/render/000001.4.end", "{}");  // of a try that is gone

  std::vector<std::string> cleared;
  claims.clear_up([&](const ShardId& shard) {
    EXPECT_TRUE(fs::exists(folder / kFirstTry)) << "forgotten before it was cleared";
    cleared.push_back(shard.text());
  });
  EXPECT_THAT(cleared, testing::ElementsAre("render/7"));
  EXPECT_TRUE(fs::is_empty(folder / "claims/render"));
  EXPECT_TRUE(fs::exists(folder / "claims/export/000003.1"));
  EXPECT_TRUE(fs::is_empty(folder / "clocks"));
  EXPECT_EQ(claims.standing(kShard), Standing::Done);
}

TEST(ClaimFaults, TriesOfAShardThatIsNotDoneAreClearedButStillCounted) {
  const test::ScratchFolder folder;
  end_with(claimed_by_other(folder.path(), {}), SIGKILL);
  Claims claims(folder.path(), {.max_tries = 1});
  int num_cleared = 0;
  claims.clear_up([&](const ShardId&) { ++num_cleared; });
  EXPECT_EQ(num_cleared, 1);
  EXPECT_EQ(claims.standing(kShard), Standing::Poisoned);
}

TEST(ClaimFaults, TheFailureOfATryThatIsGoneEndsNobodyElses) {
  const test::ScratchFolder folder;
  Claims claims(folder.path(), {});
  auto first = claims.claim(kShard);
  ASSERT_TRUE(std::holds_alternative<Claim>(first));
  fs::remove(folder / kFirstTry);
  std::get<Claim>(first).fail("too late");
  auto second = claims.claim(kShard);
  ASSERT_TRUE(std::holds_alternative<Claim>(second));
  EXPECT_EQ(claims.standing(kShard), Standing::Held);
}

TEST(ClaimFaults, ARecordThatWasDamagedIsNamed) {
  const test::ScratchFolder folder;
  Claims claims(folder.path(), {});
  auto claimed = claims.claim(kShard);
  std::get<Claim>(claimed).commit(some_record());
  EXPECT_EQ(claims.record(kShard).at("frames").integer(), 5);
  const std::string good = core::read_text_file(folder / kRecord);
  std::string bad = good;
  bad.at(bad.find("\"frames\": 5") + 10) = '7';
  for (const std::string& text : {bad, good.substr(0, 9), std::string()}) {
    core::write_file(folder / kRecord, text);
    try {
      claims.record(kShard);
      FAIL() << text;
    } catch (const core::Error& error) {
      EXPECT_EQ(error.kind(), core::ErrorKind::Input);
      EXPECT_THAT(error.what(), testing::AllOf(testing::HasSubstr((folder / kRecord).string()),
                                               testing::HasSubstr("--repair")));
    }
  }
  claims.reopen(kShard);
  EXPECT_EQ(claims.standing(kShard), Standing::Free);
}

TEST(ClaimFaults, AShardThatIsReopenedIsFreeHoweverOftenItFailed) {
  const test::ScratchFolder folder;
  Claims claims(folder.path(), {.max_tries = 3});
  end_with(claimed_by_other(folder.path(), {}), SIGKILL);  // lost
  for (int i = 0; i < 2; ++i) {
    auto claimed = claims.claim(kShard);
    ASSERT_TRUE(std::holds_alternative<Claim>(claimed));
    std::get<Claim>(claimed).fail("damaged data");
  }
  ASSERT_EQ(claims.standing(kShard), Standing::Poisoned);
  ASSERT_EQ(claims.tried().at(0).last_error(), "damaged data");
  claims.reopen(kShard);
  EXPECT_EQ(claims.standing(kShard), Standing::Free);
  // Those that follow count from none.
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(claims.standing(kShard), Standing::Free) << i;
    auto claimed = claims.claim(kShard);
    std::get<Claim>(claimed).fail("again");
  }
  EXPECT_EQ(claims.standing(kShard), Standing::Poisoned);
}

TEST(ClaimFaults, WhoCannotWriteLooksAllTheSame) {
  const test::ScratchFolder folder;
  const pid_t child = claimed_by_other(folder.path(), {});
  fs::remove_all(folder / "clocks");
  core::write_file(folder / "clocks", "a file where the folder must be");
  const Claims claims(folder.path(), {});
  ASSERT_EQ(claims.tried().size(), 1U);
  EXPECT_FALSE(claims.tried()[0].holder.empty());
  end_with(child, SIGKILL);
}

}  // namespace
}  // namespace terracast::batch
