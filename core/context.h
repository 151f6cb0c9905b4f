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
};

}  // namespace terracast::core
