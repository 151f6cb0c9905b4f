#include "batch/merge.h"

#include <set>

#include "batch/checksums.h"
#include "batch/dataset/describe_dataset.h"
#include "core/atomic_file.h"

namespace terracast::batch {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

/// Of every exported file, all read.
/// throws Input: one is not as it was exported
std::vector<core::FileChecksum> checked_files(const Plan& plan, const JobFolder& folder,
                                              const core::Context& context) {
  std::vector<core::FileChecksum> checksums;
  const std::vector<DamagedFile> damaged = find_damaged(plan, folder, context, checksums);
  if (!damaged.empty())
    fail(ErrorKind::Input,
         "{}: {} {}, and {} files in all are not as they were exported; `terracast batch verify {} "
         "--repair` has them made again",
         folder.dataset().string(), damaged.front().path, damaged.front().what, damaged.size(),
         folder.root.string());
  return checksums;
}

std::vector<SequenceSummary> summaries(const Plan& plan, const JobFolder& folder) {
  std::vector<SequenceSummary> all;
  for (const PlannedRun& run : plan.runs)
    for (const PlannedSequence& sequence : run.sequences) {
      const fs::path file = folder.summary(run, sequence.name);
      all.push_back(summary_from_json(core::Json::read(file), file.string()));
      for (const PlannedFormat& format : run.formats)
        all.back().facts.formats.push_back(format.name);
    }
  return all;
}

std::vector<ValidationReport> reports(const Plan& plan, const JobFolder& folder) {
  std::vector<ValidationReport> all;
  for (const PlannedRun& run : plan.runs)
    for (const PlannedFormat& format : run.formats)
      all.push_back({run.name, format.name,
                     core::Json::read(folder.report(run, format.name) / "report.json")});
  return all;
}

}  // namespace

ShardResult merge(const Plan& plan, const JobFolder& folder, const core::Context& context) {
  std::vector<core::FileChecksum> checksums = checked_files(plan, folder, context);
  const Description description = Description::load(plan.inputs);
  DatasetParts parts{.options = description.dataset(),
                     .sequences = summaries(plan, folder),
                     .reports = reports(plan, folder),
                     .files = {},
                     .making = {.program_version = TERRACAST_VERSION,
                                .configs = {plan.name},
                                .seeds = {description.run_config(0).seed}}};
  for (const core::FileChecksum& checksum : checksums)
    parts.files.push_back(
        {checksum.path, fs::file_size(folder.dataset() / checksum.path), checksum.sha256});
  double bytes = 0.0;
  for (const FileFacts& file : describe_dataset(std::move(parts), folder.dataset(), context.log)) {
    checksums.push_back({file.path, file.sha256});
    bytes += static_cast<double>(file.num_bytes);
  }
  const std::string lines = core::checksum_lines(std::move(checksums));
  core::write_file(folder.dataset() / "SHA256SUMS", lines);
  return {.num_frames = plan.num_frames(), .bytes = bytes + static_cast<double>(lines.size())};
}

}  // namespace terracast::batch
