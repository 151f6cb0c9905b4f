#include "batch/claims.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <thread>

#include "core/atomic_file.h"
#include "core/error.h"
#include "tests/support/test_data.h"

namespace terracast::batch {
namespace {

namespace fs = std::filesystem;

constexpr ShardId kShard{.stage = Stage::Render, .index = 1234};

core::Json record_of(const std::string& text) { return core::Json::object().set("by", text); }

/// Runs work in a process of its own, which ends without cleaning up behind it.
pid_t in_process(const std::function<int()>& work) {
  const pid_t child = ::fork();
  if (child != 0) return child;
  try {
    ::_exit(work());
  } catch (...) {
    ::_exit(99);
  }
}

int status_of_process(pid_t child) {
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

void wait_for(const fs::path& file) {
  const auto start = std::chrono::steady_clock::now();
  while (!fs::exists(file)) {
    ASSERT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20)) << file;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

void sleep_s(double duration_s) {
  std::this_thread::sleep_for(std::chrono::duration<double>(duration_s));
}

Claims::Standing standing_after_claim(Claims& claims, const ShardId& shard = kShard) {
  const auto claimed = claims.claim(shard);
  const auto* standing = std::get_if<Claims::Standing>(&claimed);
  return standing != nullptr ? *standing : Claims::Standing::Free;
}

TEST(Claims, OneOfManyProcessesGetsEachShardAndItsRecordStays) {
  const test::ScratchFolder folder;
  constexpr int kShards = 60;
  constexpr int kWorkers = 6;
  std::vector<pid_t> workers;
  for (int worker = 0; worker < kWorkers; ++worker)
    workers.push_back(in_process([&] {
      Claims claims(folder.path(), {});
      while (!fs::exists(folder / "start")) std::this_thread::yield();
      for (int i = 0; i < kShards; ++i) {
        auto claimed = claims.claim({Stage::Tile, i});
        if (auto* claim = std::get_if<Claim>(&claimed)) {
          std::ofstream(folder / fmt::format("worked-{}-{}", i, worker)) << "";
          claim->commit(record_of(std::to_string(worker)));
        }
      }
      return 0;
    }));
  core::write_file(folder / "start", "");
  for (const pid_t worker : workers) EXPECT_EQ(status_of_process(worker), 0);
  std::map<int, int> num_workers_of;
  for (const auto& entry : fs::directory_iterator(folder.path()))
    if (const std::string name = entry.path().filename(); name.starts_with("worked-"))
      ++num_workers_of[std::stoi(name.substr(7))];
  const Claims claims(folder.path(), {});
  EXPECT_EQ(claims.done(Stage::Tile).size(), static_cast<std::size_t>(kShards));
  for (int i = 0; i < kShards; ++i) EXPECT_EQ(num_workers_of[i], 1) << "shard " << i;
  EXPECT_THAT(claims.tried(), testing::IsEmpty());
  EXPECT_TRUE(fs::is_empty(folder / "claims/tile")) << "claims are taken back";
}

TEST(Claims, WhatADeadProcessHeldIsFreeAtOnce) {
  const test::ScratchFolder folder;
  const pid_t child = in_process([&] {
    Claims claims(folder.path(), {.lease_s = 3600.0});
    auto claimed = claims.claim(kShard);
    return std::holds_alternative<Claim>(claimed) ? (::_exit(0), 0) : 1;
  });
  EXPECT_EQ(status_of_process(child), 0);
  Claims claims(folder.path(), {.lease_s = 3600.0});
  EXPECT_EQ(claims.standing(kShard), Claims::Standing::Free);
  auto claimed = claims.claim(kShard);
  ASSERT_TRUE(std::holds_alternative<Claim>(claimed));
  std::get<Claim>(claimed).fail("second try");
  const auto tried = claims.tried();
  ASSERT_EQ(tried.size(), 1U);
  ASSERT_EQ(tried[0].ends.size(), 2U);
  EXPECT_EQ(tried[0].ends[0].how, TryEnd::How::Lost);
  EXPECT_EQ(tried[0].ends[1].how, TryEnd::How::Failed);
  EXPECT_EQ(tried[0].ends[1].error, "second try");
}

TEST(Claims, AStoppedProcessLosesItsClaimAfterTheLeaseAndItsLateRecordChangesNothing) {
  const test::ScratchFolder folder;
  constexpr ClaimOptions kOptions{.lease_s = 1.2};
  const pid_t child = in_process([&] {
    Claims claims(folder.path(), kOptions);
    auto claimed = claims.claim(kShard);
    core::write_file(folder / "claimed", "");
    wait_for(folder / "go on");
    std::get<Claim>(claimed).commit(record_of("the stopped one"));
    return 0;
  });
  wait_for(folder / "claimed");
  Claims claims(folder.path(), kOptions);
  EXPECT_EQ(standing_after_claim(claims), Claims::Standing::Held);
  sleep_s(3.0);  // it lives: two and a half leases long its claim is renewed
  EXPECT_EQ(standing_after_claim(claims), Claims::Standing::Held);
  ::kill(child, SIGSTOP);
  sleep_s(2.0);
  auto claimed = claims.claim(kShard);
  ASSERT_TRUE(std::holds_alternative<Claim>(claimed));
  ::kill(child, SIGCONT);
  sleep_s(0.3);
  EXPECT_EQ(standing_after_claim(claims), Claims::Standing::Held) << "the new holder's";
  std::get<Claim>(claimed).commit(record_of("the next one"));
  core::write_file(folder / "go on", "");
  EXPECT_EQ(status_of_process(child), 0);
  EXPECT_EQ(claims.record(kShard).at("by").string(), "the next one");
  EXPECT_EQ(claims.standing(kShard), Claims::Standing::Done);
  EXPECT_THAT(claims.done(Stage::Render), testing::ElementsAre(kShard.index));
}

TEST(Claims, TheLeaseThatCountsIsTheHoldersOwn) {
  const test::ScratchFolder folder;
  for (const bool is_long : {true, false}) {
    const ShardId shard{Stage::Render, is_long ? 1 : 2};
    const fs::path claimed = folder / (is_long ? "claimed-long" : "claimed-short");
    const pid_t child = in_process([&] {
      Claims claims(folder.path(), {.lease_s = is_long ? 3600.0 : 0.6});
      const auto claim = claims.claim(shard);
      core::write_file(claimed, "");
      for (;;) ::pause();
      return 0;
    });
    wait_for(claimed);
    ::kill(child, SIGSTOP);
    Claims others(folder.path(), {.lease_s = is_long ? 0.6 : 3600.0});
    sleep_s(1.5);  // more than the short one
    EXPECT_EQ(others.standing(shard), is_long ? Claims::Standing::Held : Claims::Standing::Free);
    ::kill(child, SIGKILL);
    status_of_process(child);
  }
}

TEST(Claims, FailuresAndLossesPoisonAShardAndReleasesDoNot) {
  const test::ScratchFolder folder;
  Claims claims(folder.path(), {.max_tries = 2});
  for (int i = 0; i < 5; ++i) {
    auto claimed = claims.claim(kShard);
    ASSERT_TRUE(std::holds_alternative<Claim>(claimed)) << i;
    std::get<Claim>(claimed).release();
  }
  for (int i = 0; i < 2; ++i) {
    auto claimed = claims.claim(kShard);
    ASSERT_TRUE(std::holds_alternative<Claim>(claimed)) << i;
    std::get<Claim>(claimed).fail(fmt::format("error {}", i));
  }
  EXPECT_EQ(standing_after_claim(claims), Claims::Standing::Poisoned);
  ASSERT_EQ(claims.tried().size(), 1U);
  EXPECT_TRUE(claims.tried()[0].is_poisoned);
  // Asked for by name it is tried all the same.
  auto retried = claims.claim(kShard, true);
  ASSERT_TRUE(std::holds_alternative<Claim>(retried));
  std::get<Claim>(retried).commit(record_of("a retry"));
  EXPECT_EQ(claims.standing(kShard), Claims::Standing::Done);
  claims.reopen(kShard);
  EXPECT_EQ(claims.standing(kShard), Claims::Standing::Free) << "its failures are forgotten";
}

TEST(Claims, AReopenedShardIsForgivenItsFailuresBehindAMissingTryToo) {
  const test::ScratchFolder folder;
  Claims claims(folder.path(), {.max_tries = 2});
  const auto fail_once = [&] {
    auto claimed = claims.claim(kShard, true);
    ASSERT_TRUE(std::holds_alternative<Claim>(claimed));
    std::get<Claim>(claimed).fail("an error");
  };
  for (int i = 0; i < 3; ++i) fail_once();
  fs::remove(folder / "claims/render/001234.2");  // as by a worker that did the shard after all
  fs::remove(folder / "claims/render/001234.2.end");
  claims.reopen(kShard);
  fail_once();
  EXPECT_EQ(claims.standing(kShard), Claims::Standing::Free) << "one failure counts, of two";
}

TEST(Claims, AnErrorOfAnyBytesIsKept) {
  const test::ScratchFolder folder;
  Claims claims(folder.path(), {});
  auto claimed = claims.claim(kShard);
  ASSERT_TRUE(std::holds_alternative<Claim>(claimed));
  std::get<Claim>(claimed).fail("M\xfcnchen.tif: cannot be read\nin M\xc3\xbcnchen");
  ASSERT_EQ(claims.tried().size(), 1U);
  EXPECT_EQ(claims.tried()[0].ends.at(0).how, TryEnd::How::Failed);
  EXPECT_EQ(claims.tried()[0].ends.at(0).error,
            "M\\xfcnchen.tif: cannot be read\nin M\xc3\xbcnchen");
}

TEST(Claims, AClaimThatGoesOutOfSightIsReleased) {
  const test::ScratchFolder folder;
  Claims claims(folder.path(), {});
  { auto claimed = claims.claim(kShard); }
  ASSERT_EQ(claims.tried().size(), 1U);
  EXPECT_EQ(claims.tried()[0].ends.at(0).how, TryEnd::How::Released);
  EXPECT_EQ(claims.standing(kShard), Claims::Standing::Free);
}

TEST(Claims, DamagedClaimsAndForeignFilesHurtNobody) {
  const test::ScratchFolder folder;
  core::write_file(folder / "claims/render/001234.1", "half a");
  core::write_file(folder / "claims/render/001234.1.end", "{\"how\": 3}");
  core::write_file(folder / "claims/render/readme", "");
  core::write_file(folder / "done/render/001/notes.json", "");
  core::write_file(folder / "done/render/001/-00012.json", "");
  Claims claims(folder.path(), {});
  EXPECT_THAT(claims.done(Stage::Render), testing::IsEmpty());
  EXPECT_EQ(claims.tried().size(), 1U);
  EXPECT_EQ(standing_after_claim(claims), Claims::Standing::Free);
}

TEST(Claims, AFolderThatCannotBeMadeIsNamed) {
  const test::ScratchFolder folder;
  core::write_file(folder / "claims", "a file where the folder must be");
  Claims claims(folder.path(), {});
  try {
    claims.claim(kShard);
    FAIL();
  } catch (const core::Error& error) {
    EXPECT_EQ(error.kind(), core::ErrorKind::Io);
    EXPECT_THAT(error.what(), testing::HasSubstr((folder / "claims").string()));
  }
}

}  // namespace
}  // namespace terracast::batch
