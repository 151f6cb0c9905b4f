#pragma once

#include <fmt/format.h>

#include <memory>
#include <string>
#include <utility>

namespace terracast::core {

enum class LogLevel { Debug, Info, Warn, Error, Off };

/// A stage's log, to stderr. info is the story in ten lines, debug is for each tile or frame, warn
/// for what changes the data. Threads: safe.
class Log {
 public:
  /// stage   the prefix of each line, such as "tile"
  explicit Log(std::string stage, LogLevel level = LogLevel::Info);
  ~Log();
  Log(Log&&) noexcept;

  template <class... Args>
  void debug(fmt::format_string<Args...> format, Args&&... args) const {
    if (enabled(LogLevel::Debug))
      write(LogLevel::Debug, fmt::format(format, std::forward<Args>(args)...));
  }
  template <class... Args>
  void info(fmt::format_string<Args...> format, Args&&... args) const {
    if (enabled(LogLevel::Info))
      write(LogLevel::Info, fmt::format(format, std::forward<Args>(args)...));
  }
  template <class... Args>
  void warn(fmt::format_string<Args...> format, Args&&... args) const {
    if (enabled(LogLevel::Warn))
      write(LogLevel::Warn, fmt::format(format, std::forward<Args>(args)...));
  }

  LogLevel level() const;
  /// A log of the same level with another prefix.
  Log for_stage(std::string stage) const;

 private:
  bool enabled(LogLevel level) const;
  void write(LogLevel level, const std::string& line) const;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace terracast::core
