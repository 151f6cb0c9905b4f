#include "core/cpu_quota.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "tests/support/test_data.h"

namespace terracast::test {
namespace {

/// A machine's /proc and /sys, as far as control groups go.
class Machine {
 public:
  explicit Machine(const std::string& groups_of_process) {
    write("proc/self/cgroup", groups_of_process);
  }
  void write(const std::string& path, const std::string& text) {
    std::filesystem::create_directories((folder_ / path).parent_path());
    std::ofstream(folder_ / path) << text;
  }
  int quota() const { return core::cpu_quota(folder_.path()); }

 private:
  ScratchFolder folder_;
};

// As a pod with limits.cpu = 4 sees it, whose group is the top of what is mounted.
TEST(CpuQuota, IsTheLimitOfAContainer) {
  Machine pod("0::/\n");
  pod.write("sys/fs/cgroup/cpu.max", "400000 100000\n");
  EXPECT_EQ(pod.quota(), 4);
  pod.write("sys/fs/cgroup/cpu.max", "250000 100000\n");  // limits.cpu = 2500m
  EXPECT_EQ(pod.quota(), 3);
  pod.write("sys/fs/cgroup/cpu.max", "10000 100000\n");
  EXPECT_EQ(pod.quota(), 1);
  pod.write("sys/fs/cgroup/cpu.max", "max 100000\n");
  EXPECT_EQ(pod.quota(), 0);
}

TEST(CpuQuota, IsTheLeastOfAGroupAndThoseAboveIt) {
  Machine machine("0::/jobs/night/task\n");
  machine.write("sys/fs/cgroup/jobs/night/task/cpu.max", "max 100000\n");
  machine.write("sys/fs/cgroup/jobs/night/cpu.max", "600000 100000\n");
  machine.write("sys/fs/cgroup/jobs/cpu.max", "800000 100000\n");
  EXPECT_EQ(machine.quota(), 6);
}

TEST(CpuQuota, IsReadOfGroupsOfBothVersions) {
  Machine machine("5:cpu,cpuacct:/docker/abc\n4:memory:/docker/abc\n0::/\n");
  machine.write("sys/fs/cgroup/cpu,cpuacct/cpu.cfs_quota_us", "200000\n");
  machine.write("sys/fs/cgroup/cpu,cpuacct/cpu.cfs_period_us", "100000\n");
  EXPECT_EQ(machine.quota(), 2);
  machine.write("sys/fs/cgroup/cpu,cpuacct/docker/abc/cpu.cfs_quota_us", "-1\n");
  machine.write("sys/fs/cgroup/cpu,cpuacct/docker/abc/cpu.cfs_period_us", "100000\n");
  EXPECT_EQ(machine.quota(), 2);
  machine.write("sys/fs/cgroup/cpu,cpuacct/cpu.cfs_quota_us", "-1\n");
  EXPECT_EQ(machine.quota(), 0);
}

TEST(CpuQuota, IsNoneWhereNothingIsStated) {
  EXPECT_EQ(Machine("").quota(), 0);
  EXPECT_EQ(Machine("0::/somewhere\n").quota(), 0);
  Machine odd("no group\n::\n0::/\n");
  odd.write("sys/fs/cgroup/cpu.max", "many few\n");
  EXPECT_EQ(odd.quota(), 0);
  EXPECT_GE(core::cpus_to_use(), 1);
  EXPECT_LE(core::cpus_to_use(), static_cast<int>(std::thread::hardware_concurrency()));
}

}  // namespace
}  // namespace terracast::test
