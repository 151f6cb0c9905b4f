#pragma once

#include <string>
#include <vector>

#include "batch/job_folder.h"
#include "batch/plan.h"
#include "core/context.h"
#include "core/sha256.h"

namespace terracast::batch {

/// The checksums of all files below a folder, sorted by path.
/// exported   what the folder will be called, relative to the dataset's
std::vector<core::FileChecksum> checksums_of(const std::filesystem::path& folder,
                                             const std::filesystem::path& exported);

/// Those that were taken when a run was exported.
/// throws   Io: there are none; Input: damaged
std::vector<core::FileChecksum> read_checksums(const std::filesystem::path& file);

/// A file of the dataset that is not what was exported.
struct DamagedFile {
  ShardId shard;     ///< that exported it
  std::string path;  ///< relative to the dataset's folder
  std::string what;  ///< "is missing", "has changed", "was not exported"
};

/// Reads every exported file of a job against its checksum.
/// checksums   of all files, by path; those of damaged ones as they were exported
std::vector<DamagedFile> find_damaged(const Plan& plan, const JobFolder& folder,
                                      const core::Context& context,
                                      std::vector<core::FileChecksum>& checksums);

}  // namespace terracast::batch
