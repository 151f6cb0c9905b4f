#pragma once

#include <filesystem>
#include <string>

#include "tests/jobs/job.h"

/// Jobs as files.
namespace terracast::test {

/// "0000042".
std::string folder_name(std::uint64_t seed);

/// A text with every occurrence of a part exchanged.
std::string replaced(std::string text, const std::string& what, const std::string& by);

/// A world's file, in the folder `worlds`.
/// configs  the folder of the shipped ones
void write_world(const JobWorld& world, const std::filesystem::path& out,
                 const std::string& configs);

/// A job's files, in a folder of its own, with a config job.toml that runs it alone.
/// data  the folder of source data; empty: none
void write_job(const GeneratedJob& job, const std::filesystem::path& out, const std::string& data);

}  // namespace terracast::test
