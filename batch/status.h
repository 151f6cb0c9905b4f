#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "batch/claims.h"
#include "batch/job_folder.h"
#include "batch/plan.h"
#include "core/json.h"

namespace terracast::batch {

/// How far a job has come: all from its own folder.
struct Status {
  struct StageStatus {
    Stage stage = Stage::Tile;
    std::int64_t num_shards = 0;
    std::int64_t num_done = 0;
    std::int64_t num_held = 0;  ///< being worked on
    std::int64_t num_poisoned = 0;
    std::int64_t num_frames = 0;  ///< of the shards that are done
    std::int64_t num_frames_planned = 0;
    double cpu_s = 0.0;  ///< of those that are done
    double wall_s = 0.0;
    double cpu_planned_s = 0.0;  ///< of all
    double cpu_planned_done_s = 0.0;
    double bytes = 0.0;
  };
  struct Slow {
    ShardId shard;
    double wall_s = 0.0;
    double factor = 0.0;  ///< its CPU time over what was expected, over its stage's own ratio
  };

  struct Tried : Claims::Tried {
    std::string run;  ///< its name; empty for the merge
  };

  std::string name;
  std::vector<StageStatus> stages;
  std::vector<std::string> left_out;  ///< names of runs that the plan leaves out
  std::vector<Tried> tried;           ///< shards with tries that are not done
  std::vector<Slow> slowest;          ///< of those that are done, the worst first
  std::int64_t num_checks_failed = 0;
  double frames_per_s =
      0.0;               ///< rendered by those that work now, at the rate of those that are done
  double left_s = -1.0;  ///< expected; -1: nobody is at work, or nothing is known yet

  bool is_complete() const;
  double bytes() const;
};

/// cost   a listing of folders, and one small file for each shard that is done
Status status_of(const Plan& plan, const JobFolder& folder, const ClaimOptions& options);

/// job   its folder, as the commands that repeat failures name it
std::string status_text(const Status& status, const std::string& job);
core::Json status_json(const Status& status, const std::string& job);

}  // namespace terracast::batch
