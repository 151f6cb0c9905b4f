#include "batch/merge.h"

#include <algorithm>
#include <set>

#include "batch/checksums.h"
#include "batch/dataset/describe_dataset.h"
#include "batch/update.h"
#include "core/atomic_file.h"

namespace terracast::batch {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

/// Of every exported file, all read.
/// throws Input: one is not as it was exported; a report or summary is not as it was made
std::vector<core::FileChecksum> checked_files(const Plan& plan, const JobFolder& folder,
                                              const core::Context& context) {
  std::vector<core::FileChecksum> exported;
  std::vector<DamagedFile> damaged;
  for (const Stage stage : {Stage::Validate, Stage::Export}) {
    std::vector<CheckedFolder> folders;
    for (const Shard& shard : plan.of(stage))
      for (const Piece& piece : shard.pieces)
        folders.push_back(checked_folder(plan, folder, shard.id, piece));
    for (DamagedFile& file : find_damaged(folders, context, exported))
      damaged.push_back(std::move(file));
  }
  for (const Shard& shard : plan.of(Stage::Export))
    for (DamagedFile& file : find_damaged_summaries(plan, folder, shard))
      damaged.push_back(std::move(file));
  if (!damaged.empty()) fail(ErrorKind::Input, "{}", damage_message(damaged, folder));
  return exported;
}

std::vector<SequenceSummary> summaries(const Plan& plan, const JobFolder& folder,
                                       const Description& description) {
  std::vector<SequenceSummary> all;
  for (const PlannedRun& run : plan.runs) {
    const job::RunConfig config = description.run_config(run.index);
    for (const PlannedSequence& sequence : run.sequences) {
      const fs::path file = folder.summary(run, sequence.name);
      all.push_back(summary_from_json(core::Json::read(file), file.string()));
      SequenceSummary& summary = all.back();
      summary.facts.swept = run.changes;
      // A format has those whose bodies carry a rig that it takes.
      for (const auto& chosen : config.exports)
        if (std::any_of(
                summary.cameras.begin(), summary.cameras.end(),
                [&](const CameraFacts& camera) { return chosen.exporter().takes(camera.rig); }))
          summary.facts.formats.push_back(chosen.format);
    }
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

std::vector<DamagedFile> find_damaged_summaries(const Plan& plan, const JobFolder& folder,
                                                const Shard& shard) {
  std::vector<DamagedFile> damaged;
  for (const Piece& piece : shard.pieces) {
    if (piece.format != 0) continue;
    const PlannedRun& run = plan.runs[static_cast<std::size_t>(piece.run)];
    for (const PlannedSequence& sequence : run.sequences) {
      const fs::path file = folder.summary(run, sequence.name);
      try {
        summary_from_json(core::Json::read(file), file.string());
      } catch (const core::Error& error) {
        if (error.kind() != ErrorKind::Input && error.kind() != ErrorKind::Io) throw;
        damaged.push_back({shard.id, file.string(), "is missing, or not as it was written"});
      }
    }
  }
  return damaged;
}

namespace {

/// Adds the plug-ins that a dataset's or a report's record says took part.
void add_plugins(const core::Json& record, std::set<std::string>& plugins) {
  if (!record.has("plugins")) return;
  for (std::size_t i = 0; i < record.at("plugins").size(); ++i) {
    const core::Json& one = record.at("plugins").at(i);
    plugins.insert(fmt::format("{} {} ({})", one.at("name").string(), one.at("version").string(),
                               one.at("licence").string()));
  }
}

MakingFacts making_facts(const Plan& plan, const JobFolder& folder, const Description& description,
                         const std::vector<ValidationReport>& reports) {
  MakingFacts making{
      .program_version = TERRACAST_VERSION, .configs = {plan.name}, .seeds = {}, .sweep_seed = {}};
  for (const PlannedRun& run : plan.runs)
    making.seeds.push_back(description.run_config(run.index).seed);
  for (const PlannedRun& run : plan.runs)
    for (const PlannedFormat& format : run.formats)
      add_plugins(core::Json::read(folder.dataset() / JobFolder::exported(run, format.name) /
                                   "dataset.json"),
                  making.plugins);
  for (const ValidationReport& report : reports) add_plugins(report.report, making.plugins);
  if (!description.sweep().draws.empty()) making.sweep_seed = description.sweep().seed;
  return making;
}

}  // namespace

ShardResult merge(const Plan& plan, const JobFolder& folder, const core::Context& context) {
  std::vector<core::FileChecksum> checksums = checked_files(plan, folder, context);
  const Description description = Description::load(plan.inputs);
  DatasetParts parts{.options = description.dataset(),
                     .sequences = summaries(plan, folder, description),
                     .reports = reports(plan, folder),
                     .files = {},
                     .making = {}};
  parts.making = making_facts(plan, folder, description, parts.reports);
  for (const core::FileChecksum& checksum : checksums)
    parts.files.push_back(
        {checksum.path, fs::file_size(folder.dataset() / checksum.path), checksum.sha256});
  Attempt attempt(folder);
  const fs::path described = attempt.folder() / "described";
  double bytes = 0.0;
  for (const FileFacts& file : describe_dataset(std::move(parts), described, context.log)) {
    checksums.push_back({file.path, file.sha256});
    bytes += static_cast<double>(file.num_bytes);
  }
  throw_if_outdated(folder.root, plan.revision);
  remove_unplanned(plan, folder);
  for (const auto& entry : fs::directory_iterator(described))
    attempt.place(entry.path(), folder.dataset() / entry.path().filename());
  const std::string lines = core::checksum_lines(std::move(checksums));
  attempt.place_text(lines, folder.dataset() / kChecksumsFile);
  return {.num_frames = plan.num_frames(), .bytes = bytes + static_cast<double>(lines.size())};
}

}  // namespace terracast::batch
