#pragma once

#include <cstdint>

namespace terracast::core {

/// Limits of a process that reads files from outside.
struct ReadingLimits {
  std::uint64_t memory_bytes = std::uint64_t{8} << 30;  ///< beside what it has at its start
  double cpu_s = 900.0;
  std::uint64_t file_bytes = 0;  ///< that it may write into a file that is open
};

/// How far a process was confined. A kernel that filters no system calls, or a build for sanitizers, which take terabytes
/// of addresses, leaves something out.
struct Confinement {
  bool has_memory_limit = false;
  bool has_system_call_filter = false;
};

/// From now on this process, and all threads that it starts, can read files and write to what is open, and hardly anything
/// else: it opens nothing for writing, starts no program, sends nothing over a network, signals no other process, and
/// dumps no core. What it may not do fails as where a kernel has no such call (ENOSYS), which libraries take as it is.
/// For good: it cannot be taken back. Threads: before others are started.
Confinement confine_this_process(const ReadingLimits& limits);

}  // namespace terracast::core
