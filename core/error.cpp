#include "core/error.h"

#include <string_view>

namespace terracast::core {

int exit_status(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::Usage:
    case ErrorKind::Config:
      return 2;
    case ErrorKind::Input:
      return 3;
    case ErrorKind::Io:
      return 4;
    case ErrorKind::Interrupted:
      return 75;
    case ErrorKind::Internal:
      break;
  }
  return 70;
}

Error::Error(ErrorKind kind, std::string message)
    : kind_(kind), message_(std::move(message)), text_(message_) {}

void Error::add_context(std::string doing) {
  text_ += "\n  while " + doing;
  context_.push_back(std::move(doing));
}

void fail_with_message(ErrorKind kind, std::string message) {
  throw Error(kind, std::move(message));
}

void check_failed(const char* condition, const char* file, int line, const std::string& message) {
  // The last two parts of the path name the file; the rest is the machine that compiled it.
  std::string_view place = file;
  const std::size_t name = place.rfind('/');
  if (name != std::string_view::npos && name > 0) {
    const std::size_t folder = place.rfind('/', name - 1);
    if (folder != std::string_view::npos) place.remove_prefix(folder + 1);
  }
  throw Error(ErrorKind::Internal,
              fmt::format("{}:{}: the check \"{}\" failed{}{}; please report this", place, line,
                          condition, message.empty() ? "" : ": ", message));
}

}  // namespace terracast::core
