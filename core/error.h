#pragma once

#include <fmt/format.h>

#include <exception>
#include <string>
#include <utility>
#include <vector>

namespace terracast::core {

/// What went wrong, as the caller's next step: mend the command, the config, the data, try again,
/// report a bug, or go on with work that was stopped on request (core/stop.h). Who catches errors to
/// carry on without what failed must let Interrupted pass.
enum class ErrorKind { Usage, Config, Input, Io, Internal, Interrupted };

/// Exit status of the program for a kind: Usage and Config 2, Input 3, Io 4, Internal 70, Interrupted
/// 75 (EX_TEMPFAIL of sysexits.h).
int exit_status(ErrorKind kind);

/// A failure that ends a unit of work (a tile, a frame, a run).
///
/// The message says what was found, where, and what would be right; the context lines say, from the
/// inside out, what was being done.
class Error : public std::exception {
 public:
  Error(ErrorKind kind, std::string message);

  ErrorKind kind() const { return kind_; }
  const std::string& message() const { return message_; }
  const std::vector<std::string>& context() const { return context_; }

  /// Adds what was being done, such as "building tile 3/0/-1".
  void add_context(std::string doing);

  /// The message and a line "  while <doing>" for each context.
  const char* what() const noexcept override { return text_.c_str(); }

 private:
  ErrorKind kind_;
  std::string message_;
  std::vector<std::string> context_;
  std::string text_;
};

[[noreturn]] void fail_with_message(ErrorKind kind, std::string message);

/// Throws an Error with a formatted message.
template <class... Args>
[[noreturn]] void fail(ErrorKind kind, fmt::format_string<Args...> format, Args&&... args) {
  fail_with_message(kind, fmt::format(format, std::forward<Args>(args)...));
}

/// Runs `work`; an Error that leaves it gets the line "while <doing>".
template <class Work>
auto with_context(Work&& work, const std::string& doing) {
  try {
    return work();
  } catch (Error& error) {
    error.add_context(doing);
    throw;
  }
}

[[noreturn]] void check_failed(const char* condition, const char* file, int line,
                               const std::string& message);

}  // namespace terracast::core

/// Guards an invariant in every build: throws an Internal error with the condition, the place and a
/// message.
#define TERRACAST_CHECK(condition, ...)                               \
  do {                                                                \
    if (!(condition))                                                 \
      ::terracast::core::check_failed(#condition, __FILE__, __LINE__, \
                                      ::fmt::format("" __VA_ARGS__)); \
  } while (false)
