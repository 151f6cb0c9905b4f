#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "batch/checksums.h"
#include "batch/claims.h"
#include "batch/job_folder.h"
#include "batch/plan.h"
#include "core/context.h"

namespace terracast::batch {

struct VerifyOptions {
  std::int64_t num_samples = 4;  ///< frames that are rendered once more
  std::int64_t seed = 1;         ///< of their choice
  bool is_repaired = false;      ///< shards whose results are damaged are opened again
  ClaimOptions claims;
};

/// What a verification found.
struct Verification {
  std::vector<DamagedFile> damaged;
  std::int64_t num_files = 0;   ///< exported files and reports
  std::int64_t num_frames = 0;  ///< of captures
  std::int64_t num_tiles = 0;
  std::int64_t num_open = 0;  ///< shards that were not done yet: of them nothing was looked at
  std::vector<std::string> sampled;    ///< "run0003/P000, frame 17", in the order of rendering
  std::vector<std::string> differing;  ///< of these, those that came out with other bytes
  std::vector<ShardId> reopened;

  bool is_right() const { return damaged.empty() && differing.empty(); }
};

/// Looks at what a job has done so far: reads every exported file, report and record against its
/// checksum, SHA256SUMS too, and so captures and tiles that are still there; and renders a sample of
/// the frames once more: they have the same bytes.
/// With is_repaired the shards whose results are damaged, and those that are made from these, are
/// done no more, and no earlier failure of theirs or of what was given up counts: the next workers
/// make them again.
/// throws   Input: nothing is exported yet, and no repair was asked for; Io
Verification verify(const Plan& plan, const JobFolder& folder, const VerifyOptions& options,
                    const core::Context& context);

}  // namespace terracast::batch
