#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "batch/claims.h"
#include "batch/job_folder.h"
#include "batch/plan.h"
#include "core/context.h"

namespace terracast::batch {

/// What a worker takes on.
struct WorkerOptions {
  std::vector<Stage> stages = {kStages.begin(), kStages.end()};
  /// Of each stage's shards, the part index of count, which lie side by side.
  int part_index = 0;
  int part_count = 1;
  bool is_part_only = false;    ///< false: its part first, then what others have left
  bool has_needs = false;       ///< also what those need of others and nobody has done
  std::optional<ShardId> only;  ///< this shard alone, poisoned or not
  bool is_retry = false;        ///< poisoned shards are tried again, once
  double quota_bytes = std::numeric_limits<double>::infinity();  ///< of the job's folder
  ClaimOptions claims;
};

/// How things stand when a worker has nothing left to do.
struct WorkerOutcome {
  int num_done = 0;               ///< by this worker
  std::vector<ShardId> poisoned;  ///< failed too often
  std::int64_t num_left = 0;      ///< shards of its stages and part that are not done
  int num_checks_failed = 0;  ///< of all datasets, whoever validated them; with a part: of its own
  bool is_over_quota = false;
  bool is_merged = false;  ///< the dataset is there as the plan has it
};

/// Works on shards of a job until all that it was given are done or can never be: claims one, does
/// it, records it, and waits for those that others hold. Any number of workers may do so at once, on
/// any machines that see the folder. A shard that fails is left with its error, and the next is
/// taken.
/// throws   Interrupted: a stop was asked for; Io: the folder cannot be written, its disk is full
WorkerOutcome run_worker(const Plan& plan, const JobFolder& folder, const WorkerOptions& options,
                         const core::Context& context);

}  // namespace terracast::batch
