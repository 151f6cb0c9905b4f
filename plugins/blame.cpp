#include "plugins/blame.h"

#include <dlfcn.h>
#include <execinfo.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <mutex>
#include <string>
#include <utility>

#include "core/error.h"
#include "core/plugin_rows.h"

namespace terracast::plugins {
namespace {

constexpr int kMostFrames = 64;

/// The exceptions that plug-ins threw last, by the places of their objects in memory.
class Throwers {
 public:
  void note(const void* exception, const core::Plugin* plugin) {
    const std::lock_guard lock(mutex_);
    // An object of another exception may have lain at that place.
    for (auto& [known, thrower] : thrown_)
      if (known == exception) known = nullptr;
    if (plugin == nullptr) return;
    thrown_[num_noted_++ % kMostThrown] = {exception, plugin};
  }

  const core::Plugin* of(const void* exception) {
    const std::lock_guard lock(mutex_);
    for (const auto& [known, thrower] : thrown_)
      if (known == exception) return thrower;
    return nullptr;
  }

 private:
  std::mutex mutex_;
  std::array<std::pair<const void*, const core::Plugin*>, kMostThrown> thrown_{};
  std::size_t num_noted_ = 0;
};

Throwers& throwers() {
  static Throwers all;
  return all;
}

/// The place in memory of the exception object that is being handled; null: there is none.
const void* current_exception_object() {
  const std::exception_ptr pointer = std::current_exception();
  // In the C++ ABI of GCC and Clang an exception_ptr is the object's address and nothing else.
  static_assert(sizeof(pointer) == sizeof(void*));
  const void* object = nullptr;
  std::memcpy(&object, &pointer, sizeof(object));
  return object;
}

/// The plug-in whose code stands nearest to the top of a stack; null: none.
const core::Plugin* plugin_in(void* const* frames, int num_frames) {
  for (int i = 0; i < num_frames; ++i) {
    Dl_info place;
    if (dladdr(frames[i], &place) == 0 || place.dli_fname == nullptr) continue;
    for (const core::Plugin& plugin : core::plugins())
      if (plugin.file.native() == place.dli_fname) return &plugin;
  }
  return nullptr;
}

/// The file that is being loaded; empty: none. It lives as long as the process: what runs at its end asks too.
std::string& loading_file() {
  static std::string& file = *new std::string;
  return file;
}

std::atomic<bool> is_at_work = false;
/// The process whose end is looked at; 0: none.
std::atomic<pid_t> looked_at = 0;

void write_text(const char* text) {
  const std::size_t size = std::strlen(text);
  if (write(STDERR_FILENO, text, size) < 0) return;
}

/// Not through _exit(), which is this file's own.
[[noreturn]] void end_process(int status) {
  while (true) syscall(SYS_exit_group, status);
}

/// If a plug-in stands on the stack, or is being loaded, says so and ends the process.
/// what   "crashed: "
/// why    "SEGV"
void end_if_of_plugin(const char* what, const char* why) {
  std::array<void*, kMostFrames> frames;
  const int num_frames = backtrace(frames.data(), kMostFrames);
  const core::Plugin* plugin = plugin_in(frames.data(), num_frames);
  if (plugin != nullptr)
    for (const char* part : {"error: plug-in ", plugin->name.c_str(), " ", plugin->version.c_str(),
                             " (", plugin->file.c_str(), ") ", what, why})
      write_text(part);
  else if (!loading_file().empty())
    for (const char* part :
         {"error: plug-in ", loading_file().c_str(), " ", what, why, " while it was loaded"})
      write_text(part);
  else
    return;
  write_text("; its place on the stack:\n");
  backtrace_symbols_fd(frames.data(), num_frames, STDERR_FILENO);
  end_process(core::exit_status(core::ErrorKind::Internal));
}

/// A last word: dladdr() takes the loader's lock, so that a crash while a library is loaded by another thread may not come
/// to its end; the alarm then ends the process.
void report_crash(int number) {
  constexpr unsigned kLongest_s = 10;
  alarm(kLongest_s);
  end_if_of_plugin("crashed: ", sigabbrev_np(number));
  signal(number, SIG_DFL);
  raise(number);
}

}  // namespace

std::string thrower_of_current_exception() {
  const void* exception = current_exception_object();
  const core::Plugin* plugin = exception == nullptr ? nullptr : throwers().of(exception);
  if (plugin == nullptr) return {};
  return fmt::format("plug-in {} {} ({})", plugin->name, plugin->version, plugin->file.string());
}

void name_plugins_in_crashes() {
  std::array<void*, 1> frame;
  backtrace(frame.data(), 1);  // loads what it needs, which a signal handler must not
  loading_file();
  looked_at = getpid();
  // A stack that overflows leaves no room for the handler.
  static std::array<char, 64 * 1024> handler_stack;
  stack_t stack{};
  stack.ss_sp = handler_stack.data();
  stack.ss_size = handler_stack.size();
  sigaltstack(&stack, nullptr);
  struct sigaction action {};
  action.sa_handler = report_crash;
  action.sa_flags = SA_ONSTACK | SA_RESETHAND;
  for (const int number : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT})
    sigaction(number, &action, nullptr);
}

