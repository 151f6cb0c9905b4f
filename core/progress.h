#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "core/context.h"

namespace terracast::core {

/// Done, total, rate and time left of long work: once a second on a terminal, every 30 s in a log,
/// and a line in events.jsonl for each report. Threads: advance() is safe.
class Progress {
 public:
  /// what   the unit, plural: "tiles"
  Progress(const Context& context, std::string what, std::int64_t total);
  /// Reports the last state.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void advance(std::int64_t count = 1);
  /// Work that was found done already; it does not count into the rate.
  void skip(std::int64_t count = 1);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace terracast::core
