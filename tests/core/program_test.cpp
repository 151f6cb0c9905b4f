#include "core/program.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <limits>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/stop.h"
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

template <class Claim>
bool comes_true(const Claim& claim) {
  for (int i = 0; i < 3000 && !claim(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  return claim();
}

/// A shell's text that writes the shell's number to the file "$0" and goes on for a minute.
constexpr const char* kTellNumber = "echo $$ > \"$0\".new; mv \"$0\".new \"$0\"; exec sleep 60";

/// The folder of /proc of the process that wrote its number into a file.
std::filesystem::path process_of(const std::filesystem::path& number) {
  EXPECT_TRUE(comes_true([&] { return std::filesystem::exists(number); }));
  return std::filesystem::path("/proc") / std::to_string(std::stoi(read_text_file(number)));
}

TEST(Program, EndsWhenTheProcessThatStartedItIsKilled) {
  const ScratchFolder scratch;
  const std::filesystem::path number = scratch / "number";
  const pid_t starter = ::fork();
  if (starter == 0) {
    run_program(kShell, {"-c", kTellNumber, number.string()}, scratch / "log");
    ::_exit(0);
  }
  const bool is_started = comes_true([&] { return std::filesystem::exists(number); });
  ::kill(starter, SIGKILL);
  ::waitpid(starter, nullptr, 0);
  ASSERT_TRUE(is_started);
  EXPECT_TRUE(comes_true([&] {  // gone, or dead and not yet collected
    std::ifstream stat(process_of(number) / "stat");
    std::string text;
    std::getline(stat, text);
    return text.empty() || text.find(") Z ") != std::string::npos;
  }));
}

TEST(Program, EndsWithTheThreadThatStartedIt) {
  const ScratchFolder scratch;
  std::optional<RunningProgram> program;
  std::thread([&] {
    program.emplace(kShell, std::vector<std::string>{"-c", kTellNumber, scratch / "number"});
    process_of(scratch / "number");  // it runs
    EXPECT_FALSE(program->end());
  }).join();
  const auto end = program->wait(30.0);
  ASSERT_TRUE(end);
  EXPECT_EQ(end->kind, ProgramEnd::Kind::Killed);
  EXPECT_EQ(end->status, SIGKILL);
}

TEST(RunningProgram, TellsItsEndOnceItHasEnded) {
  const ScratchFolder scratch;
  // The shell waits for a file that the test makes.
  RunningProgram program(kShell,
                         {"-c", "while [ ! -e \"$0\" ]; do sleep 0.01; done; echo done; exit 7",
                          (scratch / "go").string()},
                         {.log_file = scratch / "log"});
  EXPECT_FALSE(program.end());
  EXPECT_FALSE(program.wait(0.05));
  EXPECT_FALSE(program.end());
  write_file(scratch / "go", "");
  const auto end = program.wait(std::numeric_limits<double>::infinity());
  ASSERT_TRUE(end);
  EXPECT_EQ(end->text(), "ended with status 7");
  EXPECT_EQ(read_text_file(scratch / "log"), "done\n");
  // Again and again, and no other process gets its signals.
  ASSERT_TRUE(program.end());
  EXPECT_EQ(program.end()->text(), "ended with status 7");
  EXPECT_EQ(program.wait(0.0)->text(), "ended with status 7");
  EXPECT_NO_THROW(program.send(SIGKILL));
}

TEST(RunningProgram, GetsSignals) {
  const ScratchFolder scratch;
  RunningProgram polite(kShell,
                        {"-c", "trap 'exit 5' TERM; : > \"$0\"; while :; do sleep 0.01; done",
                         (scratch / "ready").string()},
                        {.log_file = scratch / "log"});
  ASSERT_TRUE(comes_true([&] { return std::filesystem::exists(scratch / "ready"); }));
  polite.send(SIGTERM);
  ASSERT_TRUE(polite.wait(30.0));
  EXPECT_EQ(polite.end()->text(), "ended with status 5");

  // Blocked in this thread, as where another thread waits for signals, but not in the program.
  sigset_t terminate;
  sigset_t before;
  ::sigemptyset(&terminate);
  ::sigaddset(&terminate, SIGTERM);
  ::pthread_sigmask(SIG_BLOCK, &terminate, &before);
  RunningProgram sleeper("/bin/sleep", {"60"});
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  sleeper.send(SIGTERM);
  ASSERT_TRUE(sleeper.wait(30.0));
  EXPECT_EQ(sleeper.end()->kind, ProgramEnd::Kind::Killed);
  EXPECT_EQ(sleeper.end()->status, SIGTERM);
}

TEST(RunningProgram, EndsWhenItIsDestroyedOrReplaced) {
  const ScratchFolder scratch;
  const auto start = [&](const std::string& name) {
    return RunningProgram(kShell, {"-c", kTellNumber, (scratch / name).string()},
                          {.log_file = scratch / "log"});
  };
  std::filesystem::path first;
  std::filesystem::path second;
  {
    RunningProgram program = start("first");
    first = process_of(scratch / "first");
    RunningProgram moved = std::move(program);
    EXPECT_FALSE(moved.end());
    RunningProgram other = start("second");
    second = process_of(scratch / "second");
    moved = std::move(other);
    EXPECT_FALSE(std::filesystem::exists(first));  // ended, and collected
    EXPECT_FALSE(moved.end());
    EXPECT_TRUE(std::filesystem::exists(second));
  }
  EXPECT_FALSE(std::filesystem::exists(second));
}

TEST(RunningProgram, ManyRunBesideEachOther) {
  const ScratchFolder scratch;
  std::vector<RunningProgram> programs;
  for (int k = 0; k < 8; ++k)
    programs.emplace_back(
        kShell,
        std::vector<std::string>{"-c", "while [ ! -e \"$0\" ]; do sleep 0.01; done; exit $NUMBER",
                                 (scratch / "go").string()},
        ProgramOptions{.log_file = scratch / "log",
                       .environment = {"NUMBER=" + std::to_string(k)}});
  for (RunningProgram& program : programs) EXPECT_FALSE(program.end());
  write_file(scratch / "go", "");
  for (int k = 7; k >= 0; --k) {
    const auto end = programs[static_cast<std::size_t>(k)].wait(30.0);
    ASSERT_TRUE(end);
    EXPECT_EQ(end->kind, ProgramEnd::Kind::Exited);
    EXPECT_EQ(end->status, k);
  }
}

TEST(RunningProgram, WithoutALogWritesToThisProcesssErrorOutput) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  RunningProgram program(kShell, {"-c", "echo out; echo err >&2"});
  const auto end = program.wait(30.0);
  const std::string err = testing::internal::GetCapturedStderr();
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(err, "out\nerr\n");
  EXPECT_TRUE(end && end->is_success());
}

TEST(Program, IsKilledWhenThisProcessIsAskedToStop) {
  const ScratchFolder scratch;
  const std::filesystem::path number = scratch / "number";
  std::thread asker([&] {
    process_of(number);
    ask_to_stop();
  });
  try {
    run_program(kShell, {"-c", kTellNumber, number.string()}, scratch / "log");
    ADD_FAILURE() << "it ran to its end";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::Interrupted);
  }
  asker.join();
  forget_stop();
  EXPECT_FALSE(std::filesystem::exists(process_of(number)));
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
  EXPECT_THROW(run_program(kShell, {}, ""), Error);
}

}  // namespace
}  // namespace terracast::core
