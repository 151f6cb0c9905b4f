#include "core/process_memory.h"

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <thread>

namespace terracast::core {

double resident_bytes() {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen("/proc/self/statm", "re"),
                                                             std::fclose);
  unsigned long num_pages = 0;
  unsigned long num_resident = 0;
  if (file == nullptr || std::fscanf(file.get(), "%lu %lu", &num_pages, &num_resident) != 2)
    return 0.0;
  return static_cast<double>(num_resident) * static_cast<double>(sysconf(_SC_PAGESIZE));
}

void share_freed_memory() {
  // Who sets it knows better.
  const char* tunables = std::getenv("GLIBC_TUNABLES");
  if (std::getenv("MALLOC_ARENA_MAX") != nullptr ||
      (tunables != nullptr && std::strstr(tunables, "arena_max") != nullptr))
    return;
  mallopt(M_ARENA_MAX, std::max(1, static_cast<int>(std::thread::hardware_concurrency())));
}

void give_freed_memory_back() { malloc_trim(0); }

}  // namespace terracast::core
