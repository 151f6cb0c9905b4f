#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "batch/claims.h"
#include "batch/plan.h"

namespace terracast::batch {

/// How a job is put on a Slurm cluster. What is empty or 0 follows from the plan.
struct SlurmOptions {
  std::filesystem::path program = {};  ///< terracast, as the nodes see it
  std::string partition = {};
  int num_cpus = 1;             ///< of a task
  double memory_bytes = 0.0;    ///< of a task
  double task_min = 30.0;       ///< that a task shall take; shards are bundled to it
  double time_limit_min = 0.0;  ///< of a task; 0: three times its stage's longest, 30 or more
  int max_array_size = 1001;    ///< MaxArraySize of the cluster: the largest index + 1
  int max_tasks = 10000;        ///< of a stage
  ClaimOptions claims = {};     ///< of the tasks
  std::vector<std::string> arguments = {};  ///< for sbatch, as they are
};

/// Tasks into which a stage's shards are bundled: each takes the part I of N that `batch run --shard
/// I/N` takes. None for a stage without shards.
int num_tasks(const Plan& plan, Stage stage, const SlurmOptions& options);

/// A shell script that puts every stage of a job on the cluster, as arrays that wait for the stage
/// before to end, well or not; it prints the number of each array. Where one is refused it takes back
/// those before. What tasks leave undone, those of the next stage do first. A task whose time is
/// nearly up goes back into the queue; one that is cancelled stays so.
/// job   its folder, as the nodes see it
/// throws Usage: options that make no sense; a name that Slurm cannot take
std::string slurm_script(const Plan& plan, const std::filesystem::path& job,
                         const SlurmOptions& options);

}  // namespace terracast::batch
