#include "core/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cfenv>
#include <chrono>
#include <mutex>
#include <numeric>
#include <stdexcept>
#include <thread>
#include <vector>

#include "core/error.h"
#include "core/stop.h"

namespace terracast::core {
namespace {

using namespace std::chrono_literals;

TEST(ParallelTest, EveryIndexOnce) {
  for (const std::int64_t count : {0, 1, 2, 7, 1023, 1024, 1025, 100003}) {
    std::vector<std::atomic<int>> calls(static_cast<std::size_t>(count));
    parallel_for(count, [&](std::int64_t i) { ++calls[static_cast<std::size_t>(i)]; });
    for (const auto& n : calls) ASSERT_EQ(n, 1);
  }
}

TEST(ParallelTest, BlocksAreCutAtMultiplesOfTheGrain) {
  for (const std::int64_t grain : {1, 3, 64, 1000}) {
    std::vector<std::atomic<int>> calls(500);
    parallel_for_blocks(500, grain, [&](std::int64_t begin, std::int64_t end) {
      EXPECT_EQ(begin % grain, 0);
      EXPECT_EQ(end, std::min<std::int64_t>(begin + grain, 500));
      for (std::int64_t i = begin; i < end; ++i) ++calls[static_cast<std::size_t>(i)];
    });
    for (const auto& n : calls) ASSERT_EQ(n, 1);
  }
}

TEST(ParallelTest, TheExceptionOfTheLowestIndexLeaves) {
  for (int round = 0; round < 200; ++round) {
    std::vector<std::atomic<int>> calls(5000);
    try {
      parallel_for(5000, [&](std::int64_t i) {
        ++calls[static_cast<std::size_t>(i)];
        if (i % 1000 == 777) throw std::runtime_error(std::to_string(i));
      });
      FAIL();
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "777");
    }
    for (std::size_t i = 0; i <= 777; ++i) ASSERT_EQ(calls[i], 1);
  }
}

TEST(ParallelTest, AfterAnExceptionTheRestIsNotStarted) {
  std::atomic<int> calls = 0;
  EXPECT_THROW(parallel_for(1000,
                            [&](std::int64_t i) {
                              ++calls;
                              if (i == 0) throw std::runtime_error("stop");
                              std::this_thread::sleep_for(1ms);
                            }),
               std::runtime_error);
  EXPECT_LT(calls, 900);
}

TEST(ParallelTest, NestedLoopsUnderALockDoNotDeadlock) {
  // A thread that waits for an inner loop must not take an outer item: it would want the lock that
  // it holds.
  std::mutex mutex;
  std::atomic<int> sum = 0;
  parallel_for(50, [&](std::int64_t) {
    const std::lock_guard lock(mutex);
    parallel_for(50, [&](std::int64_t) {
      std::this_thread::sleep_for(10us);
      ++sum;
    });
  });
  EXPECT_EQ(sum, 2500);
}

TEST(ParallelTest, InOrderConsumesInOrderWithinTheWindow) {
  for (const int window : {1, 2, 5, 100}) {
    std::atomic<std::int64_t> consumed = 0;
    std::vector<int> slots(static_cast<std::size_t>(window), -1);
    parallel_in_order(
        300, window,
        [&](std::int64_t i) {
          EXPECT_LT(i, consumed + window);
          int& slot = slots[static_cast<std::size_t>(i % window)];
          EXPECT_EQ(slot, -1);  // a ring of `window` places is enough
          if (i % 7 == 0) std::this_thread::sleep_for(100us);
          slot = static_cast<int>(i);
        },
        [&](std::int64_t i) {
          EXPECT_EQ(i, consumed);
          int& slot = slots[static_cast<std::size_t>(i % window)];
          EXPECT_EQ(slot, i);
          slot = -1;
          ++consumed;
        });
    EXPECT_EQ(consumed, 300);
  }
  parallel_in_order(
      0, 3, [](std::int64_t) { FAIL(); }, [](std::int64_t) { FAIL(); });
}

TEST(ParallelTest, InOrderConsumesAllBeforeTheFirstFailure) {
  for (const bool in_make : {true, false}) {
    for (int round = 0; round < 100; ++round) {
      std::int64_t consumed = 0;
      const auto maybe_throw = [](bool here, std::int64_t i) {
        if (here && (i == 41 || i == 43)) throw std::runtime_error(std::to_string(i));
      };
      try {
        parallel_in_order(
            100, 8, [&](std::int64_t i) { maybe_throw(in_make, i); },
            [&](std::int64_t i) {
              maybe_throw(!in_make, i);
              EXPECT_EQ(i, consumed++);
            });
        FAIL();
      } catch (const std::runtime_error& error) {
        EXPECT_STREQ(error.what(), "41");
      }
      EXPECT_EQ(consumed, 41);
    }
  }
}

TEST(ParallelTest, InOrderMayHoldLoops) {
  std::atomic<std::int64_t> sum = 0;
  parallel_in_order(
      40, 4, [&](std::int64_t) { parallel_for(100, [&](std::int64_t i) { sum += i; }); },
      [](std::int64_t) {});
  EXPECT_EQ(sum, 40 * 4950);
}

/// What a test asked for does not reach the next one.
struct StopForTest {
  ~StopForTest() { forget_stop(); }
};

/// The kind of error that work throws, and its message.
template <class Work>
std::pair<ErrorKind, std::string> error_of(Work&& work) {
  try {
    work();
  } catch (const Error& error) {
    return {error.kind(), error.message()};
  }
  return {ErrorKind::Internal, "nothing was thrown"};
}

const std::pair<ErrorKind, std::string> kStopped{
    ErrorKind::Interrupted, "stopped on request; run the same command again to go on"};

TEST(ParallelTest, OnceAStopIsAskedForNoIndexIsStartedAndRunningBodiesEnd) {
  std::atomic<int> started = 0;
  std::atomic<int> ended = 0;
  const auto body = [&](std::int64_t) {
    if (++started == 20) ask_to_stop();
    std::this_thread::sleep_for(1ms);
    ++ended;
  };
  using Loop = std::function<void()>;
  for (const Loop& loop :
       {Loop([&] { parallel_for(1000, body); }),
        Loop([&] { parallel_for_blocks(1000, 1, [&](std::int64_t i, std::int64_t) { body(i); }); }),
        Loop([&] { parallel_in_order(1000, 4, body, [](std::int64_t) {}); })}) {
    const StopForTest stop;
    started = ended = 0;
    EXPECT_EQ(error_of(loop), kStopped);
    EXPECT_EQ(started, ended);
    EXPECT_GE(started, 20);
    // Those that looked just before: one a thread.
    EXPECT_LE(started, 20 + static_cast<int>(std::thread::hardware_concurrency()) + 2);
    const int before = started;
    EXPECT_EQ(error_of(loop), kStopped);
    EXPECT_EQ(started, before);
  }
}

TEST(ParallelTest, AStopAfterTheLastIndexWasStartedChangesNothing) {
  const StopForTest stop;
  parallel_for(1, [](std::int64_t) { ask_to_stop(); });
  forget_stop();
  parallel_for_blocks(1, 1, [](std::int64_t, std::int64_t) { ask_to_stop(); });
  forget_stop();
  int consumed = 0;
  parallel_in_order(
      1, 1, [](std::int64_t) { ask_to_stop(); }, [&](std::int64_t) { ++consumed; });
  EXPECT_EQ(consumed, 1);
  EXPECT_NO_THROW(parallel_for(0, [](std::int64_t) {}));
}

TEST(ParallelTest, AStopHidesNoOtherException) {
  const auto fail_after_stop = [](std::int64_t i) {
    if (i != 5) return;
    ask_to_stop();
    std::this_thread::sleep_for(5ms);  // others find that no index is started any more
    fail(ErrorKind::Io, "the disk is full");
  };
  const std::pair<ErrorKind, std::string> full{ErrorKind::Io, "the disk is full"};
  for (int round = 0; round < 20; ++round) {
    const StopForTest stop;
    EXPECT_EQ(error_of([&] { parallel_for(1000, fail_after_stop); }), full);
    forget_stop();
    EXPECT_EQ(error_of([&] {
                parallel_for_blocks(1000, 1,
                                    [&](std::int64_t i, std::int64_t) { fail_after_stop(i); });
              }),
              full);
    forget_stop();
    EXPECT_EQ(error_of([&] { parallel_in_order(1000, 4, fail_after_stop, [](std::int64_t) {}); }),
              full);
    forget_stop();
    EXPECT_EQ(error_of([&] {
                parallel_in_order(
                    1000, 4, [](std::int64_t) {}, fail_after_stop);
              }),
              full);
  }
}

TEST(ParallelTest, InOrderConsumesAllBeforeTheFirstIndexThatAStopLeftOut) {
  const StopForTest stop;
  std::array<std::atomic<bool>, 1000> is_made{};
  std::int64_t consumed = 0;
  EXPECT_EQ(error_of([&] {
              parallel_in_order(
                  1000, 8,
                  [&](std::int64_t i) {
                    if (i == 100) ask_to_stop();
                    is_made[static_cast<std::size_t>(i)] = true;
                  },
                  [&](std::int64_t i) { EXPECT_EQ(i, consumed++); });
            }),
            kStopped);
  const auto first_left_out = std::find(is_made.begin(), is_made.end(), false);
  EXPECT_EQ(consumed, first_left_out - is_made.begin());
}

/// The most calls of a loop that ran at one time.
int most_at_once() {
  std::atomic<int> running = 0;
  std::atomic<int> most = 0;
  parallel_for(64, [&](std::int64_t) {
    const int now = ++running;
    int before = most;
    while (now > before && !most.compare_exchange_weak(before, now)) {
    }
    std::this_thread::sleep_for(1ms);
    --running;
  });
  return most;
}

TEST(ParallelTest, ThreadLimitHoldsWhileItLives) {
  {
    const ThreadLimit one(1);
    EXPECT_EQ(most_at_once(), 1);
    const ThreadLimit none(0);
    EXPECT_EQ(most_at_once(), 1);
  }
  {
    const ThreadLimit two(2);
    EXPECT_LE(most_at_once(), 2);
  }
  if (std::thread::hardware_concurrency() > 1) {
    EXPECT_GT(most_at_once(), 1);
  }
  EXPECT_THROW(ThreadLimit(-1), Error);
}

TEST(ParallelTest, RoundingStaysToNearest) {
  parallel_for(64, [](std::int64_t) {
    EXPECT_EQ(std::fegetround(), FE_TONEAREST);
    volatile double tiny = 1e-310;  // flush-to-zero would make it 0
    EXPECT_GT(tiny * 0.5, 0.0);
  });
}

TEST(ParallelTest, WrongArgumentsAreRefused) {
  EXPECT_THROW(parallel_for(-1, [](std::int64_t) {}), Error);
  EXPECT_THROW(parallel_for_blocks(1, 0, [](std::int64_t, std::int64_t) {}), Error);
  EXPECT_THROW(parallel_in_order(
                   1, 0, [](std::int64_t) {}, [](std::int64_t) {}),
               Error);
}

}  // namespace
}  // namespace terracast::core
