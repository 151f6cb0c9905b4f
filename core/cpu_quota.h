#pragma once

#include <filesystem>

namespace terracast::core {

/// CPUs that this process may keep busy: those that it may run on, or cpu_quota() where that is less. 1 or more.
/// threads   safe
int cpus_to_use();

/// CPU time that the kernel gives this process in each second, as whole CPUs rounded up: the least of what its control
/// group and those above it may use, as containers have it of their CPU limit. 0: no limit is stated.
/// root      where /proc and /sys are
/// threads   safe
int cpu_quota(const std::filesystem::path& root = "/");

}  // namespace terracast::core
