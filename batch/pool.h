#pragma once

#include <filesystem>

#include "batch/worker.h"

namespace terracast::batch {

/// Workers as processes of their own on this machine: one that crashes is replaced, and what it held
/// is taken up.
struct PoolOptions {
  std::filesystem::path program;  ///< terracast
  int num_workers = 2;
  int num_threads = 0;   ///< of each; 0: the machine's cores divided among them
  WorkerOptions worker;  ///< `only` is for one process, and none of a pool's
};

/// Runs workers until nothing is left to do, and tells how far they are. What each says goes to
/// logs/HOST-worker-K.log of the job; its warnings are passed on.
/// throws   as its workers did, Interrupted before all else; Io: a worker cannot be started
WorkerOutcome run_pool(const Plan& plan, const JobFolder& folder, const PoolOptions& options,
                       const core::Context& context);

}  // namespace terracast::batch
