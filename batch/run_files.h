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

/// PlannedRun::checks: a hash of how a run's exports are checked. Plug-ins that add checks count.
std::string checks_key(const job::RunConfig& config);

/// PlannedFormat::key of an export of a run. An export shard also makes the labels and looks up what the
/// dataset's card says of a run's ground: that counts too.
/// within_m   of the dataset's GroundOptions
std::string format_key(const job::RunConfig& config, const exporters::ExportOptions& chosen,
                       double within_m);

/// format   into PlannedRun::formats
/// throws   Input: a plug-in that takes part in it is not the one that the plan was made with
void check_plugins_of_format(const PlannedRun& run, std::size_t format,
                             const job::RunConfig& config, double within_m);
/// throws   Input: the plug-ins with checks are not those that the plan was made with
void check_plugins_of_checks(const PlannedRun& run, const job::RunConfig& config);

/// throws   Input: a file that its flights are read from is another than when the plan was made, or
///          is missing (names it, among others where there are several)
void check_flight_files(const PlannedRun& run, const std::string& world,
                        const job::RunConfig& config);

}  // namespace terracast::batch
