#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/schema.h"
#include "sensors/camera/fact_options.h"

namespace terracast::job {

struct RunConfig;

/// Config `[facts]`: what of a capture's facts is looked for. A config that was read names flags alone:
/// resolve_flags() has replaced kNeeded.
struct FactsConfig {
  /// Stands for the flags that the config's exports need.
  static constexpr const char* kNeeded = "needed";

  std::vector<std::string> flags = {kNeeded};  ///< names of capture::flag_groups(), and kNeeded
  bool follow_exports = false;                 ///< resolve_flags() replaced kNeeded

  bool has_needed() const;
  /// Of a config that was read.
  sensors::FactOptions options() const { return {.flags = flags}; }
  void describe(core::SchemaVisitor& visit);
};

/// Replaces FactsConfig::kNeeded by the flags that the exports need.
void resolve_flags(RunConfig& config);

/// Goes on with the flags of what was captured into a folder before, where the config leaves the choice to its exports
/// and these need no more: a format that was left out since makes no other capture.
/// captures   OutputFolders::captures; it need not be there
void keep_captured_flags(RunConfig& config, const std::filesystem::path& captures);

/// throws   Config: an export needs flags that a config with flags alone leaves out
void check_flags(const RunConfig& config);

}  // namespace terracast::job
