#include "tests/support/run_program.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

namespace terracast::test {

ProgramResult run_command(const std::string& program, const std::vector<std::string>& arguments,
                          const ProgramLimits& limits) {
  static int counter = 0;
  const auto log =
      std::filesystem::temp_directory_path() /
      ("terracast-output-" + std::to_string(::getpid()) + "-" + std::to_string(counter++));
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const auto& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const pid_t child = ::fork();
  if (child == 0) {
    const int file = ::open(log.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
    ::dup2(file, 1);
    ::dup2(file, 2);
    ::execvp(program.c_str(), argv.data());
    ::_exit(127);
  }
  const auto start = std::chrono::steady_clock::now();
  ProgramResult result;
  bool was_killed = false;
  bool was_terminated = false;
  for (;;) {
    int state = 0;
    rusage usage{};
    if (::wait4(child, &state, WNOHANG, &usage) == child) {
      result.peak_rss_bytes = 1024.0 * static_cast<double>(usage.ru_maxrss);
      result.status = WIFEXITED(state) ? WEXITSTATUS(state) : -WTERMSIG(state);
      break;
    }
    const double elapsed_s =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (!was_killed && limits.kill_after_s >= 0.0 && elapsed_s >= limits.kill_after_s) {
      ::kill(child, SIGKILL);
      was_killed = true;
    }
    if (!was_terminated && limits.terminate_when && limits.terminate_when()) {
      ::kill(child, SIGTERM);
      was_terminated = true;
    }
    if (elapsed_s > limits.timeout_s) {
      ::kill(child, SIGKILL);
      ::waitpid(child, &state, 0);
      result.status = -1000;
      break;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  std::ifstream stream(log);
  std::stringstream text;
  text << stream.rdbuf();
  result.output = text.str();
  std::filesystem::remove(log);
  return result;
}

ProgramResult run_program(const std::vector<std::string>& arguments, const ProgramLimits& limits) {
  return run_command(TERRACAST_PROGRAM, arguments, limits);
}

}  // namespace terracast::test
