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
#include <span>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>

#include "core/error.h"
#include "core/stop.h"

extern char** environ;

namespace terracast::core {
namespace {

namespace fs = std::filesystem;

/// How long a wait sleeps before it looks again: little beside the start of a process.
constexpr std::chrono::milliseconds kBetweenLooks{5};

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

/// Gives descriptors the numbers from 3 on.
/// returns   false: the system does not
bool number_descriptors(std::span<int> descriptors) {
  constexpr int kFirst = STDERR_FILENO + 1;
  // Out of the way first: one may have another's number.
  for (int& one : descriptors) {
    one = ::fcntl(one, F_DUPFD_CLOEXEC, kFirst + static_cast<int>(descriptors.size()));
    if (one < 0) return false;
  }
  for (std::size_t i = 0; i < descriptors.size(); ++i)
    if (::dup2(descriptors[i], kFirst + static_cast<int>(i)) < 0) return false;
  return true;
}

/// Becomes the program. Between fork and exec only calls that are safe after the fork of a process
/// with threads.
[[noreturn]] void become(const char* program, char** arguments, char** environment, int input,
                         int output, std::span<int> descriptors, pid_t parent) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(127);  // it ended before the line above
  sigset_t none;
  ::sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  if (::dup2(input, 0) < 0 || ::dup2(output, 1) < 0 || ::dup2(output, 2) < 0) ::_exit(127);
  if (!number_descriptors(descriptors)) ::_exit(127);
  ::execve(program, arguments, environment);
  ::_exit(127);
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

RunningProgram::RunningProgram(const fs::path& program, const std::vector<std::string>& arguments,
                               const ProgramOptions& options) {
  const Descriptor input("/dev/null", O_RDONLY);
  std::optional<Descriptor> log;
  if (options.log_file) log.emplace(*options.log_file, O_WRONLY | O_CREAT | O_APPEND);
  const int output = log ? log->number() : STDERR_FILENO;
  std::vector<std::string> words{program.string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  Pointers argument_pointers(std::move(words));
  Pointers environment(environment_with(options.environment));
  std::vector<int> descriptors = options.descriptors;
  const pid_t parent = ::getpid();
  const pid_t child = ::fork();
  if (child == 0)
    become(program.c_str(), argument_pointers.get(), environment.get(), input.number(), output,
           descriptors, parent);
  if (child < 0)
    fail(ErrorKind::Io, "{}: no process can be started: {}", program.string(),
         std::generic_category().message(errno));
  process_ = child;
}

RunningProgram::~RunningProgram() { kill(); }

RunningProgram::RunningProgram(RunningProgram&& other) noexcept
    : process_(std::exchange(other.process_, 0)), end_(other.end_) {}

RunningProgram& RunningProgram::operator=(RunningProgram&& other) noexcept {
  if (this == &other) return *this;
  kill();
  process_ = std::exchange(other.process_, 0);
  end_ = other.end_;
  return *this;
}

void RunningProgram::kill() noexcept {
  if (process_ == 0 || end_) return;
  ::kill(process_, SIGKILL);
  while (::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

std::optional<ProgramEnd> RunningProgram::end() {
  TERRACAST_CHECK(process_ != 0, "a program that was moved away is asked for its end");
  if (end_) return end_;
  int state = 0;
  const pid_t ended = ::waitpid(process_, &state, WNOHANG);
  if (ended < 0 && errno != EINTR)
    fail(ErrorKind::Io, "waiting for a program: {}", std::generic_category().message(errno));
  if (ended != process_) return std::nullopt;
  if (WIFSIGNALED(state))
    end_ = {.kind = ProgramEnd::Kind::Killed, .status = WTERMSIG(state)};
  else
    end_ = {.kind = ProgramEnd::Kind::Exited, .status = WEXITSTATUS(state)};
  return end_;
}

std::optional<ProgramEnd> RunningProgram::wait(double timeout_s) {
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  while (!end() && std::chrono::duration<double>(Clock::now() - start).count() < timeout_s)
    std::this_thread::sleep_for(kBetweenLooks);
  return end();
}

void RunningProgram::send(int signal) {
  // One that has ended keeps its number until end() has seen it: no other process is hit.
  if (!end() && ::kill(process_, signal) != 0)
    fail(ErrorKind::Io, "a program cannot be sent signal {}: {}", signal,
         std::generic_category().message(errno));
}

ProgramEnd run_program(const fs::path& program, const std::vector<std::string>& arguments,
                       const fs::path& log_file, const ProgramLimits& limits) {
  RunningProgram running(program, arguments,
                         {.log_file = log_file, .environment = limits.environment});
  constexpr double kLook_s = 0.1;
  for (double left_s = limits.timeout_s; left_s > 0.0; left_s -= kLook_s) {
    if (const auto end = running.wait(std::min(left_s, kLook_s))) return *end;
    throw_if_stop_asked();
  }
  return {.kind = ProgramEnd::Kind::TimedOut, .status = 0};
}

std::string shell_quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) {
    if (c == '\'')
      result += "'\\''";
    else
      result += c;
  }
  return result + "'";
}

}  // namespace terracast::core
