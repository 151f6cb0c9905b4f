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

/// A file that is not as it was made.
struct DamagedFile {
  ShardId shard;     ///< that made it
  std::string file;  ///< with the job's folder
  std::string what;  ///< "is missing", "has changed since it was written"
};

/// A folder that a shard has put in place, and the checksums that were taken of it.
struct CheckedFolder {
  ShardId shard;
  std::filesystem::path root;       ///< what the checksums' paths are relative to
  std::filesystem::path folder;     ///< below the root; may be empty
  std::filesystem::path checksums;  ///< the file that holds them
};
/// What a piece of a shard of Stage::Export or Stage::Validate makes.
CheckedFolder checked_folder(const Plan& plan, const JobFolder& folder, const ShardId& shard,
                             const Piece& piece);

/// Reads every file of some folders against its checksum.
/// checksums   of all files, by path; those of damaged ones as they were
std::vector<DamagedFile> find_damaged(const std::vector<CheckedFolder>& folders,
                                      const core::Context& context,
                                      std::vector<core::FileChecksum>& checksums);

/// Why a file is not what its checksum says, as in DamagedFile::what; empty: it is.
std::string damage_of(const std::filesystem::path& file, const std::string& sha256);

/// How many files are damaged, the first of them, and what has them made again.
std::string damage_message(const std::vector<DamagedFile>& damaged, const JobFolder& folder);

}  // namespace terracast::batch
