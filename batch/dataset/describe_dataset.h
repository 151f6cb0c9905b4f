#pragma once

#include <filesystem>
#include <vector>

#include "batch/dataset/dataset_options.h"
#include "batch/dataset/sequence_summary.h"
#include "batch/dataset/worst_checks.h"
#include "core/log.h"

namespace terracast::batch {

/// All that a merged dataset is described from.
struct DatasetParts {
  DatasetOptions options;
  std::vector<SequenceSummary> sequences;  ///< with their formats
  std::vector<ValidationReport> reports;
  std::vector<FileFacts> files;  ///< of the exports
  MakingFacts making;
};

/// Divides the sequences and writes index.jsonl, statistics.json, splits/, plots/, README.md and
/// croissant.json into the dataset's folder.
/// log       where it is told how the sequences were divided, and what Croissant misses
/// returns   the files that it wrote
std::vector<FileFacts> describe_dataset(DatasetParts parts, const std::filesystem::path& folder,
                                        const core::Log& log);

}  // namespace terracast::batch
