#pragma once

#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/atomic_file.h"
#include "core/log.h"
#include "validate/check.h"

/// COLMAP asked about a dataset, by the program itself or by a script in its place.
namespace terracast::validate {

namespace fs = std::filesystem;

using Results = std::map<std::string, CheckResult>;

inline Results ask_colmap(const fs::path& dataset, const fs::path& report,
                          const std::vector<std::string>& modes) {
  const core::Log log("validate", core::LogLevel::Off);
  ValidateOptions options;
  options.colmap = modes;
  options.colmap_seeds = 1;
  Results results;
  for (CheckResult& result : run_validate_stage(dataset, options, report, {log}))
    if (result.name.starts_with("colmap_")) results[result.name] = std::move(result);
  return results;
}

inline std::string text_of(const Results& results) {
  std::string text;
  for (const auto& [name, result] : results)
    text += fmt::format("{} {} = {:.5g} {} (bound {:.4g}): {}\n   {}\n",
                        result.ok ? result.skipped ? "skip" : "ok  " : "BAD ", name, result.value,
                        result.unit, result.bound, result.worst, result.summary);
  return text;
}

/// Puts a script before the real program, for as long as it lives.
class FakeColmap {
 public:
  FakeColmap(const fs::path& folder, const std::string& script) : old_path_(std::getenv("PATH")) {
    core::write_file(folder / "colmap", "#!/bin/sh\n" + script + "\n");
    fs::permissions(folder / "colmap", fs::perms::owner_all);
    ::setenv("PATH", (folder.string() + ":" + old_path_).c_str(), 1);
  }
  ~FakeColmap() { ::setenv("PATH", old_path_.c_str(), 1); }
  FakeColmap(const FakeColmap&) = delete;
  FakeColmap& operator=(const FakeColmap&) = delete;

 private:
  std::string old_path_;
};

inline constexpr const char* kSaysHelp =
    "[ $1 = help ] && { echo 'COLMAP 3.8 -- a test'; exit 0; }\n";

}  // namespace terracast::validate
