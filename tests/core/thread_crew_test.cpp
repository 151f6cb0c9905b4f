#include "core/thread_crew.h"

#include <gtest/gtest.h>

#include <atomic>
#include <latch>
#include <stdexcept>
#include <vector>

#include "core/parallel.h"

namespace terracast::core {
namespace {

TEST(ThreadCrew, EveryIndexOnce) {
  for (const std::int64_t count : {0, 1, 7, 1000}) {
    std::vector<std::atomic<int>> calls(static_cast<std::size_t>(count));
    parallel_for_on_threads(count, 5,
                            [&](std::int64_t i) { ++calls[static_cast<std::size_t>(i)]; });
    for (const auto& n : calls) ASSERT_EQ(n, 1);
  }
}

TEST(ThreadCrew, BodiesMayWaitForEachOtherWhateverTheLimitOfThreads) {
  constexpr std::int64_t kNumThreads = 16;
  const ThreadLimit limit(1);
  std::latch all(kNumThreads);
  parallel_for_on_threads(kNumThreads, kNumThreads, [&](std::int64_t) { all.arrive_and_wait(); });
}

TEST(ThreadCrew, TheExceptionOfTheLowestIndexLeaves) {
  for (int round = 0; round < 50; ++round) {
    try {
      parallel_for_on_threads(200, 4, [](std::int64_t i) {
        if (i >= 3) throw std::runtime_error(std::to_string(i));
      });
      ADD_FAILURE() << "no exception";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "3");
    }
  }
}

TEST(ThreadCrew, KnowsTheLimitOfThreads) {
  const ThreadLimit limit(1);
  EXPECT_EQ(num_threads_allowed(), 1);
}

}  // namespace
}  // namespace terracast::core
