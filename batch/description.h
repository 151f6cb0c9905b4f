#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "batch/sweep.h"
#include "core/toml_reader.h"
#include "job/run_config.h"

namespace terracast::batch {

/// A dataset description: the config of a run, and the sweep that makes many of it. A config without
/// `[sweep]` describes one run.
class Description {
 public:
  /// throws Config, Io: as job::load_run_config
  static Description load(const std::filesystem::path& file, const std::vector<std::string>& sets);
  /// As it was read before, whatever became of its files.
  static Description load(const core::ConfigInputs& inputs);

  std::int64_t num_runs() const { return sweep_.num_runs(); }
  RunChanges changes(std::int64_t index) const { return sweep_.run(index); }
  /// The config of a run; its places of errors name the sweep's entry.
  job::RunConfig run_config(std::int64_t index) const;
  /// All that was read so far: the files of runs whose config was asked for.
  core::ConfigInputs inputs() const { return document_.inputs(); }

 private:
  explicit Description(core::TomlDocument document);

  core::TomlDocument document_;
  Sweep sweep_;
};

/// Keys of `[sweep]`, for manuals.
struct SweepSection {
  SweepOptions sweep;
  void describe(core::SchemaVisitor& visit);
};

}  // namespace terracast::batch
