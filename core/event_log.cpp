#include "core/event_log.h"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <system_error>

#include "core/atomic_file.h"
#include "core/error.h"

namespace terracast::core {
namespace {

std::string text_of_errno() { return std::error_code(errno, std::generic_category()).message(); }

}  // namespace

EventLog::EventLog(const Context& context) : log_(context.log) {
  if (context.events_file.empty()) return;
  make_folder(context.events_file.parent_path());
  file_ = ::open(context.events_file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
  if (file_ < 0)
    fail(ErrorKind::Io, "{}: cannot be written: {}", context.events_file.string(), text_of_errno());
}

EventLog::~EventLog() {
  if (file_ >= 0) ::close(file_);
}

void EventLog::write(const Json& event) {
  if (file_ < 0 || has_failed_) return;
  const auto now = std::chrono::system_clock::now();
  Json line = Json::object().set(
      "time",
      fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::chrono::system_clock::to_time_t(now))));
  for (const auto& [name, value] : event.members()) line.set(name, value);
  // One write() for a line: with O_APPEND the lines of several processes do not mix.
  const std::string text = line.text(-1) + "\n";
  if (::write(file_, text.data(), text.size()) == static_cast<ssize_t>(text.size())) return;
  has_failed_ = true;
  log_.warn("the progress events cannot be written: {}", text_of_errno());
}

}  // namespace terracast::core
