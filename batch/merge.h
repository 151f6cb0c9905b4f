#pragma once

#include "batch/job_folder.h"
#include "batch/plan.h"
#include "batch/shard_work.h"
#include "core/context.h"

namespace terracast::batch {

/// Makes one dataset of a job's exported runs: reads every file against the checksum that was taken
/// when it was exported, then writes SHA256SUMS and what describes the dataset beside the formats'
/// folders.
/// throws   Input: a file is damaged or missing; Io
ShardResult merge(const Plan& plan, const JobFolder& folder, const core::Context& context);

}  // namespace terracast::batch
