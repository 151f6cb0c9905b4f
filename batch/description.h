#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "batch/dataset/dataset_options.h"
#include "batch/sweep.h"
#include "core/toml_reader.h"
#include "job/run_config.h"

namespace terracast::batch {

/// A dataset description: the config of a run, the sweep that makes many of it, and `[dataset]`, what
/// the whole is called and how it is divided. A config without `[sweep]` describes one run.
class Description {
 public:
  /// throws Config, Io: as job::load_run_config
  static Description load(const std::filesystem::path& file, const std::vector<std::string>& sets);
  /// As it was read before, whatever became of its files.
  static Description load(const core::ConfigInputs& inputs);

  std::int64_t num_runs() const { return sweep_.num_runs(); }
  RunChanges changes(std::int64_t index) const { return sweep_.run(index); }
  const SweepOptions& sweep() const { return sweep_.options(); }
  const DatasetOptions& dataset() const { return dataset_; }
  /// The config of a run; its places of errors name the sweep's entry.
  job::RunConfig run_config(std::int64_t index) const;
  /// All that was read so far: the files of runs whose config was asked for.
  core::ConfigInputs inputs() const { return document_.inputs(); }

 private:
  explicit Description(core::TomlDocument document);

  core::TomlDocument document_;
  Sweep sweep_;
  DatasetOptions dataset_;
};

/// Keys that a description has beside a run's, for manuals.
struct DescriptionSections {
  SweepOptions sweep;
  DatasetOptions dataset;
  void describe(core::SchemaVisitor& visit);
};

}  // namespace terracast::batch
