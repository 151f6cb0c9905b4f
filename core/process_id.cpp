#include "core/process_id.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/random.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <system_error>

#include "core/error.h"
#include "core/hash.h"

namespace terracast::core {
namespace {

/// The whole of a small file of /proc; empty where there is none.
std::string read_proc(const std::string& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return {};
  char buffer[1024];
  const ssize_t count = ::read(descriptor, buffer, sizeof buffer);
  ::close(descriptor);
  return count > 0 ? std::string(buffer, static_cast<std::size_t>(count)) : std::string();
}

std::string machine_name() {
  char name_space[64] = {};
  const ssize_t length = ::readlink("/proc/self/ns/pid", name_space, sizeof name_space - 1);
  std::string text = read_proc("/proc/sys/kernel/random/boot_id");
  if (length > 0) text.append(name_space, static_cast<std::size_t>(length));
  return content_hash(text).substr(0, 8);
}

/// When a process started, in clock ticks since boot, as its kernel record says; empty when there
/// is no such process. With it a number that was given out again is not mistaken for the first
/// process.
std::string process_start(long process) {
  const std::string record = read_proc(fmt::format("/proc/{}/stat", process));
  std::size_t at = record.rfind(')');  // the name in brackets may hold anything
  if (at == std::string::npos) return {};
  // A dead process whose parent has not asked for its end holds its number, and does nothing.
  if (record.compare(at, 3, ") Z") == 0) return {};
  for (int field = 2; field < 22 && at != std::string::npos; ++field) at = record.find(' ', at + 1);
  if (at == std::string::npos) return {};
  return record.substr(at + 1, record.find(' ', at + 1) - at - 1);
}

}  // namespace

std::string this_process() {
  const long process = ::getpid();
  return fmt::format("{}-{}-{}", machine_name(), process, process_start(process));
}

ProcessState process_state(std::string_view process) {
  const std::size_t number_at = process.find('-');
  const std::size_t start_at =
      number_at == std::string_view::npos ? number_at : process.find('-', number_at + 1);
  if (start_at == std::string_view::npos || process.substr(0, number_at) != machine_name())
    return ProcessState::Elsewhere;
  const std::string number(process.substr(number_at + 1, start_at - number_at - 1));
  const long id = std::strtol(number.c_str(), nullptr, 10);
  const std::string_view start = process.substr(start_at + 1);
  return id > 0 && !start.empty() && process_start(id) == start ? ProcessState::Lives
                                                                : ProcessState::Ended;
}

std::string host_name() {
  char name[256] = {};
  return ::gethostname(name, sizeof name - 1) == 0 ? name : "unknown";
}

std::string random_name() {
  std::uint64_t random = 0;
  if (::getrandom(&random, sizeof random, 0) != sizeof random)
    fail(ErrorKind::Io, "no random name: {}",
         std::error_code(errno, std::generic_category()).message());
  return fmt::format("{:016x}", random);
}

}  // namespace terracast::core
