#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <ctime>
#include <sstream>
#include <thread>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/json.h"
#include "core/log.h"
#include "core/progress.h"
#include "core/rate_window.h"
#include "core/stage_cost.h"
#include "tests/support/test_data.h"

namespace terracast::core {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;

template <class Work>
std::string stderr_of(Work&& work) {
  testing::internal::CaptureStderr();
  work();
  return testing::internal::GetCapturedStderr();
}

TEST(LogTest, LinesHaveTimeStageAndLevel) {
  const std::string text = stderr_of([] {
    const Log log("tile", LogLevel::Debug);
    log.info("{} tiles", 5);
    log.warn("voids {}", "{}");
    log.for_stage("render").debug("frame");
  });
  EXPECT_THAT(text, MatchesRegex("\\[ *[0-9]+\\.[0-9][0-9]\\] tile: 5 tiles\n"
                                 "\\[ *[0-9]+\\.[0-9][0-9]\\] tile: warning: voids \\{\\}\n"
                                 "\\[ *[0-9]+\\.[0-9][0-9]\\] render: debug: frame\n"));
}

TEST(LogTest, LevelsBelowAreSilent) {
  EXPECT_EQ(stderr_of([] {
              const Log log("tile", LogLevel::Warn);
              log.debug("x");
              log.info("x");
              const Log off = Log("tile", LogLevel::Off).for_stage("render");
              off.warn("x");
              EXPECT_EQ(off.level(), LogLevel::Off);
            }),
            "");
}

TEST(LogTest, LinesOfManyThreadsDoNotMix) {
  const std::string text = stderr_of([] {
    const Log log("tile");
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t)
      threads.emplace_back([&log] {
        for (int i = 0; i < 100; ++i) log.info("{}", std::string(200, 'x'));
      });
    for (std::thread& thread : threads) thread.join();
  });
  std::istringstream lines(text);
  int count = 0;
  for (std::string line; std::getline(lines, line); ++count)
    ASSERT_TRUE(line.ends_with("tile: " + std::string(200, 'x')));
  EXPECT_EQ(count, 400);
}

TEST(RateWindowTest, FollowsTheRecentRate) {
  RateWindow window(100.0);
  EXPECT_FALSE(window.rate());
  EXPECT_FALSE(window.time_for(5));
  // 2 units a second for 100 s, then 10 a second for 40 s: the window of 30 s has forgotten the
  // start.
  double time_s = 100.0;
  std::int64_t done = 0;
  for (int i = 0; i < 100; ++i) window.add(time_s += 1.0, done += 2);
  EXPECT_NEAR(*window.rate(), 2.0, 1e-9);
  for (int i = 0; i < 40; ++i) window.add(time_s += 1.0, done += 10);
  EXPECT_NEAR(*window.rate(), 10.0, 1e-9);
  EXPECT_NEAR(*window.time_for(50), 5.0, 1e-9);
}

TEST(RateWindowTest, SlowUnitsAreKeptUntilThereAreEight) {
  RateWindow window(0.0);
  for (int i = 1; i <= 20; ++i) window.add(60.0 * i, i);
  EXPECT_NEAR(*window.rate(), 1.0 / 60.0, 1e-12);
  window.add(60.0 * 20 + 60.0, 20);  // a minute in which nothing was finished
  EXPECT_LT(*window.rate(), 1.0 / 60.0);
  EXPECT_GT(*window.rate(), 0.8 / 60.0);
}

TEST(ProgressTest, EndsWithOneLineAndOneEvent) {
  const test::ScratchFolder folder;
  const std::string text = stderr_of([&] {
    const Log log("tile");
    const Context context{.log = log, .events_file = folder / "run/events.jsonl"};
    for (int round = 0; round < 2; ++round) {
      Progress progress(context, "tiles", 10);
      progress.skip(3);
      std::vector<std::thread> threads;
      for (int t = 0; t < 6; ++t) threads.emplace_back([&] { progress.advance(); });
      for (std::thread& thread : threads) thread.join();
    }
  });
  EXPECT_THAT(text, HasSubstr("tile: 9 of 10 tiles in "));
  EXPECT_THAT(text, HasSubstr("(3 were there already)\n"));
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 2);
  std::istringstream lines(read_text_file(folder / "run/events.jsonl"));
  int count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    const Json event = Json::parse(line, "events.jsonl");
    EXPECT_THAT(event.at("time").string(), MatchesRegex("20..-..-..T..:..:..Z"));
    EXPECT_EQ(event.at("what").string(), "tiles");
    EXPECT_EQ(event.at("done").integer(), 9);
    EXPECT_EQ(event.at("total").integer(), 10);
    EXPECT_GT(event.at("rate").number(), 0.0);
    // One unit is left: its time is that of one at the rate.
    EXPECT_NEAR(event.at("left_s").number() * event.at("rate").number(), 1.0, 1e-9);
  }
  EXPECT_EQ(count, 2);
}

