#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "core/error.h"
#include "core/log.h"
#include "core/parallel.h"
#include "export/cameras.h"
#include "export/exporter.h"

namespace terracast::exporters {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;
using core::fail;

capture::SequenceReader open_sequence(const fs::path& folder, const std::string& config_toml) {
  if (!fs::exists(folder))
    fail(ErrorKind::Input, "{}: not captured; run the render stage first", folder.string());
  capture::SequenceReader sequence = capture::SequenceReader::open(folder);
  capture::check_same_config(folder, sequence.info().config_toml, config_toml);
  return sequence;
}

/// Of all sequences, each once.
std::vector<std::string> rigs_of_all(const std::vector<SequenceCameras>& sequences) {
  std::vector<capture::CameraCalibration> all;
  for (const SequenceCameras& sequence : sequences)
    all.insert(all.end(), sequence.cameras.begin(), sequence.cameras.end());
  return rigs_of(all);
}

/// As check_formats() of one.
void check_format(const Exporter& exporter, const std::vector<SequenceCameras>& sequences) {
  if (sequences.empty()) return;
  check_rigs(exporter, rigs_of_all(sequences));
  const bool are_alike =
      std::all_of(sequences.begin(), sequences.end(), [&](const SequenceCameras& sequence) {
        return sequence.cameras == sequences.front().cameras;
      });
  if (are_alike) return exporter.check(sequences.front().cameras);
  const std::vector<capture::CameraCalibration>* checked = nullptr;
  for (const SequenceCameras& sequence : sequences) {
    if (!exporter.takes_any_of(sequence.cameras)) continue;
    if (checked != nullptr && sequence.cameras == *checked) continue;
    core::with_context([&] { exporter.check(sequence.cameras); },
                       "checking the cameras of sequence " + sequence.name);
    checked = &sequence.cameras;
  }
}

/// Those that a format takes; of the others the log is told.
std::vector<capture::SequenceReader> sequences_taken(
    const ExportOptions& options, const std::vector<capture::SequenceReader>& sequences,
    const core::Log& log) {
  std::vector<capture::SequenceReader> taken;
  for (const capture::SequenceReader& sequence : sequences)
    if (options.exporter().takes_any_of(sequence.info().cameras))
      taken.push_back(sequence);
    else
      log.info("{}: sequence {} is left out, none of its rigs ({}) is exported", options.format,
               sequence.info().name, fmt::join(rigs_of(sequence.info().cameras), ", "));
  return taken;
}

void export_sequences(const ExportOptions& options,
                      const std::vector<capture::SequenceReader>& sequences, const fs::path& folder,
                      const core::Context& context) {
  const Exporter& exporter = options.exporter();
  const bool takes_all =
      std::all_of(sequences.begin(), sequences.end(), [&](const capture::SequenceReader& sequence) {
        return exporter.takes_any_of(sequence.info().cameras);
      });
  if (takes_all) return exporter.write(sequences, folder, context);
  exporter.write(sequences_taken(options, sequences, context.log), folder, context);
}

}  // namespace

void check_formats(const std::vector<ExportOptions>& exports,
                   const std::vector<SequenceCameras>& sequences) {
  for (const ExportOptions& chosen : exports)
    core::with_context([&] { check_format(chosen.exporter(), sequences); },
                       fmt::format("checking that format {} can hold the rigs", chosen.format));
}

std::vector<capture::SequenceReader> open_sequences(const fs::path& capture_folder,
                                                    std::vector<WantedSequence> wanted,
                                                    const core::Log& log) {
  std::sort(wanted.begin(), wanted.end(),
            [](const WantedSequence& a, const WantedSequence& b) { return a.name < b.name; });
  std::set<fs::path> others;
  for (const fs::path& folder : capture::list_sequences(capture_folder)) others.insert(folder);
  std::vector<capture::SequenceReader> sequences;
  for (const WantedSequence& each : wanted) {
    sequences.push_back(open_sequence(capture_folder / each.name, each.config_toml));
    others.erase(capture_folder / each.name);
  }
  for (const fs::path& folder : others)
    log.warn("{}: not exported, the config has no such sequence", folder.string());
  return sequences;
}

void run_export_stage(const std::vector<capture::SequenceReader>& sequences,
                      const std::vector<ExportOptions>& exports, const fs::path& out_folder,
                      const core::Context& context) {
  const core::ThreadLimit limit(context.num_threads);
  std::set<std::string> formats;
  for (const ExportOptions& options : exports)
    if (!formats.insert(options.format).second)
      fail(ErrorKind::Config, "two exports of the format {} would share the folder {}; keep one",
           options.format, (out_folder / options.format).string());
  std::error_code ignored;  // no folder yet: nothing in it
  for (const fs::directory_entry& entry : fs::directory_iterator(out_folder, ignored))
    if (formats.count(entry.path().filename().string()) == 0 &&
        fs::exists(entry.path() / "dataset.json"))
      context.log.warn("{}: the config does not export this format any more; it is left as it was",
                       entry.path().string());
  std::vector<SequenceCameras> cameras;
  for (const capture::SequenceReader& sequence : sequences)
    cameras.push_back({sequence.info().name, sequence.info().cameras});
  for (const ExportOptions& options : exports) {
    core::with_context(
        [&] {
          check_format(options.exporter(), cameras);
          export_sequences(options, sequences, out_folder / options.format, context);
        },
        fmt::format("exporting {} to {}", options.format, (out_folder / options.format).string()));
  }
}

}  // namespace terracast::exporters
