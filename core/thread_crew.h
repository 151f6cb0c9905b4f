#pragma once

#include <cstdint>
#include <functional>

namespace terracast::core {

/// Threads that a parallel loop uses at most now: the innermost ThreadLimit, or one a core.
int num_threads_allowed();

/// As parallel_for, on `num_threads` threads of its own, however many ThreadLimit allows. It is for bodies
/// that mostly wait, and that share the processors among themselves while they do not.
void parallel_for_on_threads(std::int64_t count, int num_threads,
                             const std::function<void(std::int64_t)>& body);

}  // namespace terracast::core
