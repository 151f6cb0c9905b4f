#include "core/cpu_quota.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>
#include <thread>

namespace terracast::core {
namespace {

namespace fs = std::filesystem;

/// Microseconds of CPU time in a period; 0 where there is no limit.
struct Quota {
  double quota_us = 0.0;
  double period_us = 0.0;
};

/// Version 2: "max 100000" or "400000 100000".
Quota quota_of_v2(const fs::path& group) {
  Quota quota;
  std::ifstream(group / "cpu.max") >> quota.quota_us >> quota.period_us;
  return quota;
}

/// Version 1: a quota of -1 is none.
Quota quota_of_v1(const fs::path& group) {
  Quota quota;
  std::ifstream(group / "cpu.cfs_quota_us") >> quota.quota_us;
  std::ifstream(group / "cpu.cfs_period_us") >> quota.period_us;
  return quota;
}

/// The least of a group and those above it, up to a hierarchy's top.
template <class Read>
int least_of(const fs::path& top, const std::string& group, const Read& read) {
  int least = 0;
  fs::path below = fs::path(group).relative_path();
  while (true) {
    const Quota quota = read(top / below);
    if (quota.quota_us > 0.0 && quota.period_us > 0.0) {
      const int cpus =
          std::max(1, static_cast<int>(std::ceil(std::min(quota.quota_us / quota.period_us, 1e6))));
      least = least == 0 ? cpus : std::min(least, cpus);
    }
    if (below.empty()) return least;
    below = below.parent_path();
  }
}

bool has_controller(const std::string& controllers, const std::string& name) {
  return ("," + controllers + ",").find("," + name + ",") != std::string::npos;
}

}  // namespace

int cpus_to_use() {
  const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const int quota = cpu_quota();
  return quota > 0 ? std::min(cores, quota) : cores;
}

int cpu_quota(const fs::path& root) {
  const fs::path groups = root / "sys/fs/cgroup";
  int least = 0;
  std::ifstream lines(root / "proc/self/cgroup");
  // number:controllers:group
  for (std::string line; std::getline(lines, line);) {
    const std::size_t first = line.find(':');
    const std::size_t second = line.find(':', first == std::string::npos ? first : first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    const std::string group = line.substr(second + 1);
    int cpus = 0;
    if (controllers.empty())
      cpus = least_of(groups, group, quota_of_v2);
    else if (has_controller(controllers, "cpu"))
      cpus = least_of(groups / controllers, group, quota_of_v1);
    if (cpus > 0) least = least == 0 ? cpus : std::min(least, cpus);
  }
  return least;
}

}  // namespace terracast::core
