#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace terracast::core {

/// Where a program of that name lies, by the folders of PATH.
std::optional<std::filesystem::path> find_program(const std::string& name);

/// How a run of another program ended.
struct ProgramEnd {
  enum class Kind { Exited, Killed, TimedOut };
  Kind kind = Kind::Exited;
  int status = 0;  ///< exit status; the signal's number when killed

  bool is_success() const { return kind == Kind::Exited && status == 0; }
  /// "ended with status 1", "was ended by signal 6 (Aborted)", "was stopped after its time was up".
  std::string text() const;
};

struct ProgramLimits {
  double timeout_s = 3600.0;
  /// Variables as NAME=VALUE, beside those of this process, which they replace.
  std::vector<std::string> environment = {};
};

/// Runs a program with arguments as they are: no shell reads them. Its input is empty, its output
/// goes to the end of `log_file`. It ends when this process ends, however that does.
/// threads  from the main thread: the program ends with the thread that started it
/// throws   Io: the log cannot be opened; the system starts no process
ProgramEnd run_program(const std::filesystem::path& program,
                       const std::vector<std::string>& arguments,
                       const std::filesystem::path& log_file, const ProgramLimits& limits = {});

}  // namespace terracast::core
