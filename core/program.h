#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace terracast::core {

/// Where a program of that name lies, by the folders of PATH.
std::optional<std::filesystem::path> find_program(const std::string& name);

/// A word as a shell takes it whatever it holds: in single quotes.
std::string shell_quoted(const std::string& text);

/// How a run of another program ended.
struct ProgramEnd {
  enum class Kind { Exited, Killed, TimedOut };
  Kind kind = Kind::Exited;
  int status = 0;  ///< exit status; the signal's number when killed

  bool is_success() const { return kind == Kind::Exited && status == 0; }
  /// "ended with status 1", "was ended by signal 6 (Aborted)", "was stopped after its time was up".
  std::string text() const;
};

/// Where a program writes, and what it finds in its environment.
struct ProgramOptions {
  /// Its output goes to the end of this file; without one, both its outputs go to this process's
  /// own error output.
  std::optional<std::filesystem::path> log_file = {};
  /// Variables as NAME=VALUE, beside those of this process, which they replace.
  std::vector<std::string> environment = {};
  /// Open descriptors that it has as numbers 3, 4, … beside input and outputs.
  std::vector<int> descriptors = {};
};

/// A program that runs beside this process, with arguments as they are: no shell reads them. Its
/// input is empty, and no signal is blocked in it. It is killed when this object is destroyed, and
/// when this process ends, however that does. What it started itself is not.
///
/// threads  start it from one that lives as long as it shall, such as the main thread: the system
///          kills it when the thread that started it ends. Any thread may use it, one at a time.
class RunningProgram {
 public:
  /// throws   Io: the log cannot be opened; the system starts no process
  RunningProgram(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                 const ProgramOptions& options = {});
  ~RunningProgram();
  RunningProgram(RunningProgram&& other) noexcept;
  /// Ends the program that stood here.
  RunningProgram& operator=(RunningProgram&& other) noexcept;

  /// How it ended; nothing while it runs. A program that is not there ends with status 127.
  std::optional<ProgramEnd> end();

  /// Waits until it ends, but no longer than this (infinity: as long as it takes).
  /// returns   how it ended; nothing when it runs on
  std::optional<ProgramEnd> wait(double timeout_s);

  /// Sends it a signal, such as SIGTERM; one that has ended gets none.
  void send(int signal);

 private:
  void kill() noexcept;

  int process_ = 0;  ///< its number; 0: moved from
  std::optional<ProgramEnd> end_;
};

struct ProgramLimits {
  double timeout_s = 3600.0;
  std::vector<std::string> environment = {};  ///< as ProgramOptions::environment
};

/// Runs a program to its end, or kills it when its time is up. Its output goes to the end of
/// `log_file`.
/// threads  as RunningProgram
/// throws   Io: the log cannot be opened; the system starts no process; Interrupted: a stop was asked
///          for, and the program is killed
ProgramEnd run_program(const std::filesystem::path& program,
                       const std::vector<std::string>& arguments,
                       const std::filesystem::path& log_file, const ProgramLimits& limits = {});

}  // namespace terracast::core
