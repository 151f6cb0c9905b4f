#include "tests/export/exported.h"

#include "core/context.h"
#include "core/hash.h"
#include "core/log.h"
#include "core/toml_reader.h"

namespace terracast::test {

exporters::ExportOptions export_options(const std::string& toml) {
  exporters::ExportOptions options;
  core::TomlDocument::parse(toml, "test.toml").read(options);
  return options;
}

std::vector<capture::SequenceReader> open_all(const std::filesystem::path& capture) {
  std::vector<capture::SequenceReader> sequences;
  for (const std::filesystem::path& folder : capture::list_sequences(capture))
    sequences.push_back(capture::SequenceReader::open(folder));
  return sequences;
}

void run_export(const std::filesystem::path& capture, const std::string& toml,
                const std::filesystem::path& out, int num_threads) {
  const core::Log log("export", core::LogLevel::Off);
  exporters::run_export_stage(open_all(capture), {export_options(toml)}, out,
                              {.log = log, .num_threads = num_threads});
}

std::map<std::string, std::string> file_hashes(const std::filesystem::path& folder) {
  std::map<std::string, std::string> hashes;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      hashes[std::filesystem::relative(entry.path(), folder).string()] =
          core::content_hash_of_file(entry.path());
  return hashes;
}

}  // namespace terracast::test
