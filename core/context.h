#pragma once

#include <filesystem>

#include "core/log.h"

namespace terracast::core {

/// What a stage is given beside its options; there are no globals.
struct Context {
  const Log& log;
  int num_threads = 0;  ///< 0: one for each core
  std::filesystem::path events_file =
      {};  ///< progress events are appended here (events.jsonl); empty: none

  /// The same with another log, which must outlive what is returned.
  Context with_log(const Log& other) const {
    return {.log = other, .num_threads = num_threads, .events_file = events_file};
  }
};

}  // namespace terracast::core
