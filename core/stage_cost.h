#pragma once

#include <memory>
#include <string>

#include "core/context.h"

namespace terracast::core {

/// What a stage costs, told in the log and in events.jsonl when it ends, however it ends: wall time,
/// CPU time of all threads, and the process's largest resident memory so far.
class StageCost {
 public:
  /// throws Io: the events cannot be written
  StageCost(const Context& context, std::string stage);
  ~StageCost();
  StageCost(const StageCost&) = delete;
  StageCost& operator=(const StageCost&) = delete;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// "2 h 05 min", "3 min 20 s", "12 s".
std::string duration_text(double duration_s);

}  // namespace terracast::core
