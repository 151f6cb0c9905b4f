#include <set>

#include "core/error.h"
#include "core/log.h"
#include "core/parallel.h"
#include "export/exporter.h"

namespace terracast::exporters {

void run_export_stage(const std::filesystem::path& capture_folder,
                      const std::vector<ExportOptions>& exports,
                      const std::filesystem::path& out_folder, const core::Context& context) {
  const core::ThreadLimit limit(context.num_threads);
  std::set<std::string> formats;
  for (const ExportOptions& options : exports)
    if (!formats.insert(options.format).second)
      core::fail(core::ErrorKind::Config,
                 "two exports of the format {} would share the folder {}; keep one", options.format,
                 (out_folder / options.format).string());
  std::vector<capture::SequenceReader> sequences;
  for (const std::filesystem::path& folder : capture::list_sequences(capture_folder))
    sequences.push_back(capture::SequenceReader::open(folder));
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
