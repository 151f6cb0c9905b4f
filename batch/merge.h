#pragma once

#include "batch/checksums.h"
#include "batch/job_folder.h"
#include "batch/plan.h"
#include "batch/shard_work.h"
#include "core/context.h"

namespace terracast::batch {

/// Of all files of the dataset, in its folder.
inline constexpr const char* kChecksumsFile = "SHA256SUMS";

/// What the merge is told of sequences by a shard of Stage::Export, where it is damaged.
std::vector<DamagedFile> find_damaged_summaries(const Plan& plan, const JobFolder& folder,
                                                const Shard& shard);

/// Makes one dataset of a job's exported runs: reads every file against the checksum that was taken
/// when it was exported, then writes SHA256SUMS and what describes the dataset beside the formats'
/// folders.
/// throws   Input: a file is damaged or missing; Io
ShardResult merge(const Plan& plan, const JobFolder& folder, const core::Context& context);

}  // namespace terracast::batch
