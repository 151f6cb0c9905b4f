#ifdef TERRACAST_STD_THREADS

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <limits>
#include <mutex>
#include <thread>
#include <vector>

#include "core/parallel_backend.h"

// Threads come and go with each call: simple enough to be right, and slow.

namespace terracast::core::backend {
namespace {

std::atomic<int> limit_of_threads = 0;  ///< 0: none

std::int64_t num_threads_for(std::int64_t count) {
  // More than one even on a machine of one core: threads are here to be watched.
  const int cores = std::max(2, static_cast<int>(std::thread::hardware_concurrency()));
  const int limit = limit_of_threads.load();
  return std::min<std::int64_t>(count, limit > 0 ? limit : cores);
}

/// Runs work on so many threads, this one included.
void run_on_threads(std::int64_t num_threads, const std::function<void()>& work) {
  std::vector<std::jthread> others;
  for (std::int64_t i = 1; i < num_threads; ++i) others.emplace_back(work);
  work();
}

}  // namespace

void* new_limit(int num_threads) { return new int(limit_of_threads.exchange(num_threads)); }

void delete_limit(void* limit) {
  if (limit == nullptr) return;
  limit_of_threads.store(*static_cast<int*>(limit));
  delete static_cast<int*>(limit);
}

int num_threads_allowed() {
  return static_cast<int>(num_threads_for(std::numeric_limits<std::int64_t>::max()));
}

void for_each(std::int64_t count, const std::function<void(std::int64_t)>& body) {
  std::atomic<std::int64_t> next = 0;
  run_on_threads(num_threads_for(count), [&] {
    for (std::int64_t i = next++; i < count; i = next++) body(i);
  });
}

void in_order(std::int64_t count, int window, const std::function<bool()>& is_wanted,
              const std::function<void(std::int64_t)>& make,
              const std::function<void(std::int64_t)>& consume) {
  std::mutex mutex;
  std::condition_variable moved;
  std::int64_t next = 0;
  std::int64_t num_consumed = 0;
  std::vector<bool> is_made(static_cast<std::size_t>(window), false);
  bool is_consuming = false;
  const auto place = [&](std::int64_t i) { return static_cast<std::size_t>(i % window); };

  const auto consume_what_is_made = [&](std::unique_lock<std::mutex>& lock) {
    if (is_consuming) return;
    is_consuming = true;
    while (num_consumed < count && is_made[place(num_consumed)]) {
      is_made[place(num_consumed)] = false;
      const std::int64_t i = num_consumed;
      lock.unlock();
      if (is_wanted()) consume(i);
      lock.lock();
      ++num_consumed;
      moved.notify_all();
    }
    is_consuming = false;
  };

  run_on_threads(std::min<std::int64_t>(window, num_threads_for(count)), [&] {
    std::unique_lock lock(mutex);
    for (;;) {
      moved.wait(lock,
                 [&] { return next == count || !is_wanted() || next < num_consumed + window; });
      if (next == count || !is_wanted()) return;
      const std::int64_t i = next++;
      lock.unlock();
      make(i);
      lock.lock();
      is_made[place(i)] = true;
      consume_what_is_made(lock);
    }
  });
}

}  // namespace terracast::core::backend

#endif