Loading::Loading(const std::filesystem::path& file) { loading_file() = file.string(); }
Loading::~Loading() { loading_file().clear(); }

/// Called by exit() and its kin below.
void note_exit(const char* function) {
  if (!is_at_work || looked_at != getpid()) return;
  if (!core::plugins().empty() || !loading_file().empty()) end_if_of_plugin("called ", function);
}

/// Called at the end by exit() and quick_exit(), whoever called those.
void refuse_exit_at_work() {
  if (!is_at_work || looked_at != getpid()) return;
  write_text(
      "error: exit() was called while the command was at work; what is not done yet is missing");
  for (const core::Plugin& plugin : core::plugins())
    for (const char* part :
         {"; plug-in ", plugin.name.c_str(), " is loaded (", plugin.file.c_str(), ")"})
      write_text(part);
  write_text("\n");
  end_process(core::exit_status(core::ErrorKind::Internal));
}

AtWork::AtWork() {
  static const bool is_registered =
      std::atexit(refuse_exit_at_work) == 0 && std::at_quick_exit(refuse_exit_at_work) == 0;
  is_at_work = is_registered;
}

AtWork::~AtWork() { is_at_work = false; }

/// Called by __cxa_throw below.
void note_throw(const void* exception) {
  if (core::plugins().empty()) return;
  std::array<void*, kMostFrames> frames;
  throwers().note(exception, plugin_in(frames.data(), backtrace(frames.data(), kMostFrames)));
}

}  // namespace terracast::plugins

// Stands before the runtime library's own, to which it goes on: an exception's type and words do not tell who threw it.
// By its name alone: the compiler declares __cxa_throw itself.
extern "C" [[noreturn]] void terracast_throw(void* thrown, void* type,
                                             void (*destroy)(void*)) __asm__("__cxa_throw");

void terracast_throw(void* thrown, void* type, void (*destroy)(void*)) {
  terracast::plugins::note_throw(thrown);
  using Throw = void (*)(void*, void*, void (*)(void*));
  static const auto next = reinterpret_cast<Throw>(dlsym(RTLD_NEXT, "__cxa_throw"));
  next(thrown, type, destroy);
  __builtin_unreachable();
}

// Stand before the C library's own, to which they go on: what a plug-in calls in the midst of a command is found here alone.
// By their names alone, as above.
#define TERRACAST_EXIT(own, name)                                                      \
  extern "C" [[noreturn]] void own(int status) __asm__(#name);                         \
  void own(int status) {                                                               \
    terracast::plugins::note_exit(#name "()");                                         \
    static const auto next = reinterpret_cast<void (*)(int)>(dlsym(RTLD_NEXT, #name)); \
    next(status);                                                                      \
    __builtin_unreachable();                                                           \
  }
TERRACAST_EXIT(terracast_exit, exit)
TERRACAST_EXIT(terracast_quick_exit, quick_exit)
TERRACAST_EXIT(terracast_exit_now, _exit)
TERRACAST_EXIT(terracast_exit_at_once, _Exit)
#undef TERRACAST_EXIT
