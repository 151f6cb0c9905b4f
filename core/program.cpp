#include "core/program.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <system_error>
#include <thread>

#include "core/error.h"

extern char** environ;

namespace terracast::core {
namespace {

namespace fs = std::filesystem;

/// Pointers to texts, ended by a null, as exec wants them.
class Pointers {
 public:
  explicit Pointers(std::vector<std::string> texts) : texts_(std::move(texts)) {
    for (std::string& text : texts_) pointers_.push_back(text.data());
    pointers_.push_back(nullptr);
  }
  char** get() { return pointers_.data(); }

 private:
  std::vector<std::string> texts_;
  std::vector<char*> pointers_;
};

std::vector<std::string> environment_with(const std::vector<std::string>& changes) {
  std::vector<std::string> all = changes;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string_view text = *entry;
    const std::string_view name = text.substr(0, text.find('=') + 1);
    bool is_changed = false;
    for (const std::string& change : changes)
      is_changed = is_changed || (!name.empty() && change.starts_with(name));
    if (!is_changed) all.emplace_back(text);
  }
  return all;
}

/// Becomes the program. Between fork and exec only calls that are safe after the fork of a process
/// with threads.
[[noreturn]] void become(const char* program, char** arguments, char** environment, int input,
                         int output, pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(127);  // it ended before the line above
  if (::dup2(input, 0) < 0 || ::dup2(output, 1) < 0 || ::dup2(output, 2) < 0) ::_exit(127);
  ::execve(program, arguments, environment);
  ::_exit(127);
}

/// Waits for a child, and ends it when its time is up.
ProgramEnd wait_for(pid_t child, double timeout_s) {
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  bool is_late = false;
  for (;;) {
    int state = 0;
    const pid_t ended = ::waitpid(child, &state, is_late ? 0 : WNOHANG);
    if (ended < 0 && errno != EINTR)
      fail(ErrorKind::Io, "waiting for a program: {}", std::generic_category().message(errno));
    if (ended == child) {
      if (is_late) return {.kind = ProgramEnd::Kind::TimedOut, .status = 0};
      if (WIFSIGNALED(state)) return {.kind = ProgramEnd::Kind::Killed, .status = WTERMSIG(state)};
      return {.kind = ProgramEnd::Kind::Exited, .status = WEXITSTATUS(state)};
    }
    if (is_late) continue;
    if (std::chrono::duration<double>(Clock::now() - start).count() > timeout_s) {
      ::kill(child, SIGKILL);
      is_late = true;
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
}

class Descriptor {
 public:
  Descriptor(const fs::path& file, int flags)
      : number_(::open(file.c_str(), flags | O_CLOEXEC, 0666)) {
    if (number_ < 0)
      fail(ErrorKind::Io, "{}: {}", file.string(), std::generic_category().message(errno));
  }
  ~Descriptor() { ::close(number_); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const { return number_; }

 private:
  int number_;
};

}  // namespace

std::optional<fs::path> find_program(const std::string& name) {
  const char* const path = std::getenv("PATH");
  if (path == nullptr || name.empty() || name.find('/') != std::string::npos) return std::nullopt;
  std::string_view folders = path;
  while (!folders.empty()) {
    const std::string_view folder = folders.substr(0, folders.find(':'));
    folders.remove_prefix(std::min(folders.size(), folder.size() + 1));
    const fs::path file = fs::path(folder) / name;
    std::error_code ignored;
    if (!folder.empty() && fs::is_regular_file(file, ignored) && ::access(file.c_str(), X_OK) == 0)
      return file;
  }
  return std::nullopt;
}

std::string ProgramEnd::text() const {
  switch (kind) {
    case Kind::Exited:
      return fmt::format("ended with status {}", status);
    case Kind::Killed:
      return fmt::format("was ended by signal {} ({})", status, strsignal(status));
    case Kind::TimedOut:
      break;
  }
  return "was stopped after its time was up";
}

ProgramEnd run_program(const fs::path& program, const std::vector<std::string>& arguments,
                       const fs::path& log_file, const ProgramLimits& limits) {
  const Descriptor input("/dev/null", O_RDONLY);
  const Descriptor output(log_file, O_WRONLY | O_CREAT | O_APPEND);
  std::vector<std::string> words{program.string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  Pointers argument_pointers(std::move(words));
  Pointers environment(environment_with(limits.environment));
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child == 0)
    become(program.c_str(), argument_pointers.get(), environment.get(), input.number(),
           output.number(), parent);
  if (child < 0)
    fail(ErrorKind::Io, "{}: no process can be started: {}", program.string(),
         std::generic_category().message(errno));
  return wait_for(child, limits.timeout_s);
}

}  // namespace terracast::core
