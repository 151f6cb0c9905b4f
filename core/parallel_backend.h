#pragma once

#include <cstdint>
#include <functional>

// What parallel.cpp stands on: oneTBB (parallel_tbb.cpp), or plain threads (parallel_std.cpp, with
// TERRACAST_STD_THREADS), for ThreadSanitizer, which cannot see how oneTBB's threads wait for each
// other.
namespace terracast::core::backend {

/// Limits the threads of all parallel work while it lives.
void* new_limit(int num_threads);
void delete_limit(void* limit);
int num_threads_allowed();

/// Calls body(i), which does not throw, for each i in [0, count). A thread that waits for the last of
/// them takes no work of an outer loop meanwhile, which would run below a frame that holds locks or
/// scratch memory.
void for_each(std::int64_t count, const std::function<void(std::int64_t)>& body);

/// While is_wanted(): make(i) in parallel, at most `window` ahead, then consume(i) in order, one at a
/// time. None of them throws.
void in_order(std::int64_t count, int window, const std::function<bool()>& is_wanted,
              const std::function<void(std::int64_t)>& make,
              const std::function<void(std::int64_t)>& consume);

}  // namespace terracast::core::backend
