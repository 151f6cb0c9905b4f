#pragma once

#include <signal.h>

#include <functional>
#include <string>
#include <vector>

namespace terracast::test {

/// What a run of the program left behind.
struct ProgramResult {
  int status = -1;     ///< exit status; -signal when it was killed; -1000 when it ran out of time
  std::string output;  ///< stdout and stderr together
  double peak_rss_bytes = 0.0;
};

/// How a run is cut short.
struct ProgramLimits {
  double timeout_s = 1500.0;   ///< of a hang: far more than any run takes on a busy machine
  double kill_after_s = -1.0;  ///< SIGKILL at this time; negative: never
  /// SIGTERM as soon as this holds; asked every few ms.
  std::function<bool()> terminate_when = {};
};

/// Runs a program with arguments; its output goes through a file, so that nothing can block.
ProgramResult run_command(const std::string& program, const std::vector<std::string>& arguments,
                          const ProgramLimits& limits = {});

/// Runs terracast.
ProgramResult run_program(const std::vector<std::string>& arguments,
                          const ProgramLimits& limits = {});

}  // namespace terracast::test
