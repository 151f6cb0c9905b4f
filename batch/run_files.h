#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "batch/plan.h"
#include "job/run_config.h"

namespace terracast::batch {

/// A hash of what a file, or all files of a folder, hold; of what is neither, of its path.
std::string hash_of_path(const std::filesystem::path& path);

/// PlannedRun::key of a run. Of the files that its flights are read from the content counts.
/// world     its key
/// hash_of   hash_of_path(), or what remembers it
std::string run_key(const std::string& world, const std::string& edits,
                    const job::RunConfig& config,
                    const std::function<std::string(const std::filesystem::path&)>& hash_of);

/// throws   Input: a file that its flights are read from is another than when the plan was made, or
///          is missing (names it, among others where there are several)
void check_flight_files(const PlannedRun& run, const std::string& world,
                        const job::RunConfig& config);

}  // namespace terracast::batch
