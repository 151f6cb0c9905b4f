#include "core/program.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>

#include "core/atomic_file.h"
#include "core/error.h"
#include "tests/support/test_data.h"

namespace terracast::core {
namespace {

using test::ScratchFolder;
using testing::HasSubstr;

constexpr const char* kShell = "/bin/sh";

TEST(Program, ArgumentsArriveAsTheyAre) {
  const ScratchFolder scratch;
  const auto end =
      run_program("/usr/bin/printf", {"[%s]", "a b", "$HOME", "'\"; exit 3", ""}, scratch / "log");
  EXPECT_TRUE(end.is_success());
  EXPECT_EQ(read_text_file(scratch / "log"), "[a b][$HOME]['\"; exit 3][]");
}

TEST(Program, BothOutputsGoToTheEndOfTheLogAndInputIsEmpty) {
  const ScratchFolder scratch;
  write_file(scratch / "log", "before\n");
  run_program(kShell, {"-c", "echo out; echo err >&2; cat"}, scratch / "log");
  EXPECT_EQ(read_text_file(scratch / "log"), "before\nout\nerr\n");
}

TEST(Program, StatusAndSignalAreTold) {
  const ScratchFolder scratch;
  const auto failed = run_program(kShell, {"-c", "exit 7"}, scratch / "log");
  EXPECT_FALSE(failed.is_success());
  EXPECT_EQ(failed.text(), "ended with status 7");
  const auto aborted = run_program(kShell, {"-c", "kill -ABRT $$"}, scratch / "log");
  EXPECT_FALSE(aborted.is_success());
  EXPECT_EQ(aborted.kind, ProgramEnd::Kind::Killed);
  EXPECT_EQ(aborted.status, SIGABRT);
  EXPECT_THAT(aborted.text(), HasSubstr("signal 6 (Aborted)"));
}

TEST(Program, IsStoppedWhenItsTimeIsUp) {
  const ScratchFolder scratch;
  const auto start = std::chrono::steady_clock::now();
  const auto end = run_program("/bin/sleep", {"60"}, scratch / "log", {.timeout_s = 0.1});
  EXPECT_EQ(end.kind, ProgramEnd::Kind::TimedOut);
  EXPECT_FALSE(end.is_success());
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(30));
}

TEST(Program, EnvironmentIsAddedAndReplaced) {
  const ScratchFolder scratch;
  ::setenv("TERRACAST_TEST_A", "old", 1);
  run_program(kShell, {"-c", "echo $TERRACAST_TEST_A $TERRACAST_TEST_B"}, scratch / "log",
              {.environment = {"TERRACAST_TEST_A=new", "TERRACAST_TEST_B=more"}});
  EXPECT_EQ(read_text_file(scratch / "log"), "new more\n");
}

TEST(Program, EndsWhenTheProcessThatStartedItIsKilled) {
  const ScratchFolder scratch;
  const std::filesystem::path number = scratch / "number";
  const pid_t starter = ::fork();
  if (starter == 0) {
    run_program(kShell,
                {"-c", "echo $$ > \"$0\".new; mv \"$0\".new \"$0\"; sleep 60", number.string()},
                scratch / "log");
    ::_exit(0);
  }
  const auto wait_until = [](const auto& is_so) {
    for (int i = 0; i < 3000 && !is_so(); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return is_so();
  };
  const bool is_started = wait_until([&] { return std::filesystem::exists(number); });
  ::kill(starter, SIGKILL);
  ::waitpid(starter, nullptr, 0);
  ASSERT_TRUE(is_started);
  const auto process =
      std::filesystem::path("/proc") / std::to_string(std::stoi(read_text_file(number)));
  EXPECT_TRUE(wait_until([&] {  // gone, or dead and not yet collected
    std::ifstream stat(process / "stat");
    std::string text;
    std::getline(stat, text);
    return text.empty() || text.find(") Z ") != std::string::npos;
  }));
}

TEST(Program, IsFoundByName) {
  EXPECT_TRUE(find_program("sh").has_value());
  EXPECT_FALSE(find_program("no-such-program-anywhere"));
  EXPECT_FALSE(find_program("/bin/sh"));  // a name, not a path
  EXPECT_FALSE(find_program(""));
}

TEST(Program, AMissingOneEndsWithStatus127AndALogThatCannotBeOpenedIsAnError) {
  const ScratchFolder scratch;
  EXPECT_EQ(run_program("/no/such/program", {}, scratch / "log").status, 127);
  EXPECT_THROW(run_program(kShell, {}, scratch / "none/log"), Error);
}

}  // namespace
}  // namespace terracast::core
