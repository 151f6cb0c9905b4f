#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "batch/plan.h"
#include "tests/support/cluster_simulation.h"

namespace terracast::test {

/// What shards of one stage cost, over what was planned.
struct MeasuredStage {
  /// Least squares over the shards that were done: fixed_s and rate times the planned CPU time.
  double fixed_s = 0.0;
  double rate = 1.0;
  double bytes_rate = 1.0;  ///< bytes written over those planned
  std::vector<double>
      residuals;  ///< measured over fitted, of each shard: where stragglers come from
};

/// What a batch that was run cost, from its plan and its records of shards that are done.
struct MeasuredJob {
  std::array<MeasuredStage, batch::kStages.size()> stages;
  double merge_s_per_byte = 0.0;  ///< of exported bytes
};

/// is_wall   wall times in place of CPU times
/// throws    Io, Input: as read_plan; Input: a stage of which no shard is done
MeasuredJob measure_job(const std::filesystem::path& job_folder, bool is_wall);

/// The CPU times that were measured, each shard with its own, in the plan's order.
std::vector<std::vector<double>> measured_times(const batch::Plan& plan,
                                                const std::filesystem::path& job_folder,
                                                bool is_wall);

/// How a stage's shards use the file system: operations of the metadata server, and bytes read.
struct FileUse {
  double operations_per_shard = 0.0;
  double operations_per_frame = 0.0;
  double read_bytes_per_shard = 0.0;
  double read_bytes_per_frame = 0.0;
};
using FileUses = std::array<FileUse, batch::kStages.size()>;

/// The shards of a plan with their needs, as batch::Board has them, without costs.
SimulatedJob job_of(const batch::Plan& plan);

/// The same with costs: what is planned for each shard, as the stage's fit has it, times a residual
/// drawn from those that were measured.
SimulatedJob job_of(const batch::Plan& plan, const MeasuredJob& measured, const FileUses& uses,
                    std::uint64_t seed);

}  // namespace terracast::test