TEST(ProgressTest, WorkThatWasAllThereHasNoRate) {
  const test::ScratchFolder folder;
  stderr_of([&] {
    const Log log("tile");
    Progress progress({.log = log, .events_file = folder / "e"}, "tiles", 4);
    progress.skip(4);
  });
  const Json event = Json::parse(read_text_file(folder / "e"), "e");
  EXPECT_TRUE(event.at("rate").is_null());
  EXPECT_EQ(event.at("left_s").number(), 0.0);
}

TEST(ProgressTest, EventsThatCannotBeWrittenAreToldOnce) {
  const test::ScratchFolder folder;
  const Log log("tile");
  write_file(folder / "file", "x");
  EXPECT_THROW(Progress({.log = log, .events_file = folder / "file/e"}, "tiles", 4), Error);
  const std::string text = stderr_of([&] {
    const Log loud("tile");
    Progress progress({.log = loud, .events_file = "/dev/full"}, "tiles", 4);
    progress.advance();
  });
  EXPECT_THAT(text, HasSubstr("warning: the progress events cannot be written: No space left"));
}

TEST(StageCostTest, SaysWallCpuAndPeakMemory) {
  const test::ScratchFolder folder;
  constexpr std::size_t kBytes = 96 << 20;
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t cpu_start = std::clock();
  const std::string text = stderr_of([&] {
    const Log log("tile");
    const StageCost cost({.log = log, .events_file = folder / "e"}, "tiling");
    const std::clock_t work_start = std::clock();
    std::thread([&] {
      const std::vector<char> much(kBytes, 1);
      while (std::clock() - work_start < CLOCKS_PER_SEC / 5) EXPECT_EQ(much[kBytes / 2], 1);
    }).join();
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
  });
  const double cpu_s = static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC;
  const double wall_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  EXPECT_THAT(text, HasSubstr("tile: tiling took "));
  const Json event = Json::parse(read_text_file(folder / "e"), "e");
  EXPECT_EQ(event.at("what").string(), "stage");
  EXPECT_EQ(event.at("stage").string(), "tiling");
  // More than what was done for sure, less than what clocks round all of it say.
  EXPECT_GE(event.at("wall_s").number(), 0.3);
  EXPECT_LE(event.at("wall_s").number(), wall_s);
  constexpr double kTick_s = 0.01;
  EXPECT_GE(event.at("cpu_s").number(), 0.2 - kTick_s);
  EXPECT_LE(event.at("cpu_s").number(), cpu_s + kTick_s);
  EXPECT_GE(event.at("peak_bytes").number(), static_cast<double>(kBytes));
}

TEST(ProgressTest, TerminalsGetALineThatIsOverwritten) {
  // A pseudo-terminal in place of stderr.
  const int controller = ::posix_openpt(O_RDWR | O_NOCTTY);
  if (controller < 0 || ::grantpt(controller) != 0 || ::unlockpt(controller) != 0)
    GTEST_SKIP() << "no pseudo-terminal can be had here";
  const int terminal = ::open(::ptsname(controller), O_RDWR | O_NOCTTY);
  if (terminal < 0) GTEST_SKIP() << "no pseudo-terminal can be had here";
  const int saved = ::dup(STDERR_FILENO);
  ::dup2(terminal, STDERR_FILENO);
  {
    const Log log("tile");
    Progress progress({.log = log}, "tiles", 10);
    progress.advance(2);
    std::this_thread::sleep_for(std::chrono::milliseconds(1100));
    progress.advance(3);
    progress.advance(1);
  }
  ::dup2(saved, STDERR_FILENO);
  ::close(saved);
  // What is written arrives piece by piece, a moment later.
  std::string text;
  pollfd arrived{.fd = controller, .events = POLLIN, .revents = 0};
  while (text.find(" of 10 tiles in ") == std::string::npos && ::poll(&arrived, 1, 5000) == 1) {
    std::array<char, 4096> piece;
    const ssize_t count = ::read(controller, piece.data(), piece.size());
    if (count <= 0) break;
    text.append(piece.data(), static_cast<std::size_t>(count));
  }
  ::close(terminal);
  ::close(controller);
  EXPECT_THAT(text,
              AllOf(HasSubstr("\r\033[K5 of 10 tiles, "), HasSubstr("/s, "), HasSubstr(" s left")));
  EXPECT_THAT(text, HasSubstr("\r\033[K["));
  EXPECT_THAT(text, HasSubstr("6 of 10 tiles in "));
}

}  // namespace
}  // namespace terracast::core
