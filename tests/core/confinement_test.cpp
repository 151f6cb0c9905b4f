#include "core/confinement.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <thread>

#include "tests/support/test_data.h"

/// What a confined process can do, and what not, each tried in a process of its own.
namespace terracast::core {
namespace {

/// How a confined process ends that returns a status.
int wait_status_of(const std::function<int()>& body, const ReadingLimits& limits = {}) {
  const pid_t child = ::fork();
  if (child == 0) {
    const Confinement done = confine_this_process(limits);
    ::_exit(done.has_system_call_filter && done.has_memory_limit ? body() : 99);
  }
  int status = 0;
  EXPECT_EQ(::waitpid(child, &status, 0), child);
  return status;
}

int exit_status_of(const std::function<int()>& body, const ReadingLimits& limits = {}) {
  const int status = wait_status_of(body, limits);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

TEST(Confinement, LetsAProcessReadComputeAndStartThreads) {
  const test::ScratchFolder scratch;
  std::ofstream(scratch / "file.txt") << "text";
  EXPECT_EQ(exit_status_of([&] {
              std::ifstream in(scratch / "file.txt");
              std::string text;
              in >> text;
              if (text != "text") return 1;
              int sum = 0;
              std::thread([&] { sum = 2; }).join();
              return sum == 2 ? 0 : 2;
            }),
            0);
}

TEST(Confinement, LetsItChangeNothingOutside) {
  const test::ScratchFolder scratch;
  const std::string file = scratch / "file.txt", other = scratch / "other.txt";
  std::ofstream(file) << "text";
  const int opened = ::open(file.c_str(), O_WRONLY | O_CLOEXEC);
  ASSERT_GE(opened, 0);
  const pid_t parent = ::getpid();
  const std::function<bool()> does[] = {
      [&] { return ::open(file.c_str(), O_WRONLY) >= 0; },
      [&] { return ::open(file.c_str(), O_RDONLY | O_TRUNC) >= 0; },
      [&] { return ::open(other.c_str(), O_RDONLY | O_CREAT, 0600) >= 0; },
      [&] { return ::unlink(file.c_str()) == 0; },
      [&] { return ::rename(file.c_str(), other.c_str()) == 0; },
      [&] { return ::chmod(file.c_str(), 0) == 0; },
      [&] { return ::truncate(file.c_str(), 0) == 0; },
      [&] { return ::mkdir(other.c_str(), 0700) == 0; },
      [&] { return ::symlink(file.c_str(), other.c_str()) == 0; },
      [&] { return ::socket(AF_INET, SOCK_STREAM, 0) >= 0; },
      [&] { return ::socket(AF_UNIX, SOCK_STREAM, 0) >= 0; },
      [&] { return ::kill(parent, 0) == 0; },
      [&] { return ::fork() >= 0; },
      [&] { return ::execl("/bin/true", "true", static_cast<char*>(nullptr)) == 0; },
      [&] {  // Beyond what a file is allowed to grow to.
        ::signal(SIGXFSZ, SIG_IGN);
        return ::write(opened, "longer text", 11) == 11;
      }};
  int index = 0;
  for (const auto& one : does) {
    EXPECT_EQ(exit_status_of([&] { return one() ? 1 : 0; }), 0) << "deed " << index;
    ++index;
  }
  std::string text;
  std::ifstream(file) >> text;
  EXPECT_EQ(text, "text");
  EXPECT_FALSE(std::filesystem::exists(other));
  ::close(opened);
}

TEST(Confinement, EndsWhereMemoryOrTimeAreSpent) {
  constexpr std::size_t kMemory = std::size_t{64} << 20;
  const auto takes = [](std::size_t size) {
    return [size] {
      void* const bytes = std::malloc(size);
      if (bytes == nullptr) return 1;
      std::memset(bytes, 1, size);
      std::free(bytes);
      return 0;
    };
  };
  EXPECT_EQ(exit_status_of(takes(kMemory / 2), {.memory_bytes = kMemory}), 0);
  EXPECT_EQ(exit_status_of(takes(2 * kMemory), {.memory_bytes = kMemory}), 1);
  const int status = wait_status_of(
      [] {
        // For ever, since nothing may end it but the limit.
        const std::atomic<bool> is_over = false;
        while (!is_over) {
        }
        return 0;
      },
      {.cpu_s = 1.0});
  EXPECT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(exit_status_of([]() -> int { std::abort(); }), -SIGABRT);
}

}  // namespace
}  // namespace terracast::core
