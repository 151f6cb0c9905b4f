#pragma once

#include <cstdint>
#include <functional>

namespace terracast::core {

/// Limits all parallel work of the process (ours and Embree's) while it lives. 0: one thread for
/// each of cpus_to_use().
class ThreadLimit {
 public:
  explicit ThreadLimit(int num_threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  void* control_;
};

/// Calls body(i) for each i in [0, count), in parallel and in no order. The first exception thrown,
/// by index, is thrown on; the rest is not started. Results must go to places that depend on i
/// alone.
///
/// Once a stop is asked for (core/stop.h), this and the loops below start no further index. They
/// throw Interrupted when bodies that were running have ended, unless all indices had been started or
/// one of them threw something else.
void parallel_for(std::int64_t count, const std::function<void(std::int64_t)>& body);

/// As parallel_for, with blocks [begin, end) of at most `grain` indices, cut at multiples of
/// `grain`.
void parallel_for_blocks(std::int64_t count, std::int64_t grain,
                         const std::function<void(std::int64_t begin, std::int64_t end)>& body);

/// Runs make(i) in parallel, at most `window` ahead, and consume(i) one at a time in the order of
/// i. All before the first failure, or the first index that a stop left out, is consumed.
void parallel_in_order(std::int64_t count, int window,
                       const std::function<void(std::int64_t)>& make,
                       const std::function<void(std::int64_t)>& consume);

}  // namespace terracast::core
