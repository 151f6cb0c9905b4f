#include <algorithm>
#include <set>

#include "core/error.h"
#include "core/log.h"
#include "core/parallel.h"
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

}  // namespace

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
  for (const ExportOptions& options : exports) {
    core::with_context(
        [&] {
          for (const capture::SequenceReader& sequence : sequences)
            options.exporter().check(sequence.info().cameras);
          options.exporter().write(sequences, out_folder / options.format, context);
        },
        fmt::format("exporting {} to {}", options.format, (out_folder / options.format).string()));
  }
}

}  // namespace terracast::exporters
