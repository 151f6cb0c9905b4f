#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

/// What recorded runs leave behind: `scripts/check --full` names a folder in TERRACAST_RECORD, and joins
/// the figures that it finds there.
namespace terracast::test {

/// Nothing in an ordinary run of the tests.
std::optional<std::filesystem::path> record_folder();

/// Whether whole flights and all corruptions are wanted (TERRACAST_FULL).
bool is_recorded_run();

/// Keeps lines of Markdown as `<kind>/<name>.md` of the record; does nothing without one.
void record(const std::string& kind, const std::string& name, const std::string& text);

/// Keeps a report's folder as `reports/<name>`, without COLMAP's databases.
void record_report(const std::string& name, const std::filesystem::path& report);

/// Keeps a whole job's report, and what it cost and how near its results came to their bounds, as a row
/// of a table.
/// out  of `terracast run`
void record_job(const std::string& name, const std::filesystem::path& out);

/// Keeps the results of a report whose names begin in one of these ways, as rows of a table.
void record_results(const std::string& kind, const std::string& name,
                    const std::filesystem::path& report, const std::vector<std::string>& prefixes);

}  // namespace terracast::test

/// Whole flights take minutes to hours.
#define TERRACAST_NEEDS_FULL()               \
  if (!::terracast::test::is_recorded_run()) \
  GTEST_SKIP() << "skipped: a recorded run; scripts/check --full"
