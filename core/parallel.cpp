#include "core/parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <limits>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

#include "core/cpu_quota.h"
#include "core/error.h"
#include "core/parallel_backend.h"
#include "core/stop.h"
#include "core/thread_crew.h"

namespace terracast::core {

namespace {

bool is_interruption(const std::exception_ptr& exception) {
  try {
    std::rethrow_exception(exception);
  } catch (const Error& error) {
    return error.kind() == ErrorKind::Interrupted;
  } catch (...) {
    return false;
  }
}

/// Keeps the exception of the lowest index. Work below it still runs and may lower it further, so
/// that which exception leaves does not depend on the threads. Any failure goes before
/// interruptions.
class FirstFailure {
 public:
  bool is_before(std::int64_t index) const {
    return lowest_.load(std::memory_order_relaxed) < index;
  }

  /// Call in a catch block.
  void note(std::int64_t index) {
    const std::exception_ptr exception = std::current_exception();
    const std::lock_guard lock(mutex_);
    Kept& kept = is_interruption(exception) ? interruption_ : failure_;
    if (index >= kept.index) return;
    kept = {index, exception};
    lowest_.store(std::min(interruption_.index, failure_.index), std::memory_order_relaxed);
  }

  void rethrow() const {
    for (const Kept* kept : {&failure_, &interruption_})
      if (kept->exception) std::rethrow_exception(kept->exception);
  }

 private:
  static constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::max();
  struct Kept {
    std::int64_t index = kNone;
    std::exception_ptr exception;
  };

  std::atomic<std::int64_t> lowest_{kNone};
  std::mutex mutex_;
  Kept failure_;
  Kept interruption_;
};

/// body   does not throw
void for_each_block(std::int64_t count, std::int64_t grain,
                    const std::function<void(std::int64_t begin, std::int64_t end)>& body) {
  if (count == 0) return;
  backend::for_each((count - 1) / grain + 1, [&](std::int64_t block) {
    const std::int64_t begin = block * grain;
    body(begin, begin + std::min(grain, count - begin));
  });
}

}  // namespace

ThreadLimit::ThreadLimit(int num_threads) : control_(nullptr) {
  TERRACAST_CHECK(num_threads >= 0, "{} threads", num_threads);
  if (num_threads == 0 && cpu_quota() > 0) num_threads = cpus_to_use();
  if (num_threads > 0) control_ = backend::new_limit(num_threads);
}

ThreadLimit::~ThreadLimit() { backend::delete_limit(control_); }

void parallel_for_blocks(std::int64_t count, std::int64_t grain,
                         const std::function<void(std::int64_t begin, std::int64_t end)>& body) {
  TERRACAST_CHECK(count >= 0 && grain > 0, "{} in blocks of {}", count, grain);
  FirstFailure failure;
  for_each_block(count, grain, [&](std::int64_t begin, std::int64_t end) {
    if (failure.is_before(begin)) return;
    try {
      throw_if_stop_asked();
      body(begin, end);
    } catch (...) {
      failure.note(begin);
    }
  });
  failure.rethrow();
}

void parallel_for(std::int64_t count, const std::function<void(std::int64_t)>& body) {
  TERRACAST_CHECK(count >= 0, "{}", count);
  // A thousand pieces balance well on any machine, and their cost (0.1 us each) is not seen.
  const std::int64_t grain = std::max<std::int64_t>(1, count / 1024);
  FirstFailure failure;
  for_each_block(count, grain, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t i = begin; i < end; ++i) {
      if (failure.is_before(i)) return;
      try {
        throw_if_stop_asked();
        body(i);
      } catch (...) {
        failure.note(i);
      }
    }
  });
  failure.rethrow();
}

void parallel_in_order(std::int64_t count, int window,
                       const std::function<void(std::int64_t)>& make,
                       const std::function<void(std::int64_t)>& consume) {
  TERRACAST_CHECK(count >= 0 && window > 0, "{} in a window of {}", count, window);
  if (count == 0) return;
  // One place for each item in flight; an exception waits in it for its turn, so that everything
  // before is consumed and nothing after.
  std::vector<std::exception_ptr> failed(static_cast<std::size_t>(window));
  const auto place = [&](std::int64_t i) -> std::exception_ptr& {
    return failed[static_cast<std::size_t>(i % window)];
  };
  std::atomic<bool> is_wanted{true};
  FirstFailure failure;
  backend::in_order(
      count, window, [&] { return is_wanted.load(std::memory_order_relaxed); },
      [&](std::int64_t i) {
        try {
          throw_if_stop_asked();
          make(i);
        } catch (...) {
          place(i) = std::current_exception();
          failure.note(i);
        }
      },
      [&](std::int64_t i) {
        try {
          if (place(i)) std::rethrow_exception(place(i));
          consume(i);
        } catch (...) {
          failure.note(i);
          is_wanted.store(false, std::memory_order_relaxed);
        }
      });
  failure.rethrow();
}

int num_threads_allowed() { return backend::num_threads_allowed(); }

void parallel_for_on_threads(std::int64_t count, int num_threads,
                             const std::function<void(std::int64_t)>& body) {
  TERRACAST_CHECK(count >= 0 && num_threads > 0, "{} on {} threads", count, num_threads);
  FirstFailure failure;
  std::atomic<std::int64_t> next = 0;
  const auto work = [&] {
    for (std::int64_t i = next++; i < count; i = next++) {
      if (failure.is_before(i)) return;
      try {
        throw_if_stop_asked();
        body(i);
      } catch (...) {
        failure.note(i);
      }
    }
  };
  {
    std::vector<std::jthread> threads;
    for (std::int64_t i = 0; i < std::min<std::int64_t>(num_threads, count); ++i) {
      try {
        threads.emplace_back(work);
      } catch (const std::system_error&) {  // no more can be started: those running do all the work
        if (threads.empty()) throw;
        break;
      }
    }
  }
  failure.rethrow();
}

}  // namespace terracast::core
