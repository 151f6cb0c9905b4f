#include <fcntl.h>
#include <gtest/gtest.h>
#include <seccomp.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <string>

#include "core/error.h"
#include "core/reading_apart.h"
#include "tests/support/test_data.h"

// A kernel, or a container, that filters no system calls.
namespace terracast::test {
namespace {

/// From now on this process and those that it starts get no filter.
bool refuse_filters() {
  scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ALLOW);
  const scmp_arg_cmp sets_filter = SCMP_A0(SCMP_CMP_EQ, PR_SET_SECCOMP);
  return filter != nullptr &&
         seccomp_rule_add_array(filter, SCMP_ACT_ERRNO(EINVAL), SCMP_SYS(seccomp), 0, nullptr) ==
             0 &&
         seccomp_rule_add_array(filter, SCMP_ACT_ERRNO(EINVAL), SCMP_SYS(prctl), 1, &sets_filter) ==
             0 &&
         seccomp_load(filter) == 0;
}

TEST(UnconfinedReaders, SayOnceWhatTheyLack) {
  const ScratchFolder folder;
  const std::string log = folder / "log";
  const pid_t child = ::fork();
  if (child == 0) {
    const int file = ::open(log.c_str(), O_WRONLY | O_CREAT, 0600);
    if (file < 0 || ::dup2(file, STDERR_FILENO) < 0 || !refuse_filters()) ::_exit(9);
    int num_read = 0;
    for (int i = 0; i < 3; ++i) try {
        core::read_apart("tea leaves", core::Json::object(), "cup");
      } catch (const core::Error& error) {
        num_read += error.kind() == core::ErrorKind::Internal ? 1 : 0;
      }
    ::_exit(num_read == 3 ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 9)
    GTEST_SKIP() << "this kernel takes no filter that refuses filters";
  EXPECT_EQ(status, 0);
  std::ifstream in(log);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::size_t first = text.find("lack the filter of system calls (seccomp)");
  EXPECT_NE(first, std::string::npos) << text;
  EXPECT_EQ(text.find("seccomp", text.find("seccomp") + 1), std::string::npos) << text;
}

}  // namespace
}  // namespace terracast::test
