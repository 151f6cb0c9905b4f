#pragma once

#include <string>

#include "core/context.h"
#include "core/json.h"

namespace terracast::core {

/// Appends lines to events.jsonl, for programs that watch long work; does nothing where the context
/// names no file. Threads: one at a time; several processes may write the same file.
class EventLog {
 public:
  /// throws Io: cannot be written
  explicit EventLog(const Context& context);
  ~EventLog();
  EventLog(const EventLog&) = delete;
  EventLog& operator=(const EventLog&) = delete;

  /// Writes `event`, with the time in front. The first failure is told in the log, and the last.
  void write(const Json& event);

 private:
  const Log& log_;
  int file_ = -1;
  bool has_failed_ = false;
};

}  // namespace terracast::core
