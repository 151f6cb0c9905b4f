#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

/// Attributes failures to the plug-in whose code raised them.
namespace terracast::plugins {

/// "plug-in mine 1.2 (/path/mine.so)" if the exception that is being handled came out of a plug-in's function or of what
/// it called, in whatever thread it was thrown; empty: it did not, or kMostThrown others were thrown by plug-ins since.
std::string thrower_of_current_exception();

/// Exceptions of plug-ins whose throwers are remembered.
constexpr std::size_t kMostThrown = 256;

/// From now on a crash (SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT) in or below a plug-in's function names the plug-in and ends
/// the process with status 70 in place of the signal; other crashes end it as they did. Not where a stack overflows on
/// another thread than the first.
///
/// While a command is at work (AtWork), so does a call of exit(), quick_exit(), _exit() or _Exit() in this process below one of
/// a plug-in's functions: it would leave half of the files, with whatever status. Not in children that a plug-in forks.
///
/// Only the nearest 64 frames of a stack are searched. Call it again in a child of fork() that shall behave so too.
void name_plugins_in_crashes();

/// From its making to its end a command is at work: who calls exit() or quick_exit() then, ends it with status 70.
class AtWork {
 public:
  AtWork();
  ~AtWork();
  AtWork(const AtWork&) = delete;
  AtWork& operator=(const AtWork&) = delete;
};

/// While it lives, a crash or an exit in no known plug-in is that of a file which is being loaded. Threads: one.
class Loading {
 public:
  explicit Loading(const std::filesystem::path& file);
  ~Loading();
  Loading(const Loading&) = delete;
  Loading& operator=(const Loading&) = delete;
};

}  // namespace terracast::plugins
